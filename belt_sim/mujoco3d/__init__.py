"""The belt in three dimensions: MuJoCo scenes of ropes, grids of bonded particles and flex membranes.

The scene: loop (where a belt at rest lies), mesh (its nodes and what ties them), machine (the MJCF), options.
The mechanics, on JAX and the same for all engines: belt (a case as arrays), wrap (the belt on a pulley), rope (one
without bending stiffness), pulleys, elastic, chain, block_tridiagonal, friction (Coulomb's law on a wrap), recording
(readings); batch for engines of many cases. The engine in time: engine, run_stages, state, mujoco_interface (all that
is assumed of MuJoCo); rolling_contact and rolling_run are MuJoCo's contact instead. model makes it a model that effects
act on.
"""

from belt_sim.mujoco3d.options import BELTS, Options

__all__ = ["BELTS", "Options"]
