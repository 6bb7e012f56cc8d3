"""Data classes of a measured campaign: one machine, one belt, many runs, each number's uncertainty; its problems."""

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from belt_sim.case import Belt, Case, Rig, Schedule, Settings
from belt_sim.curves import SensorPlace
from belt_sim.errors import BeltError, InputError
from belt_sim.units import DEGREE, N_PER_MM2

Kind = Literal["lateral", "tilt"]
Use = Literal["fit", "hold_out"]

#: measuring place -> kind of signal: lateral position [m], or roll of the cross-section [rad]
PLACES: dict[str, Kind] = {
    **dict.fromkeys(("point_1", "point_2", "point_3", "point_4"), "lateral"),
    **dict.fromkeys(("upper_mid_span", "lower_mid_span"), "tilt"),
}
_ELSEWHERE = re.compile(r"(upper_span|lower_span|tail_wrap|head_wrap) at ([0-9]+(?:\.[0-9]*)?(?:e-?[0-9]+)?) m")
ELSEWHERE_EXAMPLE = "{span: upper, distance: 2.0} or {wrap: tail, distance: 0.2}"


def sensor_place(at: str) -> SensorPlace | None:
    """The place that a text like ``upper_span at 2 m`` names; None for a point, a mid-span and all else."""
    found = _ELSEWHERE.fullmatch(at)
    return SensorPlace(found[1], float(found[2])) if found else None  # type: ignore[arg-type]


def first_place_inside_span(signals: "Sequence[SignalSheet]") -> SensorPlace | None:
    """The first place of a sensor inside a span; None where none stands there."""
    return next((place for place in (sensor_place(s.at) for s in signals) if place and not place.on_wrap), None)


def kind_at(at: str) -> Kind | None:
    """What a sensor at a place measures; None where there is no such place."""
    return PLACES.get(at) or ("lateral" if sensor_place(at) else None)


def place_text(at: Any) -> Any:
    """A place as a text: of ``{span: upper, distance: 2.0}`` or ``{wrap: tail, distance: 0.2}``, else as it is.

    Raises InputError for a mapping that is neither.
    """
    if not isinstance(at, Mapping):
        return at
    given, sides = dict(at), {"span": ("upper", "lower"), "wrap": ("tail", "head")}
    far, what = given.pop("distance", None), next(iter(given), "")
    side = given.get(what)
    try:
        metres = float(str(far).removesuffix("m"))
    except ValueError:
        metres = float("nan")
    if len(given) != 1 or side not in sides.get(what, ()) or not 0.0 <= metres < float("inf"):
        raise InputError("at", str(dict(at)), "", f"write a place by its name, or as {ELSEWHERE_EXAMPLE}, in m")
    return str(SensorPlace(f"{side}_{what}", metres))  # type: ignore[arg-type]


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A value and its standard uncertainty u (one sigma), both in SI; u = 0 means taken as exact."""

    value: float
    u: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Source:
    """Where the data come from."""

    kind: Literal["measured", "digitised", "synthetic"]
    reference: str = ""
    licence: str = ""


@dataclass(frozen=True, kw_only=True)
class Machine:
    """centre_distance, head_radius, tail_radius [m], the radii to the belt's middle surface."""

    centre_distance: Quantity
    head_radius: Quantity
    tail_radius: Quantity


@dataclass(frozen=True, kw_only=True)
class BeltSheet:
    """width, thickness [m]; youngs_modulus [Pa]; density [kg/m3]; poisson_ratio [1], 0.3 when not stated."""

    width: Quantity
    thickness: Quantity
    youngs_modulus: Quantity
    density: Quantity
    poisson_ratio: Quantity = field(default_factory=lambda: Quantity(value=0.3))


@dataclass(frozen=True, kw_only=True)
class SignalSheet:
    """How one sensor errs; all one sigma, in SI ([m] for lateral signals, [rad] for tilt).

    white: independent from sample to sample; wander_sd, correlated over wander_length [m of travel];
    zero: one shift per run; gain: one relative scale error per run [1]. What is not stated is 0
    (wander_length then stands at 1 m and has no meaning). unit: what signals.csv is written in.
    """

    name: str
    at: str
    kind: Kind
    unit: str
    white: float
    zero: float = 0.0
    gain: float = 0.0
    wander_sd: float = 0.0
    wander_length: float = 1.0


@dataclass(frozen=True, kw_only=True)
class SettingsSheet:
    """How well a run hits its stated settings: tension_rel [1] of the tension, yaw_u [rad] of either yaw."""

    tension_rel: float = 0.0
    yaw_u: float = 0.0


class _OfArrays:
    """A dataclass with arrays is equal to another if all numbers are, nan beside nan."""

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and _comparable(vars(self)) == _comparable(vars(other))

    def __hash__(self) -> int:
        return hash(next(iter(vars(self).values())))


