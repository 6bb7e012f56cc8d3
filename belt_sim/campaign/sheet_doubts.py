"""Known mistakes in a campaign's sheet, each as a hypothesis with the campaign as it would be without it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any

import numpy as np

from belt_sim.campaign.types import PLACES, Campaign, Quantity, Run

#: kind of mistake -> what to check: {where} it is, its {size}, {why} it may have been made
MISTAKE_WORDS = {
    "yaw_place": "where the yaw was applied: {where} the belt begins to move {size} m after the stated yaw_at",
    "yaw_sign": "the sign of the yaw: {where} the belt moves as after a yaw of the other sign",
    "yaw_unit": "the unit of the yaw: {where} the belt moves as after {size} times the yaw ({why}?)",
    "direction": "the direction of travel: {where} the belt moves as if it ran the other way",
    "points": "where the sensors stand: {where} {why}",
    "radius": "the pulleys' radius: the belt moves as over pulleys of {size} times the radius ({why}?)",
    "centre_distance": "the centre distance: the belt moves as on {size} times the stated one ({why}?)",
    "width": "the belt's width (or its modulus, or the tensions): it is as stiff as one {size} times as wide",
    "thickness": "the belt's thickness: it hangs and bends as one {size} times as thick",
    "modulus": "Young's modulus: the belt is as stiff as one of {size} times the stated modulus",
    "tension": "the tensions: the belt moves as at {size} times the stated ones ({why}?)",
    "travel_unit": "the unit of the travel: the belt moves as over {size} times the stated travel ({why}?)",
    "reading_unit": "the unit of the readings: they look {size} ({why}?)",
}
#: kind of mistake in one number or more -> the part of the campaign, and its numbers that the size multiplies
_SCALED = {
    "yaw_sign": ("runs", ("yaw", "yaw_head")),
    "yaw_unit": ("runs", ("yaw", "yaw_head")),
    "direction": ("runs", ("direction",)),
    "radius": ("machine", ("head_radius", "tail_radius")),
    "centre_distance": ("machine", ("centre_distance",)),
    "width": ("belt", ("width",)),
    "thickness": ("belt", ("thickness",)),
    "modulus": ("belt", ("youngs_modulus",)),
    "tension": ("runs", ("tension",)),
    "travel_unit": ("runs", ("travel", "yaw_at", "yaw_at_u")),
}
#: Kinds of which sizes between those tried make sense, and which may concern some of the runs alone.
CONTINUOUS, BY_RUN = ("yaw_place", "width"), ("yaw_place", "yaw_sign", "direction")
#: How much later than stated a yaw may have come, as a share of a span; sizes between these are refined.
YAW_DELAYS = (0.03, 0.07, 0.15, 0.3, 0.6, 1.0, 2.0)
#: Widths that a slip of the hand makes of the true one, over the stated one.
WIDTHS = (0.1, 0.5, 0.8, 1.25, 2.0, 10.0)
FEET, INCH, KILOPOND = 0.3048, 25.4, 9.80665
#: Readings as they should be, over the stated ones -> the slip.
_READINGS = (
    (INCH, "were inches entered as mm"),
    (1.0 / INCH, "were mm entered as inches"),
    (10.0, "were cm entered as mm"),
    (0.1, "were mm entered as cm"),
)
LONGEST_CENTRE_DISTANCE = 1000.0  # [m]


@dataclass(frozen=True, kw_only=True)
class SheetMistake:
    """One mistake: what to check, and the campaign without it.

    stated: the campaign with the mistake; size: of the mistake, in the unit of its sentence; why: the slip that makes
    this size; runs: names of the runs concerned (() for all); places: signal -> place at which it reads, of ``points``.
    """

    stated: Campaign
    kind: str
    size: float
    why: str = ""
    runs: tuple[str, ...] = ()
    places: Mapping[str, str] = field(default_factory=dict)

    @property
    def campaign(self) -> Campaign:
        """The campaign as it would be if this mistake was made."""
        stated, size, kind = self.stated, self.size, self.kind
        part, names = _SCALED.get(kind, ("signals" if kind == "points" else "runs", ()))
        if part == "signals":
            return replace(stated, signals=tuple(replace(s, at=self.places.get(s.name, s.at)) for s in stated.signals))
        if part != "runs":
            sheet = getattr(stated, part)
            scaled = {n: Quantity(value=size * q.value, u=size * q.u) for n, q in vars(sheet).items() if n in names}
            return replace(stated, **{part: replace(sheet, **scaled)})
        lateral, runs = {s.name for s in stated.signals if s.kind == "lateral"}, list[Run]()
        for run in stated.runs:
            change: dict[str, Any] = {n: size * getattr(run, n) for n in names}
            if kind == "yaw_place":
                change = {"yaw_at": run.yaw_at + size}
            elif kind == "reading_unit":
                change = {"signals": {n: size * y if n in lateral else y for n, y in run.signals.items()}}
            runs.append(replace(run, **change) if not self.runs or run.name in self.runs else run)
        return replace(stated, runs=tuple(runs))

    @property
    def sentence(self) -> str:
        """What to check, and what speaks for it."""
        where = f"in run{'s' if len(self.runs) > 1 else ''} {', '.join(self.runs)}" if self.runs else "in all runs"
        size = f"{self.size:.3g}"
        if self.kind == "reading_unit":
            large = self.size < 1.0
            size = f"{1.0 / self.size if large else self.size:.3g} times too {'large' if large else 'small'}"
        return "check " + MISTAKE_WORDS[self.kind].format(where=where, size=size, why=self.why)

    @property
    def log_jacobian(self) -> float:
        """ln of what a reading is multiplied by: smaller readings fit any model better, but are less likely."""
        return float(np.log(self.size)) if self.kind == "reading_unit" else 0.0


def sheet_mistakes(campaign: Campaign) -> tuple[SheetMistake, ...]:
    """Return every known mistake that this campaign's sheet could hold."""
    machine = campaign.machine
    span, radii = machine.centre_distance.value, machine.head_radius.value + machine.tail_radius.value
    sizes: list[tuple[str, float, str]] = [("yaw_place", share * span, "") for share in YAW_DELAYS]
    if any(r.yaw for r in campaign.runs):
        sizes += [("yaw_sign", -1.0, ""), ("yaw_unit", 0.18 / np.pi, "mrad as degrees")]
        sizes.append(("yaw_unit", np.pi / 0.18, "degrees as mrad"))
    sizes += [("direction", -1.0, ""), ("radius", 0.5, "the diameter is stated as the radius")]
    if 2.0 * radii < span:
        sizes.append(("radius", 2.0, "half the radius is stated"))
    feet = [(FEET, "feet as metres"), (1.0 / FEET, "metres as feet")]
    spans = [("centre_distance", size, why) for size, why in [*feet, (0.5, "both spans as one")]]
    sizes += [one for one in spans if radii < one[1] * span < LONGEST_CENTRE_DISTANCE]
    sizes += [("width", size, "") for size in WIDTHS]
    for size in (0.1, 10.0):
        sizes += [("thickness", size, ""), ("modulus", size, ""), ("tension", size, "a decimal point")]
    sizes += [
        ("tension", 0.5, "the pulley's load, which both spans share"),
        ("tension", KILOPOND, "kgf for N"),
        ("tension", 1.0 / KILOPOND, "N for kgf"),
    ]
    sizes += [("travel_unit", size, why) for size, why in [*feet, (0.1, "dm"), (10.0, "a decimal point")]]
    sizes += [("reading_unit", size, why) for size, why in _READINGS]
    found = [SheetMistake(stated=campaign, kind=kind, size=size, why=why) for kind, size, why in sizes]
    # which sensors may stand at each other's place, or at a free one
    lateral = [s for s in campaign.signals if s.kind == "lateral"]
    free = [place for place, kind in PLACES.items() if kind == "lateral" and place not in {s.at for s in lateral}]
    exchanged = [{a.name: b.at, b.name: a.at} for a, b in combinations(lateral, 2) if a.at != b.at]
    for at in [*exchanged, *({s.name: place} for s in lateral for place in free)]:
        why = " and ".join(f"{name} reads as at {place}" for name, place in at.items())
        found.append(SheetMistake(stated=campaign, kind="points", size=1.0, why=why, places=at))
    return tuple(found)
