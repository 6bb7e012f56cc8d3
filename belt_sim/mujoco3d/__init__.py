"""The belt in three dimensions: MuJoCo scenes of ropes, grids of bonded particles and flex membranes."""

from belt_sim.mujoco3d.options import BELTS, Options
from belt_sim.mujoco3d.run import simulate
from belt_sim.mujoco3d.scene import undisturbed

__all__ = ["BELTS", "Options", "simulate", "undisturbed"]
