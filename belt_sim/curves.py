"""Curves against belt travel, of a model or measured, their CSV file in the units of users (m, mm, mrad), and the belt
at one instant as a simulation hands it to an observer."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, Protocol

import numpy as np

from belt_sim.case import Case, Numbers, pytree
from belt_sim.io import write_with
from belt_sim.units import MM, N_PER_MM2

#: The last share of a record over which the late slope is taken.
LATE_SHARE = 0.2
#: arrays of Curves with a column an instant
ALONG = ("travel", "y", "angle", "moment", "moment_runoff", "edge_stress", "tilt")


@pytree
@dataclass(frozen=True, kw_only=True)
class Curves:
    """One run against travel.

    travel [m], shape (n,); y [m], shape (4, n), the lateral position at points 1-4;
    angle [rad], shape (4, n), dy/dx of the belt along its own travel at those points;
    moment, moment_runoff [N m], shape (2, n), in-plane bending moment where the upper and the lower span run up a
    pulley, and where they leave one;
    edge_stress [Pa], shape (2, n), tension of the slackest edge of each span (negative = slack): of a line model at
    either end, in 3D at the run-up;
    tilt [rad], shape (2, n), roll of the cross-section at mid-span, upper and lower;
    sag [m], shape (2,), of the upper and lower span; extra: further named arrays (n,) of a model (slip, ...).
    A model leaves at None what it does not know.
    """

    travel: Numbers
    y: Numbers
    angle: Numbers | None = None
    moment: Numbers | None = None
    moment_runoff: Numbers | None = None
    edge_stress: Numbers | None = None
    tilt: Numbers | None = None
    sag: Numbers | None = None
    extra: dict[str, np.ndarray] | None = None


#: what a 3D run knows besides -> its name in curves.csv, and the SI units in one unit there
_EXTRA_COLUMNS = {
    "tension": ("tension_N_per_mm2", N_PER_MM2),
    "tail_x": ("tail_x_m", 1.0),
    "belt_speed": ("belt_speed_m_per_s", 1.0),
    **{name: (f"{name}_mm", MM) for name in ("slip_head", "slip_tail", "correction")},
}


@dataclass(frozen=True)
class SensorPlace:
    """A place of a lateral sensor that is none of points 1-4.

    distance [m]: in a span along it from the tail pulley; on a wrap along the surface from its upper point, 1 or 4.
    """

    where: Literal["upper_span", "lower_span", "tail_wrap", "head_wrap"]
    distance: float

    @property
    def on_wrap(self) -> bool:
        return self.where.endswith("wrap")

    @property
    def point(self) -> int:
        """Index of the point that belongs to it: at the tail pulley for a span, the upper one for a wrap."""
        return {"upper_span": 0, "lower_span": 1, "tail_wrap": 0, "head_wrap": 3}[self.where]

    def __str__(self) -> str:
        return f"{self.where} at {self.distance:.9g} m"


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


def curves_columns(curves: Curves) -> dict[str, np.ndarray]:
    """Return the columns of curves.csv by name: travel_m, y1_mm..y4_mm, and what else the model gives."""
    columns: dict[str, np.ndarray] = {"travel_m": np.asarray(curves.travel)}
    columns |= {f"y{k + 1}_mm": row / MM for k, row in enumerate(np.asarray(curves.y))}
    spans = ("upper", "lower")
    if curves.angle is not None:
        columns |= {f"angle{k + 1}_mrad": row * 1e3 for k, row in enumerate(np.asarray(curves.angle))}
    if curves.moment is not None:
        columns |= {f"moment_{n}_Nm": row for n, row in zip(spans, np.asarray(curves.moment), strict=True)}
    if curves.edge_stress is not None:
        rows = np.asarray(curves.edge_stress) / N_PER_MM2
        columns |= {f"edge_stress_{n}_N_per_mm2": row for n, row in zip(spans, rows, strict=True)}
    if curves.tilt is not None:
        columns |= {f"tilt_{n}_mrad": row * 1e3 for n, row in zip(spans, np.asarray(curves.tilt), strict=True)}
    for name, row in (curves.extra or {}).items():
        column, unit = _EXTRA_COLUMNS.get(name, (name, 1.0))
        columns[column] = np.asarray(row) / unit
    return columns


def read_curves(path: Path) -> Curves:
    """Return travel, points 1-4 and, where it has them, the tilts of a curves.csv."""
    with path.open(encoding="utf-8") as lines:
        header = lines.readline().strip().split(",")
        columns = dict(zip(header, np.loadtxt(lines, delimiter=",", ndmin=2).T, strict=True))
    tilts = [columns[n] * 1e-3 for n in ("tilt_upper_mrad", "tilt_lower_mrad") if n in columns]
    y = np.array([columns[f"y{k}_mm"] for k in (1, 2, 3, 4)]) * MM
    return Curves(travel=columns["travel_m"], y=y, tilt=np.array(tilts) if tilts else None)


def write_curves(path: Path, curves: Curves) -> Path:
    """Write curves.csv in one move."""
    columns = curves_columns(curves)
    rows = np.column_stack(list(columns.values())) + 0.0  # no -0
    header = ",".join(columns)
    return write_with(
        path, lambda temporary: np.savetxt(temporary, rows, fmt="%.9g", delimiter=",", header=header, comments="")
    )


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

    A subclass may leave out what it does not care for. One that shows MuJoCo's own scene has ``show(model, data)``.
    """

    def start(self, case: Case, travel: float) -> None:
        """A run over ``travel`` metres begins."""
        return None

    def frame(self, frame: Frame) -> None:
        """A new instant; called at least every 0.1 m of travel."""
        return None

    def finish(self, curves: Curves) -> None:
        """The run has ended with these curves (partial ones when it was stopped)."""
        return None
