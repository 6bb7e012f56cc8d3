"""The belt in three dimensions: MuJoCo scenes of ropes, grids of bonded particles and flex membranes."""

from belt_sim.mujoco3d.options import BELTS, Options
from belt_sim.mujoco3d.run import simulate
from belt_sim.mujoco3d.surface import EdgeGuide, PulleySurface, SceneParts

__all__ = ["BELTS", "EdgeGuide", "Options", "PulleySurface", "SceneParts", "simulate"]
