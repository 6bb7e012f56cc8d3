"""The belt in three dimensions: MuJoCo scenes of ropes, grids of bonded particles and flex membranes.

Scene: options, loop, scene. Mechanics on JAX: elastic, belt, wrap, chain. run: plan, curves, batches.
Engines: native (MuJoCo), mjx, quasi_static; rolling_contact is MuJoCo's own contact.
"""

from belt_sim.space.options import BELTS, Options

__all__ = ["BELTS", "Options"]
