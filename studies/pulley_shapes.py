"""Pulleys that are no cylinders, in 3D and by the laws of their effects: python -m studies.pulley_shapes

The 3D belt runs on the shapes (``scene`` of each effect) and knows none of their laws. On the short rig at 60 N/mm2,
after a yaw of -0.042 deg: what a shape changes in y, how far the law is off, and late rates.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.curves import Curves
from belt_sim.effects.base import Effect
from belt_sim.effects.load import load_effects
from belt_sim.model import analytic_model
from belt_sim.space import Options
from belt_sim.space.model import SpaceModel
from studies.application import application
from studies.paper.case import ROPE_EXAMPLE, YAW, paper_case

#: effect with its numbers, travel [m]: cants are read late, when their sudden beginning is forgotten
SHAPES: dict[str, tuple[dict[str, Any], float]] = {
    "taper": ({"kappa_t": 1e-3}, 4.0),
    "crown": ({"c": 0.5}, 4.0),
    "pulley_deflection": ({"compliance": 2e-6}, 4.0),
    "unequal_tension": ({"yaw_per_force": 1e-7}, 4.0),
    "yaw_compliance": ({"c_m": 2e-5}, 4.0),
    "cant": ({"gamma": 1e-3}, 16.0),
    "wobble": ({"beta_cos": 5e-4, "beta_sin_head": 5e-4}, 5.0),
}
#: what changes y by micrometres runs without inertia, which shakes the belt as much
STILL = ("pulley_deflection",)
CALM: dict[str, Any] = {"run_in": 0.3, "steps": 6}
MOVING: dict[str, Any] = {"dt": 2e-3, "run_in": 0.0, "settle": 0.3, "acceleration": 2.0}
FIRST, SPACING = 0.2, 0.02


@dataclass(frozen=True, kw_only=True)
class Change:
    """What a shape changes: off, the law's largest error over the largest change; rates [m/m]: mean late slopes of the
    four points, in 3D and by the law."""

    size: float
    off: float
    rates: tuple[float, float]


def change(effect: Effect, travel: float, dx: float) -> Change:
    """Both belts with the effect less without it."""
    options, engine = (CALM, "quasi_static") if effect.id in STILL else (MOVING, "native")
    space = SpaceModel(options=Options(dx=dx, **options), engine=engine)
    law, case = analytic_model("strip"), paper_case(60e6, YAW, ROPE_EXAMPLE)
    at = np.arange(FIRST, travel - 0.05, SPACING)
    seen, told = (
        _rows(belt.run(case, (effect,), travel=travel), at) - _rows(belt.run(case, (), travel=travel), at)
        for belt in (space, law)
    )
    return Change(
        size=float(np.abs(told).max()),
        off=float(np.abs(seen - told).max() / np.abs(told).max()),
        rates=(_rate(seen, at), _rate(told, at)),
    )


def _rows(curves: Curves, at: np.ndarray) -> np.ndarray:
    return np.array([np.interp(at, curves.travel, row) for row in np.asarray(curves.y)])


def _rate(y: np.ndarray, at: np.ndarray) -> float:
    """Mean slope of the four points over the second half."""
    late = at > at[-1] / 2
    return float(np.polyfit(at[late], y[:, late].mean(axis=0), 1)[0])


def pulley_shapes(asked: dict[str, Any]) -> None:
    """A row a shape."""
    table = Table("shape", "largest change mm", "law off", "rate um/m, 3D / law")
    for name in asked["only"]:
        numbers, travel = SHAPES[name]
        found = change(load_effects([{"id": name, **numbers}])[0], travel, float(asked["dx"]))
        rates = " / ".join(f"{1e6 * v:.1f}" for v in found.rates)
        table.add_row(f"{name} {numbers}", f"{1e3 * found.size:.3f}", f"{found.off:.1%}", rates)
    Console(width=120).print(table)


if __name__ == "__main__":
    application("pulley_shapes", pulley_shapes)
