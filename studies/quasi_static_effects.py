"""Effects with a scene half in both engines of the 3D belt: python -m studies.quasi_static_effects

On the short rig after a yaw of -0.042 deg: what each changes in y of the four points, in the run in time and in the
quasi-static one, and how far y itself is apart. All cases of engine=quasi_static are one batch.
"""

from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.effects.load import load_effects
from belt_sim.errors import SimulationError
from belt_sim.scene_parts import SceneParts
from belt_sim.space import Options
from belt_sim.space.model import SpaceModel
from belt_sim.space.native import simulate
from belt_sim.space.options import accurate_speed, string_speed
from belt_sim.space.quasi_static import simulate_batch
from studies.application import application
from studies.paper.case import ROPE_EXAMPLE, YAW, paper_case

NUMBERS: dict[str, dict[str, float]] = {
    "camber": {"kappa_c": 2e-4},
    "cant": {"gamma": 1e-3},
    "crown": {"c": 0.5},
    "edge_guide": {"stiffness": 1e6, "gap": 1e-4, "at": 0.8},
    "idler_skew": {"force": 20.0, "place": 0.3},
    "lift_off": {"strength": 1.0},
    "machine_tilt": {"angle": 0.5},
    "off_centre_load": {"moment": 0.1},
    "pulley_deflection": {"compliance": 2e-6},
    "side_drag": {"moment": 5.0, "place": 0.7},
    "slip": {"inverse_friction": 6.667},
    "taper": {"kappa_t": 1e-3},
    "unequal_tension": {"yaw_per_force": 3e-7},
    "weld": {"angle": 1e-3, "at": 1.0},
    "wobble": {"beta_cos": 5e-4},
    "yaw_compliance": {"c_m": 2e-5},
    "yaw_offset_head": {"beta_0": 5e-4},
    "yaw_offset_tail": {"beta_0": 5e-4},
}
FIRST, SPACING = 0.05, 0.01


def scenes(case: Case, names: list[str], model: SpaceModel) -> list[SceneParts]:
    """That without effects first."""
    asked: list[Any] = [[], *([{"id": name, **NUMBERS[name]}] for name in names)]
    return [model.parts(case, load_effects(a)) for a in asked]


def rows(curves: Curves | SimulationError, travel: float) -> np.ndarray:
    """y of the four points [m] at the study's places."""
    if isinstance(curves, SimulationError):
        raise curves
    at = np.arange(FIRST, travel, SPACING)
    return np.array([np.interp(at, curves.travel, row) for row in np.asarray(curves.y)])


def quasi_static_effects(asked: dict[str, Any]) -> None:
    """A row an effect."""
    case, travel, names = (
        paper_case(float(asked["tension"]) * 1e6, YAW, ROPE_EXAMPLE),
        float(asked["travel"]),
        asked["only"],
    )
    options = Options(
        dx=float(asked["dx"]), dt=1e-3, run_in=0.3, settle=0.3, acceleration=2.0, steps=int(asked["steps"]),
        belt_speed=accurate_speed(string_speed(case)) / float(asked["slower"]),
    )  # fmt: skip
    parts = scenes(case, names, SpaceModel(options=options))
    batch = simulate_batch([case] * len(parts), travel=travel, options=options, parts=parts)
    still = [rows(c, travel) for c in batch]
    table = Table("effect", "largest change um", "change off", "y off")
    plain = None
    for name, one, found in zip(["none", *names], parts, still, strict=True):
        native = rows(simulate(case, travel=travel, options=options, parts=one), travel)
        plain = native if plain is None else plain
        change = native - plain
        size = float(np.abs(change).max())
        off = float(np.abs(found - still[0] - change).max()) / size if size else 0.0
        table.add_row(
            f"{name} {NUMBERS.get(name, '')}", f"{1e6 * size:.1f}", f"{off:.2%}",
            f"{np.abs(found - native).max() / np.abs(native).max():.2%}",
        )  # fmt: skip
    Console(width=120).print(table)


if __name__ == "__main__":
    application("quasi_static_effects", quasi_static_effects)
