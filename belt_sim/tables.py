"""Curves as CSV files, in the units people read: travel in m, y in mm, angles in mrad."""

from pathlib import Path

import numpy as np

from belt_sim import si
from belt_sim.curves import Curves
from belt_sim.files import write_with


def curves_columns(curves: Curves) -> dict[str, np.ndarray]:
    """Columns by name, a value a record: travel_m, y1_mm..y4_mm, and what else the model knows."""
    columns: dict[str, np.ndarray] = {"travel_m": np.asarray(curves.travel)}
    columns |= {f"y{k + 1}_mm": row / si.MM for k, row in enumerate(np.asarray(curves.y))}
    spans = ("upper", "lower")
    if curves.angle is not None:
        columns |= {f"angle{k + 1}_mrad": row * 1e3 for k, row in enumerate(np.asarray(curves.angle))}
    if curves.moment is not None:
        columns |= {f"moment_{n}_Nm": row for n, row in zip(spans, np.asarray(curves.moment), strict=True)}
    if curves.edge_stress is not None:
        rows = np.asarray(curves.edge_stress) / si.N_PER_MM2
        columns |= {f"edge_stress_{n}_N_per_mm2": row for n, row in zip(spans, rows, strict=True)}
    if curves.tilt is not None:
        columns |= {f"tilt_{n}_mrad": row * 1e3 for n, row in zip(spans, np.asarray(curves.tilt), strict=True)}
    columns |= {name: np.asarray(row) for name, row in (curves.extra or {}).items()}
    return columns


def write_curves(path: Path, curves: Curves) -> Path:
    """Write curves.csv in one move."""
    columns = curves_columns(curves)
    rows = np.column_stack(list(columns.values())) + 0.0  # no -0
    header = ",".join(columns)
    return write_with(
        path,
        lambda temporary: np.savetxt(temporary, rows, fmt="%.9g", delimiter=",", header=header, comments=""),
    )
