"""One instant of a belt in space, as a simulation hands it to whoever watches."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves


@dataclass(frozen=True, kw_only=True)
class Frame:
    """The belt at one instant; z is up, the head pulley's axis passes through (0, 0, 0).

    travel [m]; time [s]; left, right: edges at y = +b/2 and y = -b/2, shape (n, 3) [m], closed loops
    (for a rope both are the same line); points, shape (4, 3) [m]: points 1-4 on the belt's centre line;
    yaw_tail, yaw_head [rad]; tail_x [m], where the tail pulley's axis is; scalars: named numbers in SI
    (tension, entry_moment_upper, entry_moment_lower, tilt_upper, tilt_lower, slip, ...).
    """

    travel: float
    time: float
    left: np.ndarray
    right: np.ndarray
    points: np.ndarray
    yaw_tail: float
    yaw_head: float
    tail_x: float
    scalars: Mapping[str, float] = field(default_factory=dict)


class Observer(Protocol):
    """Somebody who watches a run from outside: a progress bar, a viewer, a file.

    A subclass may leave out what it does not care for.
    """

    def start(self, case: Case, travel: float) -> None:
        """A run over ``travel`` metres begins."""
        return None

    def frame(self, frame: Frame) -> None:
        """A new instant; called at least every 0.1 m of travel."""

    def finish(self, curves: Curves) -> None:
        """The run has ended with these curves (partial ones when it was stopped)."""
        return None


@runtime_checkable
class SceneObserver(Observer, Protocol):
    """An observer that shows MuJoCo's own scene."""

    def show(self, model: Any, data: Any) -> None:
        """The MjModel and the MjData of the run that has begun."""
