"""Coulomb friction of the stations on both pulleys after a step of travel.

After the equilibrium of a step the anchors of nodes that pull harder than friction allows are moved, by the increments
of mujoco3d/friction.py; the next step starts from there.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from belt_sim.mujoco3d.belt import BeltArrays, SurfaceArrays
from belt_sim.mujoco3d.friction import slip_increments, wrap_chain
from belt_sim.mujoco3d.wrap import PoseArrays, WrapArrays, slide_anchors, surface_components
from belt_sim.pytrees import Numbers as Array

#: columns of a run with friction
COLUMNS = ("slip_head", "slip_tail", "sliding_head", "sliding_tail", "friction_residual")
TOLERANCE = 0.01  # of the largest limit: what friction may contradict Coulomb's law by in any step


class SlipState(NamedTuple):
    """Of both pulleys. increment [m], (2, m, 2, n): of the last step, along the axis, along the turn; total [m], (2,):
    mean lateral slip so far; sliding (2,): share of held nodes that slid; residual (2,): force that contradicts
    Coulomb's law in the last step, in the largest limit."""

    increment: Array
    total: Array
    sliding: Array
    residual: Array

    def columns(self) -> Array:
        """Shape (5,), as COLUMNS."""
        return jnp.concatenate([self.total, self.sliding, self.residual.max(keepdims=True)])


def worst_residual(table: np.ndarray, recorded: np.ndarray) -> np.ndarray:
    """The largest residual since travel 0 at every recorded row of a table (rows, 20 or 25), yaw steps included."""
    begun = table[int(np.argmax(recorded)) : len(recorded), 24:]
    found = np.maximum.accumulate(begun.max(axis=1, initial=0.0))
    return found[recorded[int(np.argmax(recorded)) :]]


def slide_wrap(
    belt: BeltArrays,
    pull: Array,
    shaped: Array,
    wrap: WrapArrays,
    surface: SurfaceArrays,
    pose: PoseArrays,
    slip: SlipState,
) -> tuple[WrapArrays, SlipState]:
    """A wrap with its anchors moved; pull [N], (m, 3, n); shaped: 1 where the pulleys are what they are."""
    assert belt.sliding_stiffness is not None
    shape, at = belt.shape, jnp.arange(belt.shape.longest_wrap)
    count, k = (wrap.last - wrap.first) % shape.stations + 1, (wrap.first + at) % shape.stations
    held = at < count
    outwards, across, along = surface_components(wrap, pose, k, pull[:, :, k])
    holding = -jnp.stack([across, along], axis=1)
    limit = jnp.where(held & jnp.isfinite(belt.friction), belt.friction * jnp.maximum(-outwards, 0.0), jnp.inf)
    chain = wrap_chain(belt.sliding_stiffness, wrap.first, count, shape.longest_wrap)
    way, residual = slip_increments(jnp.where(held, holding, 0.0), limit, chain, slip.increment[:, :, k])
    residual = jnp.where(count > shape.longest_wrap, jnp.inf, residual)
    nodes = shape.lines * count
    return slide_anchors(surface, wrap, shaped, k, way), SlipState(
        increment=jnp.zeros_like(slip.increment).at[:, :, k].set(way),
        total=slip.total + way[:, 0].sum() / nodes,
        sliding=(way != 0.0).any(axis=1).sum() / nodes,
        residual=residual,
    )
