"""The belt in three dimensions: MuJoCo scenes of ropes, grids of bonded particles and flex membranes.

mesh: where the nodes are and what ties them; wrap: the belt on a pulley; loads: what else acts on the nodes; machine:
the scene and its pulleys; run: the stages, one step, what is recorded. state.py is what a step reads and writes,
options.py how a run is made, mujoco_4.py all that is assumed of MuJoCo. model.py, which nothing else here needs, makes
it a model that effects act on.
"""

from typing import TYPE_CHECKING, Any

from belt_sim.mujoco3d.options import BELTS, Options

if TYPE_CHECKING:
    from belt_sim.mujoco3d.engine import simulate

__all__ = ["BELTS", "Options", "simulate"]


def __getattr__(name: str) -> Any:
    """``simulate`` brings MuJoCo with it, which takes a while to load."""
    if name != "simulate":
        raise AttributeError(name)
    from belt_sim.mujoco3d.engine import simulate

    return simulate
