"""Known mistakes in a campaign's sheet, each as a hypothesis with the campaign as it would be without it."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal

import numpy as np

from belt_sim.campaign.types import PLACES, Campaign, Quantity, Run

MistakeKind = Literal[
    "yaw_place",
    "yaw_sign",
    "yaw_unit",
    "direction",
    "radius",
    "width",
    "thickness",
    "modulus",
    "tension",
    "centre_distance",
    "travel_unit",
    "points",
    "reading_unit",
]
#: How much later than stated a yaw may have come, as a share of a span; sizes between these are refined.
DELAYS = (0.03, 0.07, 0.15, 0.3, 0.6, 1.0, 2.0)
#: Widths that a slip of the hand makes of the true one, over the stated one.
WIDTHS = (0.1, 0.5, 0.8, 1.25, 2.0, 10.0)
FEET, INCH, KILOPOND = 0.3048, 25.4, 9.80665


@dataclass(frozen=True, kw_only=True)
class SheetMistake:
    """One mistake: what to check, and the campaign without it.

    size: of the mistake, in the unit of its sentence; runs: names of the runs concerned (() for all); build: size,
    runs -> the corrected campaign; continuous: whether sizes between those tried make sense; by_run: whether some of
    the runs alone may be concerned.
    """

    kind: MistakeKind
    size: float
    words: str
    build: Callable[[float, Sequence[str]], Campaign]
    runs: tuple[str, ...] = ()
    signals: tuple[str, ...] = ()
    continuous: bool = False
    by_run: bool = False

    @property
    def campaign(self) -> Campaign:
        """The campaign as it would be if this mistake was made."""
        return self.build(self.size, self.runs)

    @property
    def sentence(self) -> str:
        """What to check, and what speaks for it."""
        where = f"in run{'s' if len(self.runs) > 1 else ''} {', '.join(self.runs)}" if self.runs else "in all runs"
        return self.words.format(where=where, size=f"{self.size:.3g}")

    @property
    def log_jacobian(self) -> float:
        """ln of what a reading is multiplied by: smaller readings fit any model better, but are less likely."""
        return float(np.log(self.size)) if self.kind == "reading_unit" else 0.0

    def of_runs(self, runs: Sequence[str]) -> "SheetMistake":
        """The same mistake in some runs only."""
        return replace(self, runs=tuple(runs))

    def of_size(self, size: float) -> "SheetMistake":
        """The same mistake of another size."""
        return replace(self, size=size)


def sheet_mistakes(campaign: Campaign) -> tuple[SheetMistake, ...]:
    """Return every known mistake that this campaign's sheet could hold."""
    return (
        *_of_yaws(campaign),
        *_of_directions(campaign),
        *_of_points(campaign),
        *_of_machine(campaign),
        *_of_belt(campaign),
        *_of_units(campaign),
    )


def _with_runs(campaign: Campaign, change: Callable[[Run], Run], runs: Sequence[str] = ()) -> Campaign:
    """The campaign with some runs (all, if none is named) changed."""
    return replace(campaign, runs=tuple(change(r) if not runs or r.name in runs else r for r in campaign.runs))


def _of_yaws(campaign: Campaign) -> Iterable[SheetMistake]:
    span = campaign.machine.centre_distance.value

    def with_later_yaw(size: float, runs: Sequence[str]) -> Campaign:
        return _with_runs(campaign, lambda r: replace(r, yaw_at=r.yaw_at + size), runs)

    def with_opposite_yaw(_: float, runs: Sequence[str]) -> Campaign:
        return _with_runs(campaign, lambda r: replace(r, yaw=-r.yaw, yaw_head=-r.yaw_head), runs)

    def with_scaled_yaw(size: float, runs: Sequence[str]) -> Campaign:
        return _with_runs(campaign, lambda r: replace(r, yaw=size * r.yaw, yaw_head=size * r.yaw_head), runs)

    words = "check where the yaw was applied: {where} the belt begins to move {size} m after the stated yaw_at"
    for share in DELAYS:
        yield SheetMistake(
            kind="yaw_place", size=share * span, words=words, build=with_later_yaw, continuous=True, by_run=True
        )
    if any(r.yaw for r in campaign.runs):
        words = "check the sign of the yaw: {where} the belt moves as after a yaw of the other sign"
        yield SheetMistake(kind="yaw_sign", size=-1.0, words=words, build=with_opposite_yaw, by_run=True)
        for size, names in ((0.18 / np.pi, "mrad as degrees"), (np.pi / 0.18, "degrees as mrad")):
            words = f"check the unit of the yaw: {{where}} the belt moves as after {{size}} times the yaw ({names}?)"
            yield SheetMistake(kind="yaw_unit", size=size, words=words, build=with_scaled_yaw)


def _of_directions(campaign: Campaign) -> Iterable[SheetMistake]:
    def reversed_runs(_: float, runs: Sequence[str]) -> Campaign:
        return _with_runs(campaign, lambda r: replace(r, direction=-r.direction), runs)

    words = "check the direction of travel: {where} the belt moves as if it ran the other way"
    yield SheetMistake(kind="direction", size=-1.0, words=words, build=reversed_runs, by_run=True)


