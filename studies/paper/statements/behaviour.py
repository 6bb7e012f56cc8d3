"""What a model says of the paper's cases, as far as it says anything: the stuff that statements are judged by."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from belt_sim.analytic.steady import edge_tilt
from belt_sim.curves import Curves
from belt_sim.paper import YAW
from studies.paper.models import LOOKS, MEASURED, TRAVEL, case_at, moving, steady
from studies.paper.stored import stored

GRID = np.round(np.arange(0.0, TRAVEL + 0.05, 0.1), 9)  # [m] of travel
RECORDS = {7.0: "flex_7", 10.0: "flex_10", 20.0: "flex_20", 40.0: "flex_40"}
SETTLED = RECORDS | {7.0: "flex_7_far", 10.0: "flex_10_far"}  # stored runs that late rates are taken from
FLAT = ("beam_th1", "beam_th2", "ernst_beam")  # by assumption the belt stays in one plane: its tilt is none


@dataclass(frozen=True, kw_only=True)
class Behaviour:
    """By tension [N/mm2], positive towards where the yaw drives the belt.

    y: point 1 at GRID [m], shape (n,); rate: steady dy/ds [m/m]; tilt: the greatest at mid-span within TRAVEL [rad].
    What a model does not say is missing.
    """

    y: Mapping[float, np.ndarray] = field(default_factory=dict)
    rate: Mapping[float, float] = field(default_factory=dict)
    tilt: Mapping[float, float] = field(default_factory=dict)

    def at(self, travel: float, tension: float) -> float:
        """y of point 1 [m]."""
        return float(np.interp(travel, GRID, self.y[tension]))

    def slope(self, begin: float, end: float, tension: float) -> float:
        """Mean dy/ds of point 1 between two travels [m/m]."""
        return (self.at(end, tension) - self.at(begin, tension)) / (end - begin)


def behaviours(*, in_space: bool) -> dict[str, Behaviour]:
    """All models in the order of their looks, the stored belt in 3D last where it is wanted."""
    found = {name: _of(name) for name in LOOKS if name != "mujoco_flex"}
    return found | ({"mujoco_flex": _stored()} if in_space else {})


def _of(model: str) -> Behaviour:
    rate = {t: -steady(model, t) for t in MEASURED}
    if model == "ritzinger":
        return Behaviour(rate=rate, tilt={t: abs(edge_tilt(case_at(t), abs(YAW))) for t in MEASURED})
    curves = {t: moving(model, t) for t in MEASURED}
    y = {t: _sampled(c) for t, c in curves.items()}
    if model == "rope":  # a line has no cross-section
        return Behaviour(y=y, rate=rate)
    tilt = {t: 0.0 if model in FLAT else _greatest_tilt(c) for t, c in curves.items()}
    return Behaviour(y=y, rate=rate, tilt=tilt)


def _stored() -> Behaviour:
    runs = {t: stored(name) for t, name in RECORDS.items()}
    return Behaviour(
        y={t: _sampled(r.curves) for t, r in runs.items()},
        rate={t: -stored(name).rates()[0] for t, name in SETTLED.items()},
        tilt={t: _greatest_tilt(r.curves) for t, r in runs.items()},
    )


def _sampled(curves: Curves) -> np.ndarray:
    return -np.interp(GRID, np.asarray(curves.travel), np.asarray(curves.y)[0])


def _greatest_tilt(curves: Curves) -> float:
    early = np.asarray(curves.travel) <= TRAVEL
    return float(np.abs(np.asarray(curves.tilt)[:, early]).max())
