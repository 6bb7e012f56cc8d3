"""The belt in three dimensions: MuJoCo scenes of ropes, grids of bonded particles and flex membranes.

The scene: loop (where a belt at rest lies), mesh (its nodes and what ties them), machine (the MJCF), options.
The mechanics, on JAX and the same for all engines: belt (a case as arrays), wrap (the belt on a pulley), rope (one
without bending stiffness), pulleys, elastic, chain, block_tridiagonal, friction (Coulomb's law on a wrap), recording
(readings); batch for engines of many cases. engine=native: native, run_stages, state, mujoco_interface (all that is
assumed of MuJoCo); engine=mjx: mjx_engine, mjx_step, mjx_interface, mjx_model; engine=quasi_static: quasi_static,
equilibrium_step. rolling_contact and rolling_run are MuJoCo's contact instead. model: effects act on it.
"""

from belt_sim.space.options import BELTS, Options

__all__ = ["BELTS", "Options"]