def _of_points(campaign: Campaign) -> Iterable[SheetMistake]:
    lateral = [s for s in campaign.signals if s.kind == "lateral"]
    taken = {s.at for s in lateral}

    def mistake(places: dict[str, str]) -> SheetMistake:
        said = " and ".join(f"{name} reads as at {at}" for name, at in places.items())

        def build(_: float, __: Sequence[str]) -> Campaign:
            signals = (replace(s, at=places.get(s.name, s.at)) for s in campaign.signals)
            return replace(campaign, signals=tuple(signals))

        words = f"check where the sensors stand: {{where}} {said}"
        return SheetMistake(kind="points", size=1.0, words=words, build=build, signals=tuple(places))

    for a, b in combinations(lateral, 2):
        if a.at != b.at:
            yield mistake({a.name: b.at, b.name: a.at})
    for signal in lateral:
        for place, kind in PLACES.items():
            if kind == "lateral" and place not in taken:
                yield mistake({signal.name: place})


def _scale(quantity: Quantity, factor: float) -> Quantity:
    return Quantity(value=quantity.value * factor, u=quantity.u * factor)


def _of_machine(campaign: Campaign) -> Iterable[SheetMistake]:
    machine = campaign.machine

    def radii(size: float, _: Sequence[str]) -> Campaign:
        scaled = {name: _scale(getattr(machine, name), size) for name in ("head_radius", "tail_radius")}
        return replace(campaign, machine=replace(machine, **scaled))

    def distance(size: float, _: Sequence[str]) -> Campaign:
        changed = replace(machine, centre_distance=_scale(machine.centre_distance, size))
        return replace(campaign, machine=changed)

    both = machine.head_radius.value + machine.tail_radius.value
    words = "check the pulleys' radius: the belt moves as over pulleys of {size} times the radius (%s?)"
    yield SheetMistake(kind="radius", size=0.5, words=words % "the diameter is stated as the radius", build=radii)
    if 2.0 * both < machine.centre_distance.value:
        yield SheetMistake(kind="radius", size=2.0, words=words % "half the radius is stated", build=radii)
    words = "check the centre distance: the belt moves as on {size} times the stated one (%s?)"
    for size, said in ((FEET, "feet as metres"), (1.0 / FEET, "metres as feet"), (0.5, "both spans as one")):
        if both < size * machine.centre_distance.value < 1000.0:
            yield SheetMistake(kind="centre_distance", size=size, words=words % said, build=distance)


def _of_belt(campaign: Campaign) -> Iterable[SheetMistake]:
    belt = campaign.belt

    def mistake(name: str, kind: MistakeKind, size: float, words: str, continuous: bool) -> SheetMistake:
        def build(size: float, _: Sequence[str]) -> Campaign:
            return replace(campaign, belt=replace(belt, **{name: _scale(getattr(belt, name), size)}))

        return SheetMistake(kind=kind, size=size, words=words, build=build, continuous=continuous)

    words = "check the belt's width (or its modulus, or the tensions): it is as stiff as one {size} times as wide"
    for size in WIDTHS:
        yield mistake("width", "width", size, words, True)
    for size in (0.1, 10.0):
        words = "check the belt's thickness: it hangs and bends as one {size} times as thick"
        yield mistake("thickness", "thickness", size, words, False)
        words = "check Young's modulus: the belt is as stiff as one of {size} times the stated modulus"
        yield mistake("youngs_modulus", "modulus", size, words, False)


def _of_units(campaign: Campaign) -> Iterable[SheetMistake]:
    def tensions(size: float, _: Sequence[str]) -> Campaign:
        return _with_runs(campaign, lambda r: replace(r, tension=size * r.tension))

    def travel(size: float, _: Sequence[str]) -> Campaign:
        return _with_runs(
            campaign, lambda r: replace(r, travel=size * r.travel, yaw_at=size * r.yaw_at, yaw_at_u=size * r.yaw_at_u)
        )

    def readings(size: float, _: Sequence[str]) -> Campaign:
        lateral = {s.name for s in campaign.signals if s.kind == "lateral"}

        def change(run: Run) -> Run:
            return replace(run, signals={n: size * y if n in lateral else y for n, y in run.signals.items()})

        return _with_runs(campaign, change)

    words = "check the tensions: the belt moves as at {size} times the stated ones (%s?)"
    for size, said in (
        (0.5, "the pulley's load, which both spans share"),
        (0.1, "a decimal point"),
        (10.0, "a decimal point"),
        (KILOPOND, "kgf for N"),
        (1.0 / KILOPOND, "N for kgf"),
    ):
        yield SheetMistake(kind="tension", size=size, words=words % said, build=tensions)
    words = "check the unit of the travel: the belt moves as over {size} times the stated travel (%s?)"
    for size, said in (
        (FEET, "feet as metres"),
        (1.0 / FEET, "metres as feet"),
        (0.1, "dm"),
        (10.0, "a decimal point"),
    ):
        yield SheetMistake(kind="travel_unit", size=size, words=words % said, build=travel)
    words = "check the unit of the readings: they are as {size} times the stated ones (%s?)"
    for size, said in ((INCH, "inch as mm"), (1.0 / INCH, "mm as inch"), (10.0, "cm as mm"), (0.1, "mm as cm")):
        yield SheetMistake(kind="reading_unit", size=size, words=words % said, build=readings)
