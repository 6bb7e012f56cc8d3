"""A simulation: one case, one model, its curves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from belt_sim.case import Case
from belt_sim.curves import ALONG, LATE_SHARE, Curves, curves_columns, late_rates, offsets
from belt_sim.effects.base import Effect
from belt_sim.errors import CannotRepresent, Limit, warning
from belt_sim.results import words
from belt_sim.results.words import Display, Table, data_frame, dataset
from belt_sim.units import N_PER_MM2

POINTS = (1, 2, 3, 4)
SPANS = ("upper", "lower")
SETTLED, SETTLED_RATE = 0.05, 1e-6  # [1], [m/m]: rates that differ by less are one
SHARE_BEFORE = LATE_SHARE / (1.0 - LATE_SHARE)  # of the records before the late ones, as long as those


def settled_before(travel: np.ndarray) -> int:
    """How many records of ``travel`` (n,) lie before the late ones."""
    return len(travel) - int(np.sum(travel > travel[-1] - LATE_SHARE * (travel[-1] - travel[0])))


def agree(rates: Any) -> Any:
    """Whether rates (n,) [m/m], of all points now and before, are one within SETTLED; numpy's or JAX's."""
    apart = rates.max() - rates.min()
    return (apart <= SETTLED * abs(rates.mean())) | (apart <= SETTLED_RATE)


@dataclass(frozen=True, kw_only=True, repr=False)
class Simulation(Display):
    """Curves of ``case`` by ``model`` with ``effects`` over ``travel`` [m]; None of a model that gives rates only.

    steady_rate: late dy/ds [m/m] in closed form, or of a 3D run that has settled; None where there is neither;
    details: what else the engine says of its run (numerical settings, scene file); beyond: limits of its validity that
    the model is used beyond; keep [m]: least distance of rows on file.
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
        """True when all points move at one rate, and did so before: what the late slopes mean to show.

        Within 5 % of the mean, or 1 um per m; a formula for the steady rate is.
        """
        if self.curves is None:
            return True
        early = settled_before(travel := np.asarray(self.curves.travel))
        before = Curves(travel=travel[:early], y=np.asarray(self.curves.y)[:, :early])
        return early > 2 and bool(agree(np.concatenate([self.rates, late_rates(before, SHARE_BEFORE)])))

    @property
    def offsets(self) -> tuple[float, float] | None:
        """Lateral offset across the spans at the end [m]: upper y1 - y4, lower y3 - y2."""
        return None if self.curves is None else offsets(self.curves)

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
        tension = words.tension(float(self.case.settings.tension))
        return f"{' + '.join([self.model, *(e.id for e in self.effects)])}, {tension} N/mm2"

    @property
    def note(self) -> str:
        """What a model without curves says of itself; empty for the others."""
        if self.curves is not None:
            return ""
        return f"{self.model} is a formula for the steady rate: it gives no curves and no offsets"

    @property
    def warning(self) -> str:
        """What the model is used beyond, in one line; empty when it is not."""
        return warning(self.model, self.beyond)

    def lines(self) -> Sequence[str]:
        """Late rates, and a warning when an edge goes slack or the model is used beyond its validity."""
        rates = "  ".join(f"{k}: {words.column(r, sign=True)}" for k, r in zip(POINTS, self.rates, strict=True))
        said = [f"{self.title}: late rates in mm per m at points {rates}"]
        if not self.is_settled:
            known = self.steady_rate is not None
            steady = f"; the steady rate is {words.column(self.steady_rate, sign=True)} mm per m" if known else ""
            said.append(f"not settled: these are slopes over the last fifth of the travel{steady}")
        slack = self.slackest_edge
        if slack is not None and slack < 0:
            stress = words.number(slack / N_PER_MM2, 2)
            said.append(f"a belt edge goes slack ({stress} N/mm2): linear models overrate its bending there")
        return [*said, *filter(None, (self.warning, self.note))]

    def tables(self) -> Sequence[Table]:
        last = [None] * 4 if self.curves is None else np.asarray(self.curves.y)[:, -1]
        both = zip(POINTS, self.rates, last, strict=True)
        rows = [(str(k), words.column(rate, sign=True), words.column(y, sign=True)) for k, rate, y in both]
        return [Table("", ("point", "late rate [mm per m]", f"y at {self.travel:g} m [mm]"), rows)]

    def to_pandas(self) -> Any:
        """The curves as in curves.csv: travel in m, y in mm, angles in mrad."""
        return data_frame(curves_columns(self._stored_curves()))

    def to_xarray(self) -> Any:
        """The curves over travel, point and span, in SI."""
        curves = self._stored_curves()
        wanted = {"y": ("point", "m"), "angle": ("point", "rad"), "moment": ("span", "N m")}
        wanted |= {"edge_stress": ("span", "Pa"), "tilt": ("span", "rad")}
        there = {n: w for n, w in wanted.items() if getattr(curves, n) is not None}
        variables = {n: ((dim, "travel"), np.asarray(getattr(curves, n))) for n, (dim, _) in there.items()}
        coords = {"travel": np.asarray(curves.travel), "point": list(POINTS), "span": list(SPANS)}
        return dataset(variables, coords, {"travel": "m"} | {n: unit for n, (_, unit) in there.items()})

    def _stored_curves(self) -> Curves:
        if self.curves is None:
            raise CannotRepresent(self.note)
        return self.curves
