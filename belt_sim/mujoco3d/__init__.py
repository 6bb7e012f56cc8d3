"""The belt in three dimensions: MuJoCo scenes of ropes, grids of bonded particles and flex membranes.

The scene: loop (where a belt at rest lies), mesh (its nodes and what ties them), machine (the MJCF), options.
The mechanics, once for NumPy and JAX (arrays): belt (a case as arrays), wrap (the belt on a pulley), rope (one without
bending stiffness), pulleys, recording (readings). On JAX alone: elastic, chain, block_tridiagonal, friction
(Coulomb's law on a wrap), and batch for engines of many cases. The engine in time: engine, run_stages, contact, state,
mujoco_interface (all that is assumed of MuJoCo); rolling_contact and rolling_run are MuJoCo's contact instead. model
makes it a model that effects act on.
"""

from belt_sim.mujoco3d.options import BELTS, Options

__all__ = ["BELTS", "Options"]
