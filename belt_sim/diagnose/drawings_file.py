"""Drawings on disk, so that a report can be written again without the diagnosis."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.errors import InputError
from belt_sim.files import write_json
from belt_sim.pictures.drift_chart import Drift
from belt_sim.pictures.overlay import Panel
from belt_sim.pictures.where import FailureMap
from belt_sim.report.report import Figures


def write_drawings(path: Path, drawn: Figures) -> Path:
    """Write the figures' arrays as JSON."""
    return write_json(path, _plain(asdict(drawn)))


def read_drawings(path: Path) -> Figures:
    """Read them back; raises InputError when the file is missing or damaged."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return Figures(
            overlays=[Panel(**_arrays(p)) for p in content["overlays"]],
            maps=[FailureMap(**_arrays(m)) for m in content["maps"]],
            drifts=[(Drift(**_arrays(a)), None if b is None else Drift(**_arrays(b))) for a, b in content["drifts"]],
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            "diagnosis", str(path), "", "not the drawings of a diagnosis; run belt-sim diagnose"
        ) from error


def _plain(x: Any) -> Any:
    if isinstance(x, dict):
        return {k: _plain(v) for k, v in x.items()}
    if isinstance(x, (list, tuple)):
        return [_plain(v) for v in x]
    if isinstance(x, np.ndarray):
        return _plain(x.tolist())
    if isinstance(x, (float, np.floating)):
        return float(f"{x:.6g}") if np.isfinite(x) else None
    return x


def _arrays(row: dict[str, Any]) -> dict[str, Any]:
    return {k: np.array(v, dtype=float) if isinstance(v, list) else v for k, v in row.items()}
