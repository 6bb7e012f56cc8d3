"""Curves against belt travel: what a model returns, and what a rig measured."""

from dataclasses import dataclass

import numpy as np

from belt_sim.pytree import Numbers, pytree

#: The last share of a record over which the late slope is taken.
LATE_SHARE = 0.2


@pytree
@dataclass(frozen=True, kw_only=True)
class Curves:
    """One run against travel.

    travel [m], shape (n,); y [m], shape (4, n), the lateral position at points 1-4;
    angle [rad], shape (4, n), dy/dx of the belt along its own travel at those points;
    moment [N m], shape (2, n), in-plane bending moment where the upper and the lower span run up;
    edge_stress [Pa], shape (2, n), tension of the slacker edge there (negative = slack edge);
    tilt [rad], shape (2, n), roll of the cross-section at mid-span, upper and lower;
    sag [m], shape (2,), of the upper and lower span; extra: further named arrays (n,) of a model (slip, ...).
    A model leaves at None what it does not know.
    """

    travel: Numbers
    y: Numbers
    angle: Numbers | None = None
    moment: Numbers | None = None
    edge_stress: Numbers | None = None
    tilt: Numbers | None = None
    sag: Numbers | None = None
    extra: dict[str, np.ndarray] | None = None


def late_rates(curves: Curves, share: float = LATE_SHARE) -> np.ndarray:
    """Late slopes dy/ds of points 1-4 [m/m]: least-squares lines through the last ``share`` of the travel.

    They go through the last two records at least.
    """
    travel = np.asarray(curves.travel)
    late = late_records(travel, share)
    s = travel[late] - travel[late].mean()
    y = np.asarray(curves.y)[:, late]
    return np.asarray((y - y.mean(axis=1, keepdims=True)) @ s / (s @ s))


def late_records(travel: np.ndarray, share: float = LATE_SHARE) -> np.ndarray:
    """Which records of ``travel`` (n,) count as late, shape (n,) of bool: the last ``share`` of it, two at least."""
    late = np.asarray(travel >= travel[-1] - share * (travel[-1] - travel[0]))
    late[-2:] = True
    return late


def offsets(curves: Curves) -> tuple[float, float]:
    """Lateral offset across the spans at the end of the record [m]: upper y1 - y4, lower y3 - y2."""
    y = np.asarray(curves.y)[:, -1]
    return float(y[0] - y[3]), float(y[2] - y[1])
