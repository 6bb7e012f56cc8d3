"""The shape of a free span between its run-off and its run-up point, by the span law's own fields."""

from dataclasses import dataclass

import jax
import numpy as np

from belt_sim.case import Case
from belt_sim.jax_setup import in_float64, jit_float64
from belt_sim.line.influence import span_fields
from belt_sim.model import AnalyticModel

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
