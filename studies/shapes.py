"""The belt's edges in space at chosen places of its travel, kept while it runs (an observer)."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves, Frame
from belt_sim.io import write_with

COLUMNS = (
    "travel_m",
    "tail_x_m",
    "yaw_tail_rad",
    *(f"{side}_{axis}_m" for side in ("left", "right") for axis in "xyz"),
)


@dataclass
class Shapes:
    """at [m]: wanted travels; kept: for each of them the first frame that is not before it, or the last there is."""

    at: tuple[float, ...]
    kept: dict[float, Frame] = field(default_factory=dict)
    last: Frame | None = None

    def start(self, case: Case, travel: float) -> None:
        """Nothing to do."""

    def frame(self, frame: Frame) -> None:
        """Keep it where it is the first at or beyond a wanted travel."""
        self.last = frame
        for wanted in self.at:
            if wanted not in self.kept and frame.travel >= wanted - 1e-9:
                self.kept[wanted] = frame

    def finish(self, curves: Curves) -> None:
        """A travel at the very end has no frame beyond it."""
        if self.last is not None and self.at and max(self.at) not in self.kept:
            self.kept[max(self.at)] = self.last

    def write(self, path: Path) -> Path:
        """One row a station and travel: both edges [m], the tail pulley's axis [m] and yaw [rad]."""
        rows = [_rows(f) for f in self.kept.values()]
        header = ",".join(COLUMNS)
        table = np.concatenate(rows) + 0.0
        return write_with(
            path, lambda draft: np.savetxt(draft, table, fmt="%.7g", delimiter=",", header=header, comments="")
        )


def _rows(frame: Frame) -> np.ndarray:
    """(n, 9) of one frame."""
    count = len(frame.left)
    same = np.tile([frame.travel, frame.tail_x, frame.yaw_tail], (count, 1))
    return np.hstack([same, frame.left, frame.right])
