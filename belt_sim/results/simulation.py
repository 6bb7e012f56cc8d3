"""A simulation: one case, one model, its curves."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from belt_sim.case import Case
from belt_sim.curves import ALONG, LATE_SHARE, Curves, curves_columns, late_rates
from belt_sim.effects.base import Effect
from belt_sim.errors import CannotRepresent, Limit, warning
from belt_sim.results import words
from belt_sim.results.words import Display, Table, dataset
from belt_sim.units import DEGREE, MM, MM_PER_M, N_PER_MM2, round_digits

POINT_NUMBERS = (1, 2, 3, 4)
BOTH_SPANS = ("upper", "lower")
SUMMARY = "belt-summary/1"
SETTING_DIGITS = 12  # significant digits of what somebody has set: fewer than a change of units leaves
SETTLED_SHARE, SETTLED_RATE = 0.05, 1e-6  # [1], [m/m]: rates that differ by less are one
SHARE_BEFORE = LATE_SHARE / (1.0 - LATE_SHARE)  # of the records before the late ones, as long as those


def settled_before(travel: np.ndarray) -> int:
    """How many records of ``travel`` (n,) lie before the late ones."""
    return len(travel) - int(np.sum(travel > travel[-1] - LATE_SHARE * (travel[-1] - travel[0])))


def agree(rates: Any) -> Any:
    """Whether rates (n,) [m/m], of all points now and before, are one within SETTLED_SHARE; numpy's or JAX's."""
    apart = rates.max() - rates.min()
    return (apart <= SETTLED_SHARE * abs(rates.mean())) | (apart <= SETTLED_RATE)


@dataclass(frozen=True, kw_only=True, repr=False)
class Simulation(Display):
    """Curves of ``case`` by ``model`` with ``effects`` over ``travel`` [m]; None of a model that gives rates only.

    steady_rate: late dy/ds [m/m] in closed form, or of a 3D run that has settled, else None; details: numerical
    settings and scene file; beyond: limits that the model is used beyond; keep [m]: least distance of rows on file.
    """

    case: Case
    model: str
    effects: tuple[Effect, ...]
    travel: float
    curves: Curves | None
    steady_rate: float | None = None
    details: Mapping[str, Any] = field(default_factory=dict)
    beyond: tuple[Limit, ...] = ()
    keep: float = 0.0

    @property
    def written_curves(self) -> Curves | None:
        """The curves with rows ``keep`` apart, and the last one."""
        travel = np.empty(0) if self.curves is None else np.asarray(self.curves.travel)
        every = int(self.keep / np.diff(travel).mean() + 1e-6) if len(travel) > 1 else 0
        if self.curves is None or every < 2:
            return self.curves
        rows = np.unique(np.append(np.arange(0, len(travel), every), len(travel) - 1))
        there = {name: np.asarray(v)[..., rows] for name in ALONG if (v := getattr(self.curves, name)) is not None}
        extra = self.curves.extra and {name: np.asarray(v)[rows] for name, v in self.curves.extra.items()}
        return replace(self.curves, **there, extra=extra)

    @property
    def rates(self) -> np.ndarray:
        """Late slopes dy/ds of points 1-4 [m/m], shape (4,)."""
        return np.full(4, self.steady_rate) if self.curves is None else late_rates(self.curves)

    @property
    def is_settled(self) -> bool:
        """True when all points move at one rate, within 5 % or 1 um per m, and did so before; of a formula, always."""
        if self.curves is None:
            return True
        early = settled_before(travel := np.asarray(self.curves.travel))
        before = Curves(travel=travel[:early], y=np.asarray(self.curves.y)[:, :early])
        return early > 2 and bool(agree(np.concatenate([self.rates, late_rates(before, SHARE_BEFORE)])))

    @property
    def offsets(self) -> tuple[float, float] | None:
        """Lateral offset across the spans at the end [m]: upper y1 - y4, lower y3 - y2."""
        if self.curves is None:
            return None
        y = np.asarray(self.curves.y)[:, -1]
        return float(y[0] - y[3]), float(y[2] - y[1])

    @property
    def sag(self) -> float | None:
        """Sag of the upper span [m]."""
        return None if self.curves is None or self.curves.sag is None else float(np.asarray(self.curves.sag)[0])

    @property
    def slackest_edge(self) -> float | None:
        """Least tension of a belt edge [Pa]; below 0 the edge is slack."""
        if self.curves is None or self.curves.edge_stress is None:
            return None
        return float(np.asarray(self.curves.edge_stress).min())

    @property
    def title(self) -> str:
        tension = f"{float(self.case.settings.tension) / N_PER_MM2:g}"
        return f"{' + '.join([self.model, *(e.id for e in self.effects)])}, {tension} N/mm2"

    @property
    def note(self) -> str:
        """What a model without curves says of itself."""
        said = f"{self.model} is a formula for the steady rate: it gives no curves and no offsets"
        return said if self.curves is None else ""

    def lines(self) -> Sequence[str]:
        """Late rates, and a warning when an edge goes slack or the model is used beyond its validity."""
        rates = "  ".join(f"{k}: {words.column(r, sign=True)}" for k, r in zip(POINT_NUMBERS, self.rates, strict=True))
        said = [f"{self.title}: late rates in mm per m at points {rates}"]
        if not self.is_settled:
            known = self.steady_rate is not None
            steady = f"; the steady rate is {words.column(self.steady_rate, sign=True)} mm per m" if known else ""
            said.append(f"not settled: these are slopes over the last fifth of the travel{steady}")
        slack = self.slackest_edge
        if slack is not None and slack < 0:
            stress = words.number(slack / N_PER_MM2, 2)
            said.append(f"a belt edge goes slack ({stress} N/mm2): linear models overrate its bending there")
        return [*said, *filter(None, (warning(self.model, self.beyond), self.note))]

    def tables(self) -> Sequence[Table]:
        last = [None] * 4 if self.curves is None else np.asarray(self.curves.y)[:, -1]
        both = zip(POINT_NUMBERS, self.rates, last, strict=True)
        rows = [(str(k), words.column(rate, sign=True), words.column(y, sign=True)) for k, rate, y in both]
        return [Table("", ("point", "late rate [mm per m]", f"y at {self.travel:g} m [mm]"), rows)]

    def to_pandas(self) -> Any:
        """The curves as in curves.csv: travel in m, y in mm, angles in mrad."""
        import pandas as pd

        if self.curves is None:
            raise CannotRepresent(self.note)
        return pd.DataFrame(curves_columns(self.curves))

    def to_xarray(self) -> Any:
        """The curves over travel, point and span, in SI."""
        if (curves := self.curves) is None:
            raise CannotRepresent(self.note)
        wanted = {"y": ("point", "m"), "angle": ("point", "rad"), "moment": ("span", "N m")}
        wanted |= {"edge_stress": ("span", "Pa"), "tilt": ("span", "rad")}
        there = {n: w for n, w in wanted.items() if getattr(curves, n) is not None}
        variables = {n: ((dim, "travel"), np.asarray(getattr(curves, n))) for n, (dim, _) in there.items()}
        coords = {"travel": np.asarray(curves.travel), "point": list(POINT_NUMBERS), "span": list(BOTH_SPANS)}
        return dataset(variables, coords, {"travel": "m"} | {n: unit for n, (_, unit) in there.items()})


def effect_json(effect: Effect) -> dict[str, Any]:
    """Return an effect as files hold it: its id, and its parameters in SI."""
    return {"id": effect.id, "parameters": {n: float(getattr(effect, n)) for n in effect.parameters}}


def summary_json(s: Simulation, provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of summary.json; yaw_deg: of a step at travel 0, otherwise the list that ``yaw=`` takes."""
    schedule = s.case.settings.yaw
    at, over = np.asarray(schedule.at, float), np.asarray(schedule.over, float)
    degrees = [round_digits(a, SETTING_DIGITS) for a in np.cumsum(schedule.change) / DEGREE]
    yaw: Any = [{"at": a, "over": o, "yaw": d} for a, o, d in zip(at.tolist(), over.tolist(), degrees, strict=True)]
    yaw = degrees[0] if len(at) == 1 and at[0] == over[0] == 0.0 else yaw
    ends = dict(zip(BOTH_SPANS, s.offsets or (None, None), strict=True))
    content: dict[str, Any] = {
        "schema": SUMMARY,
        "model": s.model,
        "tension_n_per_mm2": round_digits(float(s.case.settings.tension) / N_PER_MM2, SETTING_DIGITS),
        "yaw_deg": yaw,
        "travel_m": s.travel,
        "rate_mm_per_m": {str(k): float(r) / MM_PER_M for k, r in zip(POINT_NUMBERS, s.rates, strict=True)},
        "offset_mm": {k: None if e is None else e / MM for k, e in ends.items()},
    }
    content["settled"] = s.is_settled
    if s.sag is not None:
        content["sag_mm"] = s.sag / MM
    if s.slackest_edge is not None:
        content |= {"slackest_edge_n_per_mm2": s.slackest_edge / N_PER_MM2, "slack_edge": s.slackest_edge < 0}
    content["effects"] = [effect_json(e) for e in s.effects]
    if s.steady_rate is not None:
        content["steady_rate_mm_per_m"] = s.steady_rate / MM_PER_M
    if s.note:
        content["note"] = s.note
    if s.beyond:
        loads = {x.id: x.load for x in s.beyond}
        content["beyond_validity"] = {"limits": loads, "sentence": warning(s.model, s.beyond)}
    words_of = {"Infinity": "inf", "-Infinity": "-inf", "NaN": "nan"}  # numbers that JSON does not know, as words
    details: dict[str, Any] = json.loads(json.dumps(dict(s.details)), parse_constant=words_of.get)
    return content | details | {"provenance": dict(provenance)}
