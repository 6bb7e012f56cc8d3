"""Coulomb friction of the stations on a pulley: mujoco3d/wrap/friction.py on arrays, without branches.

After the equilibrium of a step the anchors of nodes that pull harder than friction allows are moved, by the ways that
follow from one convex problem a wrap; the next step starts from there. Every function here is of one pulley.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.belt_mechanics.belt import Belt, Shape, Surfaces
from belt_sim.belt_mechanics.tangent import wrapped
from belt_sim.belt_mechanics.wrap import Pose, Wrap, radius_at
from belt_sim.pytree import Numbers as Array
from belt_sim.quasi_static.coulomb import slip_increments

#: columns of a run with friction
COLUMNS = ("slip_head", "slip_tail", "sliding_head", "sliding_tail", "friction_residual")
TOLERANCE = 0.01  # of the largest limit: what friction may contradict Coulomb's law by in any step


class Slip(NamedTuple):
    """Of both pulleys. increment [m], (2, m, 2, n): of the last step, along the axis, along the turn; total [m], (2,):
    mean lateral slip so far; sliding (2,): share of held nodes that slid; residual (2,): force that contradicts
    Coulomb's law in the last step, in the largest limit."""

    increment: Array
    total: Array
    sliding: Array
    residual: Array

    @staticmethod
    def none(shape: Shape) -> "Slip":
        """A belt that has not slid yet."""
        return Slip(np.zeros((2, shape.lines, 2, shape.stations)), np.zeros(2), np.zeros(2), np.zeros(2))

    def columns(self) -> Array:
        """Shape (5,), as COLUMNS."""
        return jnp.concatenate([self.total, self.sliding, self.residual.max(keepdims=True)])


def worst_so_far(table: np.ndarray, recorded: np.ndarray) -> np.ndarray:
    """The largest residual since travel 0 at every recorded row of a table (rows, 20 or 25), yaw steps included."""
    begun = table[int(np.argmax(recorded)) : len(recorded), 24:]
    found = np.maximum.accumulate(begun.max(axis=1, initial=0.0))
    return found[recorded[int(np.argmax(recorded)) :]]


def slipped(
    shape: Shape, belt: Belt, wraps: Wrap, pose: Pose, pull: Array, slip: Slip, shaped: Array
) -> tuple[Wrap, Slip]:
    """Both wraps with their anchors moved; pull [N], (m, 3, n); shaped: 1 where the pulleys are what they are."""
    return jax.vmap(lambda *one: _let_slip(shape, belt, pull, shaped, *one))(wraps, belt.surfaces, pose, slip)


def _let_slip(
    shape: Shape, belt: Belt, pull: Array, shaped: Array, wrap: Wrap, surface: Surfaces, pose: Pose, slip: Slip
) -> tuple[Wrap, Slip]:
    assert belt.grip is not None
    count = (wrap.last - wrap.first) % shape.stations + 1
    at = jnp.arange(shape.held)
    k = (wrap.first + at) % shape.stations
    held = at < count
    turned = wrap.angle[:, k] + pose.spin
    local = jnp.einsum("mik,ij->mjk", pull[:, :, k], pose.axes)
    sin, cos = jnp.sin(turned), jnp.cos(turned)
    outwards = local[:, 0] * sin + local[:, 2] * cos
    holding = -jnp.stack([local[:, 1], local[:, 0] * cos - local[:, 2] * sin], axis=1)
    limit = jnp.where(held & jnp.isfinite(belt.friction), belt.friction * jnp.maximum(-outwards, 0.0), jnp.inf)
    chain = wrapped(belt.grip, wrap.first, count, shape.held)
    way, residual = slip_increments(jnp.where(held, holding, 0.0), limit, chain, slip.increment[:, :, k])
    residual = jnp.where(count > shape.held, jnp.inf, residual)
    y, angle, r = wrap.y[:, k], wrap.angle[:, k], wrap.r[:, k]
    there = y + way[:, 0], angle + way[:, 1] / r
    wider = radius_at(surface, shaped, there[0]) - radius_at(surface, shaped, y)
    moved = wrap._replace(
        y=wrap.y.at[:, k].set(there[0]), angle=wrap.angle.at[:, k].set(there[1]), r=wrap.r.at[:, k].add(wider)
    )
    lines = shape.lines
    return moved, Slip(
        increment=jnp.zeros_like(slip.increment).at[:, :, k].set(way),
        total=slip.total + way[:, 0].sum() / (lines * count),
        sliding=(way != 0.0).any(axis=1).sum() / (lines * count),
        residual=residual,
    )
