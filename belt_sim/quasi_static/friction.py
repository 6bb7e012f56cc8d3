"""Coulomb friction of the stations on a pulley: belt_sim.mujoco3d.friction on arrays, without branches.

After the equilibrium of a step the anchors of nodes that pull harder than friction allows are moved, by the increments
that follow from one convex problem a wrap; the next step starts from there. The increments u that make
1/2 u K u + f u + sum of limit |u_i| least are those at which every node's friction h = -(f + K u) is h + r u cut off at
the limit, for any r > 0. Newton's method on that, in a fixed number of iterations: a node within the limit rests; one
beyond it gets the friction limit z / |z|, z = h + r u, and what turning its direction costs. Each
iteration is one chain.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.mujoco3d.belt import BatchShape, BeltArrays, SurfaceArrays, wrap_chain
from belt_sim.mujoco3d.block_tridiagonal import factorise, solve_chain, sweep_inverse
from belt_sim.mujoco3d.wrap import PoseArrays, WrapArrays, slide_anchors, surface_components
from belt_sim.pytrees import Numbers as Array

_ITERATIONS = 20
_SHARES = np.array([1.0, 0.5, 0.25, 0.1, 0.03])  # of a Newton step: whole ones alone may go in circles
_TINY = 1e-300


def slip_increments(force: Array, limit: Array, chain: tuple[Array, Array], guess: Array) -> tuple[Array, Array]:
    """Slip increments [m], shape (m, 2, k), and the largest force that contradicts Coulomb's law, in the largest limit.

    force [N], shape (m, 2, k): holding forces if none slid; limit [N], shape (m, k), inf = it rests; chain: blocks of
    the stiffness [N/m], diagonal and those on the next station (2 m, 2 m, k); guess [m], shape (m, 2, k).
    """
    lines, _, count = force.shape
    size = 2 * lines
    scale = jnp.trace(chain[0][..., count // 2]) / size
    largest = jnp.maximum(jnp.where(jnp.isfinite(limit), limit, 0.0).max(), _TINY)

    def friction(slip: Array) -> Array:
        u = slip.reshape(size, count)
        pulled = (chain[0] * u[None]).sum(axis=1)
        pulled = pulled.at[:, :-1].add((chain[1][..., :-1] * u[None, :, 1:]).sum(axis=1))
        pulled = pulled.at[:, 1:].add((chain[1][..., :-1] * u[:, None, :-1]).sum(axis=0))
        return -force - pulled.reshape(force.shape)

    def wrong(slip: Array) -> Array:
        """By how much a step's friction contradicts the law."""
        held, way = friction(slip), jnp.sqrt((slip * slip).sum(axis=1))
        against = held - slip * (jnp.where(way > 0.0, limit, 0.0) / jnp.maximum(way, _TINY))[:, None]
        left = jnp.sqrt((against * against).sum(axis=1))
        return jnp.where(way > 0.0, left, jnp.maximum(left - limit, 0.0)).max() / largest

    def iteration(carry: tuple[Array, Array, Array], _: None) -> tuple[tuple[Array, Array, Array], None]:
        slip, best, least = carry
        held = friction(slip)
        ways = [
            _lowest(slip, s - slip, held, friction(s), bounded)
            for s in _newton(held + scale * slip, scale, force, limit, chain)
        ]
        slip = jnp.where(ways[0][1] <= ways[1][1], ways[0][0], ways[1][0])
        error = wrong(slip)
        better = error < least
        return (slip, jnp.where(better, slip, best), jnp.where(better, error, least)), None

    bounded = jnp.where(jnp.isfinite(limit), limit, 0.0)
    guess = jnp.where(jnp.isfinite(limit)[:, None], guess, 0.0)
    (_, best, least), _ = jax.lax.scan(iteration, (guess, guess, wrong(guess)), None, length=_ITERATIONS)
    return best, least


def _lowest(slip: Array, change: Array, before: Array, after: Array, limit: Array) -> tuple[Array, Array]:
    """Where on the way of a change the function is least, and what it is there.

    before, after [N]: friction without and with all of the change.
    """
    linear, curve = -(before * change).sum(), ((before - after) * change).sum()
    ways = slip + _SHARES[:, None, None, None] * change
    rubbed = (limit * jnp.sqrt((ways * ways).sum(axis=2))).sum(axis=(1, 2))
    cost = _SHARES * linear + 0.5 * _SHARES**2 * curve + rubbed
    best = jnp.argmin(cost)
    return ways[best], cost[best]