def _comparable(value: Any) -> Any:
    """A value with arrays as lists and nan as a word."""
    if isinstance(value, dict):
        return {key: _comparable(inner) for key, inner in value.items()}
    if isinstance(value, np.ndarray):
        return ["nan" if x != x else x for x in value.tolist()]
    return "nan" if value != value else value


@dataclass(frozen=True, kw_only=True, eq=False)
class Run(_OfArrays):
    """One run: what was set, and what was recorded.

    tension [Pa]; yaw and yaw_head [rad], both applied at travel yaw_at [m], known to yaw_at_u (one sigma); speed
    [m/s]; direction +1 or -1; repeat_of names the first run with the same settings. travel [m], shape (n,),
    increasing from the straight start at 0; time [s], shape (n,), or None; signals: name -> shape (n,) [m or rad],
    nan where blank. A signal without any value in this run is absent from ``signals``; n = 0 for a run of steady
    rates only. start [m]: travel that the belt had behind it at travel 0 (negative where its mark came later), None
    where nobody knows; start_u: one sigma of it where it was read off the records. run_in [m]: how far the belt had
    run from a straight start when the record began, ``travel`` and ``yaw_at`` count from that start; nan: it ran,
    nobody knows how far. y0 [m]: how far the belt stood from the middle of the pulleys at the yaw, to the side of
    positive y, None where nobody knows. started: date and time of day of the first reading (ISO 8601; "" where not
    known).
    """

    name: str
    tension: float
    yaw: float
    yaw_head: float = 0.0
    speed: float = 0.5
    direction: float = 1.0
    yaw_at: float = 0.0
    yaw_at_u: float = 0.0
    start: float | None = None
    start_u: float = 0.0
    run_in: float = 0.0
    y0: float | None = None
    repeat_of: str | None = None
    use: Use = "fit"
    started: str = ""
    travel: np.ndarray = field(default_factory=lambda: np.empty(0))
    time: np.ndarray | None = None
    signals: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def runs_already(self) -> bool:
        """Whether the record lacks the belt's rest before the yaw: it ran for an unknown way, or with the yaw on."""
        return not self.run_in <= self.yaw_at

    @property
    def counted_from(self) -> float:
        """Travel at which the record begins [m]."""
        return 0.0 if np.isnan(self.run_in) else self.run_in


@dataclass(frozen=True, kw_only=True, eq=False)
class SteadyRate(_OfArrays):
    """Steady drift of one run: rates, shape (4,), of points 1-4, nan where absent; u one sigma [m/m]."""

    run: str
    rates: np.ndarray
    u: float


@dataclass(frozen=True, kw_only=True, repr=False)
class Campaign:
    """Everything that a campaign folder states; sha256 of its files, empty when not read from disk."""

    title: str
    source: Source
    machine: Machine
    belt: BeltSheet
    signals: tuple[SignalSheet, ...]
    settings: SettingsSheet
    runs: tuple[Run, ...]
    steady: tuple[SteadyRate, ...] = ()
    sha256: str = ""

    def __repr__(self) -> str:
        """One paragraph: runs, repeats and hold-outs, tensions, yaws, signals, travel, steady rates, origin."""
        counts = {
            "repeats": sum(bool(r.repeat_of) for r in self.runs),
            "held out": sum(r.use != "fit" for r in self.runs),
        }
        more = ", ".join(f"{n} {what}" for what, n in counts.items() if n)
        yaws = np.array([r.yaw for r in self.runs]) / DEGREE
        signs = {"> 0": yaws > 0.0, "< 0": yaws < 0.0, "= 0": yaws == 0.0}
        counted = ", ".join(f"{there.sum()} at yaw {name}" for name, there in signs.items() if there.any())
        runs = f"{len(self.runs)} runs{f' ({more})' if more else ''}"
        tensions = f"{_numbers(r.tension / N_PER_MM2 for r in self.runs)} N/mm2"
        said = [f"{self.title}: {runs} at {tensions}, {counted} (|yaw| {_numbers(abs(yaws))} deg)"]
        if ends := [r.travel[-1] for r in self.runs if len(r.travel)]:
            signals = ", ".join(f"{s.name} ({s.at.replace('_', ' ')}, {s.unit})" for s in self.signals)
            reach = f"{min(ends):.4g}" + (f" to {max(ends):.4g}" if max(ends) - min(ends) >= 0.5 else "")
            count = sum(len(r.travel) for r in self.runs)
            said.append(f"signals {signals} over {reach} m of travel, {count} samples")
        said += [f"steady rates of {len(self.steady)} runs"] if self.steady else []
        return "; ".join([*said, self.source.kind]) + "."

    def plot(self, path: str | None = None) -> Any:
        """The picture of all readings over travel, a panel a run; written to ``path`` if one is given."""
        import belt_sim

        return belt_sim.plot(self, path)

    def to_pandas(self) -> Any:
        """Return all records as a DataFrame in SI: a row a sample, with its run's settings and a column a signal."""
        import pandas as pd

        settings = ("tension", "yaw", "yaw_head", "speed", "direction", "use")
        own = ({"run": run.name} | {n: getattr(run, n) for n in settings} for run in self.runs)
        records = (pd.DataFrame({"travel": run.travel, **run.signals}) for run in self.runs)
        runs = [record.assign(**settled) for record, settled in zip(records, own, strict=True)]
        table = pd.concat(runs, ignore_index=True)
        return table[["run", *settings, "travel", *(s.name for s in self.signals if s.name in table)]]


