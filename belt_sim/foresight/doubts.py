"""What a campaign's runs leave open whatever they measure: no second tension, no opposite yaw, no repeat ..."""

from belt_sim.analytic.composition import Composition
from belt_sim.campaign import Campaign, suspicions
from belt_sim.campaign.quality.kinematics import span_of
from belt_sim.foresight.harm import harm_warnings
from belt_sim.foresight.sheet_evidence import sheet_suspicions
from belt_sim.results.check import Doubt

SPANS = 3.0  # a record shorter than so many spans shows the start of the movement only


def doubts(campaign: Campaign, model: Composition, *, planned: bool) -> tuple[Doubt, ...]:
    """Slips in the data and in the sheet first, then what the plan lacks."""
    found = []
    if not planned:
        slips = suspicions(campaign)
        for s in (*slips, *sheet_suspicions(campaign, model, slips)):
            found.append(Doubt(kind=s.kind, sentence=str(s), stops=s.severity == "stop"))
    found += [Doubt(kind="harm", sentence=s) for s in harm_warnings(campaign)]
    return (*found, *(Doubt(kind="plan", sentence=s) for s in _lacking(campaign)), *_sheet(campaign))


def _lacking(campaign: Campaign) -> list[str]:
    runs, found = campaign.runs, []
    tensions = {round(r.tension / 1e3) for r in runs}
    if len(tensions) < 2:
        found.append("there is one tension; a second one tells what belongs to the belt's stiffness or its sag")
    if not any(r.yaw > 0.0 for r in runs) or not any(r.yaw < 0.0 for r in runs):
        found.append("there is one sign of yaw; the other one tells what the machine does by itself from what yaw does")
    if not any(r.yaw == 0.0 and r.yaw_head == 0.0 for r in runs):
        found.append("there is no run at zero yaw; one shows what the machine does by itself, and the noise")
    if not any(r.repeat_of for r in runs):
        found.append("no run is repeated; noise is read off repeats, and is taken as stated without")
    if len({r.direction for r in runs}) < 2:
        found.append("there is one direction of travel; one reversed run tells offsets of a pulley from skewed rollers")
    curved = [r for r in runs if len(r.travel)]
    span = span_of(campaign)
    short = [r.name for r in curved if r.travel[-1] - r.yaw_at < SPANS * span]
    if curved and len(short) == len(curved):
        found.append(f"no record reaches {SPANS:g} spans ({SPANS * span:.0f} m): late drift is hardly in it")
    if curved and len(campaign.signals) < 2:
        found.append(
            "there is one signal; a second point, at the other pulley, tells drift from a belt that stands askew"
        )
    return found


def _sheet(campaign: Campaign) -> list[Doubt]:
    """What the sheet states as perfect that no instrument is."""
    perfect = [s.name for s in campaign.signals if s.zero == 0.0]
    found = []
    if perfect and campaign.source.kind != "synthetic":
        sentence = f"zero of {', '.join(perfect)} is not stated and counts as perfect; state how well y = 0 is known"
        found.append(Doubt(kind="sheet", sentence=sentence))
    if campaign.source.kind != "synthetic" and campaign.settings.yaw_u == 0.0:
        found.append(Doubt(kind="sheet", sentence="settings.yaw is not stated: every yaw counts as exact"))
    return found