def _newton(z: Array, scale: Array, force: Array, limit: Array, chain: tuple[Array, Array]) -> tuple[Array, Array]:
    """One iteration from z [N], shape (m, 2, k); scale [N/m]: r. And the same with nodes at rest that went back."""
    lines, _, count = force.shape
    size = 2 * lines
    long = jnp.sqrt((z * z).sum(axis=1))
    moves = long > limit
    along = z / jnp.maximum(long, _TINY)[:, None]
    bounded = jnp.where(moves, limit, 0.0)
    turning = scale * bounded / jnp.where(moves, long - bounded, 1.0)
    across = (jnp.eye(2)[..., None] - along[:, :, None] * along[:, None]) * turning[:, None, None]
    free = jnp.repeat(moves, 2, axis=0)
    diagonal = jnp.where(free[:, None] & free[None], chain[0], 0.0)
    for j in range(lines):
        rows = slice(2 * j, 2 * j + 2)
        diagonal = diagonal.at[rows, rows].add(across[j])
    diagonal = jnp.where((jnp.eye(size, dtype=bool))[..., None] & ~free[:, None], 1.0, diagonal)
    beside = jnp.where(free[:, None] & jnp.roll(free, -1, axis=-1)[None], chain[1], 0.0).at[..., -1].set(0.0)
    wanted = jnp.where(free, -(force + bounded[:, None] * along).reshape(size, count), 0.0)
    slip = solve_chain(factorise(diagonal, beside, sweep_inverse), wanted[:, None])[:, 0].reshape(force.shape)
    back = ((slip * along).sum(axis=1) < 0.0) & (bounded > 0.0)
    return slip, jnp.where(back[:, None], 0.0, slip)


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

    @staticmethod
    def none(shape: BatchShape) -> "SlipState":
        """A belt that has not slid yet."""
        return SlipState(np.zeros((2, shape.lines, 2, shape.stations)), np.zeros(2), np.zeros(2), np.zeros(2))

    def columns(self) -> Array:
        """Shape (5,), as COLUMNS."""
        return jnp.concatenate([self.total, self.sliding, self.residual.max(keepdims=True)])


def worst_residual(table: np.ndarray, recorded: np.ndarray) -> np.ndarray:
    """The largest residual since travel 0 at every recorded row of a table (rows, 20 or 25), yaw steps included."""
    begun = table[int(np.argmax(recorded)) : len(recorded), 24:]
    found = np.maximum.accumulate(begun.max(axis=1, initial=0.0))
    return found[recorded[int(np.argmax(recorded)) :]]


def slide_wraps(
    shape: BatchShape,
    belt: BeltArrays,
    wraps: WrapArrays,
    pose: PoseArrays,
    pull: Array,
    slip: SlipState,
    shaped: Array,
) -> tuple[WrapArrays, SlipState]:
    """Both wraps with their anchors moved; pull [N], (m, 3, n); shaped: 1 where the pulleys are what they are."""
    return jax.vmap(lambda *one: _slide_wrap(shape, belt, pull, shaped, *one))(wraps, belt.surfaces, pose, slip)


def _slide_wrap(
    shape: BatchShape,
    belt: BeltArrays,
    pull: Array,
    shaped: Array,
    wrap: WrapArrays,
    surface: SurfaceArrays,
    pose: PoseArrays,
    slip: SlipState,
) -> tuple[WrapArrays, SlipState]:
    assert belt.sliding_stiffness is not None
    count = (wrap.last - wrap.first) % shape.stations + 1
    at = jnp.arange(shape.held)
    k = (wrap.first + at) % shape.stations
    held = at < count
    outwards, across, along = surface_components(wrap, pose, k, pull[:, :, k])
    holding = -jnp.stack([across, along], axis=1)
    limit = jnp.where(held & jnp.isfinite(belt.friction), belt.friction * jnp.maximum(-outwards, 0.0), jnp.inf)
    chain = wrap_chain(belt.sliding_stiffness, wrap.first, count, shape.held)
    way, residual = slip_increments(jnp.where(held, holding, 0.0), limit, chain, slip.increment[:, :, k])
    residual = jnp.where(count > shape.held, jnp.inf, residual)
    moved = slide_anchors(surface, wrap, shaped, k, way)
    lines = shape.lines
    return moved, SlipState(
        increment=jnp.zeros_like(slip.increment).at[:, :, k].set(way),
        total=slip.total + way[:, 0].sum() / (lines * count),
        sliding=(way != 0.0).any(axis=1).sum() / (lines * count),
        residual=residual,
    )