def rig_of(campaign: Campaign) -> Rig:
    """Return the stated machine."""
    return Rig(**{name: quantity.value for name, quantity in vars(campaign.machine).items()})


def case_of(campaign: Campaign, run: Run) -> Case:
    """Return the nominal case of a run: stated machine, belt and settings, with both yaws stepped at ``run.yaw_at``.

    A run counts ``y0`` at the yaw, a case at travel 0: what the belt moves before the yaw is small beside it.
    """
    settings = Settings(
        tension=run.tension,
        yaw=Schedule.step(run.yaw, at=run.yaw_at),
        yaw_head=Schedule.step(run.yaw_head, at=run.yaw_at),
        speed=run.speed,
        direction=run.direction,
        start=run.start or 0.0,
        y0=run.y0 or 0.0,
    )
    belt = Belt(**{name: quantity.value for name, quantity in vars(campaign.belt).items()})
    return Case(rig=rig_of(campaign), belt=belt, settings=settings)


def _numbers(values: Iterable[float]) -> str:
    """Format the distinct values in order: 7, 10 and 40; more than six as 7 to 40."""
    found = [f"{v:.4g}" for v in sorted({float(f"{v:.6g}") for v in values})]
    if len(found) > 6:
        return f"{found[0]} to {found[-1]}"
    return found[0] if len(found) == 1 else f"{', '.join(found[:-1])} and {found[-1]}"


#: Problems that an error prints before it only counts the rest.
MOST_SHOWN = 20
#: Characters of a wrong value that are quoted.
LONGEST_VALUE = 40


@dataclass(frozen=True, kw_only=True)
class Problem:
    """One violation: file, line (from 1; None: the whole file), what is named, its value, what to do."""

    file: str
    line: int | None = None
    name: str = ""
    value: object = None
    unit: str = ""
    remedy: str

    def __str__(self) -> str:
        place = self.file if self.line is None else f"{self.file}:{self.line}"
        subject = _plain(self.name)
        if self.value is not None:
            shown = " ".join(part for part in (quote(self.value), _plain(self.unit)) if part)
            subject = f"{subject} = {shown}" if subject else shown
        return ": ".join(part for part in (_plain(place), subject, _plain(self.remedy)) if part)


class CampaignError(BeltError):
    """A campaign folder that cannot be used; ``problems`` holds every violation found in it."""

    def __init__(self, problems: list[Problem]) -> None:
        self.problems = problems
        lines = [str(problem) for problem in problems[:MOST_SHOWN]]
        if len(problems) > MOST_SHOWN:
            lines.append(f"... and {len(problems) - MOST_SHOWN} more")
        super().__init__("\n".join(lines))


def refusal(file: object, remedy: str, **where: Any) -> CampaignError:
    """The error of one problem with a file; where: its line, name, value and unit."""
    return CampaignError([Problem(file=str(file), remedy=remedy, **where)])


def shortlist(items: Iterable[object], most: int = 5) -> str:
    """The first few items, with dots for the rest: 3, 7, 8, 12, 40 ..."""
    shown = [str(item) for item in items]
    return ", ".join(shown[:most]) + (" ..." if len(shown) > most else "")


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """The nearest known word as a remedy, or the list of all of them."""
    known = list(dict.fromkeys(known))
    lower = {k.lower(): k for k in known}
    near = difflib.get_close_matches(word.lower(), list(lower), n=1, cutoff=0.6)
    near = near or [k for k in lower if word and k.startswith(word.lower())]
    if near:
        return f"did you mean {lower[near[0]]}?"
    return f"use one of {', '.join(known)}" if known else "nothing is known by that name here"


def quote(value: object) -> str:
    """A value as one short printable line."""
    text = _plain(f"{value:.15g}" if isinstance(value, float) else str(value))
    return text if len(text) <= LONGEST_VALUE else text[: LONGEST_VALUE - 3] + "..."


def _plain(text: str) -> str:
    """The text on one line, with anything unprintable written as an escape."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
