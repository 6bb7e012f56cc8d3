"""Dirty data, found before anything is fitted and without any model of the belt.

What is looked for: sensors that clip, stick or drop out; units that slipped; columns that were exchanged;
signs that were turned round. Every check is one of magnitude, of repetition, or of kinematics that all belts
share.
"""

from belt_sim.campaign.guided import closed_loop
from belt_sim.campaign.lead import lead_of_the_tail
from belt_sim.campaign.nouns import Campaign
from belt_sim.campaign.offsets import shifted_runs
from belt_sim.campaign.places import one_place
from belt_sim.campaign.record import Record, records
from belt_sim.campaign.record_checks import broken_record, gaps, noise_out_of_scale
from belt_sim.campaign.sister_checks import against_sisters, exchanged_across_a_wrap, travel_out_of_scale
from belt_sim.campaign.suspect import Suspicion


def suspicions(campaign: Campaign) -> tuple[Suspicion, ...]:
    """Everything in a campaign that looks like a slip of the hand or a broken sensor, worst first.

    severity "stop": do not fit before this is cleared; "look": an effect of the machine could do the same.
    """
    all_records = records(campaign)
    found: list[Suspicion] = []
    for record in all_records:
        found += broken_record(record)
    broken = {(s.run, s.signal) for s in found}
    sound = [r for r in all_records if (r.run.name, r.sheet.name) not in broken]
    found += gaps(campaign)
    found += travel_out_of_scale(campaign)
    found += noise_out_of_scale(sound)
    slips = [s for s in found if s.kind == "unit_slip"]
    sound = [r for r in sound if not any(_touches(slip, r) for slip in slips)]
    shifts = shifted_runs(campaign, sound)
    sound = [r for r in sound if not any(_touches(shift, r) for shift in shifts)]
    found += shifts + lead_of_the_tail(campaign, sound)
    turned = [s for s in found if s.kind in ("swapped", "wrong_sign", "unit_slip")]
    found += [s for s in against_sisters(sound) if not any(_covers(t, s) for t in turned)]
    found += exchanged_across_a_wrap(campaign, sound)
    found += one_place(campaign, sound)
    if not any(s.severity == "stop" for s in found):
        found += closed_loop(campaign, sound)
    return tuple(sorted(found, key=lambda s: s.severity != "stop"))


def _covers(known: Suspicion, new: Suspicion) -> bool:
    """Whether what is known explains the new suspicion too."""
    same_run = known.run in (None, new.run)
    return same_run and (known.signal is None or (new.signal or "") in known.signal.split(" and "))


def _touches(known: Suspicion, record: Record) -> bool:
    """Whether a suspicion speaks of this record."""
    return known.run in (None, record.run.name) and known.signal in (None, record.sheet.name)
