"""The belt in three dimensions: MuJoCo scenes of ropes, grids of bonded particles and flex membranes.

The scene: loop (where a belt at rest lies), mesh (its nodes and what ties them), machine (the MJCF), options (and which
of them each engine obeys). The mechanics, on JAX and the same for all engines: belt (a case as arrays), wrap (the belt
on a pulley), elastic, chain (pulleys, and the stations as one, limp belts too), friction (Coulomb's law on a wrap).
run: one plan of steps, one recorder, one batch wrapper. Engines: native (on MuJoCo by mujoco_interface), mjx,
quasi_static; rolling_contact is MuJoCo's contact instead. model: effects act on it.
"""

from belt_sim.space.options import BELTS, Options

__all__ = ["BELTS", "Options"]
