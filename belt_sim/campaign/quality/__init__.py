"""Data-quality checks of a campaign, before any fit and without any belt model.

They find sensors that clip, stick or drop out, slipped units, exchanged columns and turned signs, by magnitude, by
repetition, and by kinematics that all belts share.
"""

from belt_sim.campaign.quality.guide import check_guide
from belt_sim.campaign.quality.kinematics import check_copies, check_leads, check_places, check_signs, check_wraps
from belt_sim.campaign.quality.record import Record, Suspicion, records_of
from belt_sim.campaign.quality.signals import (
    check_gaps,
    check_noise,
    check_record,
    check_starts,
    check_travel,
    counted_from_yaw,
    leave_out_bad_readings,
)
from belt_sim.campaign.types import Campaign


def suspicions(campaign: Campaign) -> tuple[Suspicion, ...]:
    """Return everything that looks like a slip of the hand or a broken sensor, severity "stop" first.

    Spikes and short dropouts, and records that one check finds broken, are left out of the later checks.
    """
    gaps = check_gaps(campaign)
    campaign, left_out = leave_out_bad_readings(campaign)
    records = records_of(campaign)
    broken = [s for record in records for s in check_record(record)]
    found = [*left_out, *broken, *gaps, *check_copies(records), *check_travel(campaign)]
    sound = _others(records, broken)
    found += check_noise(sound)
    sound = counted_from_yaw(_others(sound, [s for s in found if s.kind == "unit_slip"]))
    shifts = check_starts(campaign, sound)
    sound = _others(sound, shifts)
    found += [*shifts, *check_leads(campaign, sound)]
    known = [s for s in found if s.kind in ("swapped", "wrong_sign", "unit_slip")]
    found += [s for s in check_signs(sound) if not any(_covers(k, s) for k in known)]
    found += [*check_wraps(campaign, sound), *check_places(campaign, sound)]
    if not any(s.severity == "stop" for s in found):
        found += check_guide(campaign, sound)
    return tuple(sorted(found, key=lambda s: s.severity != "stop"))


def _others(records: list[Record], suspected: list[Suspicion]) -> list[Record]:
    """Return the records that none of these suspicions concerns."""
    return [r for r in records if not any(_concerns(s, r) for s in suspected)]


def _concerns(known: Suspicion, record: Record) -> bool:
    return known.run in (None, record.run.name) and known.signals in ((), (record.sheet.name,))


def _covers(known: Suspicion, new: Suspicion) -> bool:
    """Return whether a known suspicion explains a new one of a single signal too."""
    return known.run in (None, new.run) and (not known.signals or set(new.signals) <= set(known.signals))
