"""Runs in three dimensions that are too long to repeat for a picture: what came out, and how to make it again.

``models/paper`` holds for each of them NAME.csv (curves), NAME.json (command, commit, versions, options, CPU time) and,
where a picture shows the belt in space, NAME_shapes.csv; studies/paper_store.py writes them.
"""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.curves import Curves
from belt_sim.errors import InputError
from belt_sim.io import MODEL_FOLDER
from belt_sim.units import MM

PLACE = MODEL_FOLDER / "paper"
SETTLED = 20.0  # [m], from where on a rate over the rest of a record is taken


@dataclass(frozen=True, kw_only=True)
class Shape:
    """The belt in space at one travel [m]: edges (n, 3) [m], the tail pulley's axis [m] and yaw [rad]."""

    travel: float
    tail_x: float
    yaw: float
    left: np.ndarray
    right: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """The centre line, (n, 3) [m]."""
        return 0.5 * (self.left + self.right)


@dataclass(frozen=True, kw_only=True)
class StoredRun:
    """name; curves; shapes, in the order of travel; made: what NAME.json says."""

    name: str
    curves: Curves
    shapes: tuple[Shape, ...]
    made: dict[str, Any]

    @property
    def tension(self) -> float:
        """[N/mm2]."""
        return float(self.made["tension_N_per_mm2"])

    @property
    def command(self) -> str:
        """What makes it again."""
        return str(self.made["command"])

    @property
    def origin(self) -> str:
        """Command, code version and cost in a line."""
        return f"{self.command} (commit {str(self.made['commit'])[:7]}, {self.made['cpu_s']:.0f} CPU s)"

    def shape_at(self, travel: float) -> Shape:
        """The kept shape that is nearest to a travel [m]."""
        return min(self.shapes, key=lambda shape: abs(shape.travel - travel))

    def rates(self) -> tuple[float, float, float]:
        """Mean over points 1-4 of the slopes from SETTLED to the end [m/m], their least and their greatest."""
        s = np.asarray(self.curves.travel)
        late = s >= SETTLED
        slopes = np.polyfit(s[late], np.asarray(self.curves.y)[:, late].T, 1)[0]
        return float(slopes.mean()), float(slopes.min()), float(slopes.max())


@cache
def stored_run(name: str) -> StoredRun:
    """A stored run by its name; raises InputError when there is none."""
    path = PLACE / f"{name}.json"
    if not path.is_file():
        raise InputError(
            "stored run", name, "", f"make it with studies/paper_store.py; {PLACE} has {', '.join(names())}"
        )
    made = json.loads(path.read_text(encoding="utf-8"))
    rows = _columns(path.with_suffix(".csv"))
    y = np.stack([rows[f"y{k}_mm"] for k in (1, 2, 3, 4)]) * MM
    tilt = np.stack([rows[f"tilt_{k}_mrad"] for k in ("upper", "lower")]) * 1e-3 if "tilt_upper_mrad" in rows else None
    curves = Curves(travel=rows["travel_m"], y=y, tilt=tilt)
    return StoredRun(name=name, curves=curves, shapes=_shapes(path), made=made)


def names() -> list[str]:
    """All stored runs."""
    return sorted(p.stem for p in PLACE.glob("*.json") if p.with_suffix(".csv").is_file())


def _shapes(path: Path) -> tuple[Shape, ...]:
    file = path.with_name(f"{path.stem}_shapes.csv")
    if not file.is_file():
        return ()
    rows = _columns(file)
    edges = {side: np.stack([rows[f"{side}_{axis}_m"] for axis in "xyz"], axis=1) for side in ("left", "right")}
    shapes = []
    for travel in np.unique(rows["travel_m"]):
        here = rows["travel_m"] == travel
        of = {name: float(rows[name][here][0]) for name in ("tail_x_m", "yaw_tail_rad")}
        shapes.append(
            Shape(travel=float(travel), tail_x=of["tail_x_m"], yaw=of["yaw_tail_rad"],
                  left=edges["left"][here], right=edges["right"][here])
        )  # fmt: skip
    return tuple(shapes)


def _columns(path: Path) -> dict[str, np.ndarray]:
    with path.open(encoding="utf-8") as file:
        header = file.readline().strip().split(",")
        table = np.loadtxt(file, delimiter=",", ndmin=2)
    return dict(zip(header, table.T, strict=True))
