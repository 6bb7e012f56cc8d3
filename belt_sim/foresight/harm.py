"""Runs of a plan that could harm the belt or mean nothing: an edge slack, steel near its strength, laws left behind."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from belt_sim.campaign import Campaign, case_of
from belt_sim.case import Belt, Case, Rig, Schedule, Settings
from belt_sim.units import DEGREE, N_PER_MM2
from belt_sim.validity import STRENGTH, Limit, geometric, limits

#: Share of the yaw at which an edge goes slack, or the linear laws end, that a plan may use.
SHARE = 0.8
#: Share of the belt's bending fatigue strength that tension, bending over the pulleys and the yaw together may reach.
STRESS = 0.9
#: A yaw at which the limits are asked; their loads go with the yaw or with its square [rad].
_ASKED = 0.01 * DEGREE


def safe_yaw(rig: Rig, belt: Belt, tensions: Iterable[float]) -> float:
    """Return the largest yaw [rad] that harms no run at these tensions [Pa] and leaves no law of the models behind."""
    found = []
    for tension in tensions:
        case = Case(rig=rig, belt=belt, settings=Settings(tension=tension, yaw=Schedule.step(_ASKED)))
        load = {limit.id: float(limit.load) for limit in limits(case)}
        bent = load["thick_belt"] * STRENGTH
        room = max(STRESS * STRENGTH - bent, 0.0) / (tension * load["slack_edge"])
        ends = (("slack_edge", 1.0), ("second_order", 0.5))  # neither without gravity and sag
        found += [(SHARE / load[name]) ** power for name, power in ends if load[name] > 0.0]
        found += [room] if room else []  # a belt that its pulleys alone bend too far is told of, whatever the yaw
    return _ASKED * min(found)


def harm_warnings(campaign: Campaign) -> tuple[str, ...]:
    """Return a sentence a kind of harm, the runs concerned and the worst of them named."""
    found: dict[str, list[tuple[Limit, str]]] = {}
    for run in campaign.runs:
        for limit in _harm(case_of(campaign, replace(run, yaw_at=0.0))):
            found.setdefault(limit.id, []).append((limit, run.name))
    sentences = []
    for runs in found.values():
        worst, name = max(runs, key=lambda run: run[0].load)
        some = f"{len(runs)} of {len(campaign.runs)} runs" if len(runs) > 1 else f"run {name}"
        sentences.append(f"{some}: {worst.words} ({worst.exceeded_by}{f', worst in {name}' if len(runs) > 1 else ''})")
    return tuple(sentences)


def _harm(case: Case) -> Sequence[Limit]:
    """The limits of harm that a case is beyond."""
    load = {limit.id: float(limit.load) for limit in limits(case)}
    tension = float(case.settings.tension)
    stress = load["thick_belt"] * STRENGTH + tension * load["slack_edge"]
    own = (
        Limit("slack_edge", load["slack_edge"], "the yaw takes the tension off one edge; take a smaller yaw"),
        Limit("second_order", load["second_order"], "the yaw is too large for the models' laws; take a smaller one"),
        Limit(
            "stress",
            stress / STRENGTH,
            f"tension, bending and yaw reach {stress / N_PER_MM2:.0f} of the {STRENGTH / N_PER_MM2:.0f} N/mm2 that belt"
            " steels bear; take a smaller yaw or a larger pulley",
        ),
    )
    seen = {limit.id for limit in own} | {"edge_stretch", "thick_belt"}
    return [limit for limit in (*own, *geometric(case)) if limit.load > 1.0 and (limit in own or limit.id not in seen)]
