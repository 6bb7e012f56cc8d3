"""Data-quality checks of a campaign, before any fit and without any belt model.

They find sensors that clip, stick or drop out, slipped units, exchanged columns and turned signs, by magnitude, by
repetition, and by kinematics that all belts share.
"""

from belt_sim.campaign.quality.bad_readings import check_gaps, check_record, leave_out_bad_readings
from belt_sim.campaign.quality.cross_run import check_copies, check_signs
from belt_sim.campaign.quality.guide import check_guide
from belt_sim.campaign.quality.leads import check_leads
from belt_sim.campaign.quality.places import check_places, check_wraps
from belt_sim.campaign.quality.record import Record, Suspicion, records_of
from belt_sim.campaign.quality.starts import check_starts, counted_from_yaw
from belt_sim.campaign.quality.unit_slips import check_noise, check_travel
from belt_sim.campaign.types import Campaign


def suspicions(campaign: Campaign) -> tuple[Suspicion, ...]:
    """Return everything that looks like a slip of the hand or a broken sensor, severity "stop" first.

    Spikes and short dropouts, and records that one check finds broken, are left out of the later checks.
    """
    gaps = check_gaps(campaign)
    campaign, left_out = leave_out_bad_readings(campaign)
    all_records = records_of(campaign)
    found: list[Suspicion] = [*left_out]
    for record in all_records:
        found += check_record(record)
    broken = {(s.run, s.signals) for s in found if s.severity == "stop"}
    sound = [r for r in all_records if (r.run.name, (r.sheet.name,)) not in broken]
    found += gaps
    found += check_copies(all_records)
    found += check_travel(campaign)
    found += check_noise(sound)
    slips = [s for s in found if s.kind == "unit_slip"]
    sound = [r for r in sound if not any(_touches(slip, r) for slip in slips)]
    sound = counted_from_yaw(sound)
    shifts = check_starts(campaign, sound)
    sound = [r for r in sound if not any(_touches(shift, r) for shift in shifts)]
    found += shifts + check_leads(campaign, sound)
    turned = [s for s in found if s.kind in ("swapped", "wrong_sign", "unit_slip")]
    found += [s for s in check_signs(sound) if not any(_covers(t, s) for t in turned)]
    found += check_wraps(campaign, sound)
    found += check_places(campaign, sound)
    if not any(s.severity == "stop" for s in found):
        found += check_guide(campaign, sound)
    return tuple(sorted(found, key=lambda s: s.severity != "stop"))


def _covers(known: Suspicion, new: Suspicion) -> bool:
    """Return whether a known suspicion explains a new one of a single signal too."""
    return known.run in (None, new.run) and (not known.signals or set(new.signals) <= set(known.signals))


def _touches(known: Suspicion, record: Record) -> bool:
    """Return whether a suspicion concerns this record."""
    return known.run in (None, record.run.name) and known.signals in ((), (record.sheet.name,))
