"""The models that figures set side by side, in the paper's coordinates: x from the tail pulley, y to its left.

The package counts x from the head pulley. Half a turn about z takes the one into the other: x -> a - x, y -> -y, and
angles stay. So a yaw of -0.042 degrees moves the belt towards +y here.
"""

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import jax
import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.jax_setup import in_float64, jit_float64
from belt_sim.line.span import span_fields
from belt_sim.line.spans import RitzingerFormula
from belt_sim.model import AnalyticModel, analytic_model
from belt_sim.show.style import AMBER, BLUE, FAINT_INK, GREEN, INK, PINK, RED, SKY
from belt_sim.units import MM, MM_PER_M, N_PER_MM2
from studies.paper.case import ROPE_EXAMPLE, TEST_RIG, paper_case

TRAVEL = 25.0  # [m] of the moving curves on the test rig
RECORD = 0.1  # [m] between two of their records
MEASURED = (7.0, 10.0, 20.0, 40.0)  # [N/mm2], at which the paper speaks of the test rig


@dataclass(frozen=True)
class Look:
    """How a model is named and drawn."""

    words: str
    colour: str
    dashes: tuple[float, ...] = ()

    @property
    def line(self) -> dict:
        """For Axes.plot."""
        return {"color": self.colour, "label": self.words, "linestyle": (0, self.dashes) if self.dashes else "-"}


LOOKS = {
    "rope": Look("rope", FAINT_INK),
    "beam_th1": Look("beam, 1st order", GREEN),
    "beam_th2": Look("beam, 2nd order", RED),
    "ritzinger": Look("Ritzinger (a rate alone)", PINK, (4.0, 1.5, 1.0, 1.5)),
    "ernst_beam": Look("beam with Ernst's modulus", AMBER, (5.0, 2.0)),
    "strip": Look("hanging strip", BLUE),
    "strip_lift_off": Look("hanging strip that lifts off", SKY, (5.0, 2.0)),
    "mujoco_flex": Look("belt in 3D (stored)", INK),
}
MOVING = tuple(n for n in LOOKS if n not in ("ritzinger", "mujoco_flex"))  # have curves of their own


def case_at(tension: float, short: bool = False) -> Case:
    """The paper's belt at ``tension`` [N/mm2], yaw -0.042 degrees at travel 0; on the test rig, or on the short one."""
    return paper_case(tension * N_PER_MM2, rig=ROPE_EXAMPLE if short else TEST_RIG)


@cache
def moving(model: str, tension: float) -> Curves:
    """The test rig at ``tension`` [N/mm2] over TRAVEL."""
    engine = replace(analytic_model(model), keep=RECORD)
    return engine.run(case_at(tension), travel=TRAVEL)


def steady(model: str, tension: float) -> float:
    """Steady rate [m/m] on the test rig, in closed form."""
    case = case_at(tension)
    return RitzingerFormula().steady_rate(case) if model == "ritzinger" else analytic_model(model).steady_rate(case)


def read_rate(curves: Curves, begin: float, end: float, point: int = 1) -> float:
    """Mean slope of a point between two places of the travel [m/m], as one reads it off a record."""
    y = np.interp([begin, end], np.asarray(curves.travel), np.asarray(curves.y)[point - 1])
    return float(y[1] - y[0]) / (end - begin)


def y_mm(y: Any) -> np.ndarray:
    """Lateral position of the package [m] -> of the paper [mm]."""
    return -np.asarray(y, float) / MM


def rate_mm_per_m(rate: Any) -> Any:
    """Drift dy/ds of the package [m/m] -> of the paper [mm per m of travel]."""
    return -np.asarray(rate, float) / MM_PER_M


def x_m(x: Any, centre_distance: float) -> np.ndarray:
    """Place along the machine, from the head pulley [m] -> from the tail pulley [m]."""
    return centre_distance - np.asarray(x, float)


_span_fields = jit_float64(span_fields)  # op by op it would take seconds


@dataclass(frozen=True, kw_only=True)
class SpanShape:
    """x from the run-off point along the travel [m]; y [m], curvature [1/m], tilt of the section [rad], shape (n,)."""

    x: np.ndarray
    y: np.ndarray
    curvature: np.ndarray
    tilt: np.ndarray


@in_float64
def span_shape(case: Case, model: AnalyticModel, y: tuple[float, float], angle: tuple[float, float]) -> SpanShape:
    """A span whose run-off and run-up have y [m] and angle dy/dx [rad], and whose cross-sections lie level there.

    A straight line between the ends, and what the law makes of the angles that they keep with it.
    """
    fields = jax.tree.map(np.asarray, _span_fields(model.span(case)))
    chord = (y[1] - y[0]) / fields.x[-1]
    off, up = angle[0] - chord, angle[1] - chord
    return SpanShape(
        x=fields.x,
        y=y[0] + chord * fields.x + up * fields.place[0] + off * fields.place[1],
        curvature=up * fields.per_runup + off * fields.per_runoff,
        tilt=up * fields.roll[0] + off * fields.roll[1],
    )
