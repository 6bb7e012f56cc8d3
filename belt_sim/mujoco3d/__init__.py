"""The belt in three dimensions: MuJoCo scenes of ropes, grids of bonded particles and flex membranes."""

from typing import TYPE_CHECKING, Any

from belt_sim.mujoco3d.model import SpaceModel, undisturbed
from belt_sim.mujoco3d.options import BELTS, Options

if TYPE_CHECKING:
    from belt_sim.mujoco3d.run.simulate import simulate

__all__ = ["BELTS", "Options", "SpaceModel", "simulate", "undisturbed"]


def __getattr__(name: str) -> Any:
    """``simulate`` brings MuJoCo with it, which takes a while to load."""
    if name != "simulate":
        raise AttributeError(name)
    from belt_sim.mujoco3d.run.simulate import simulate

    return simulate
