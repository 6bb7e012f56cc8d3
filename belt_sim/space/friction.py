"""Coulomb friction of landed nodes: how far they slide until no node pulls harder than friction allows.

The increments u that make 1/2 u K u + f u + sum of limit |u_i| least (Tresca's problem), by Newton's method in a fixed
number of iterations on the stations of a wrap, a block-tridiagonal chain.
"""

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Numbers as Array
from belt_sim.space.block_tridiagonal import factorise, solve_chain, sweep_inverse
from belt_sim.space.elastic import Ties, stretch_energy
from belt_sim.space.loop import LaidLoop
from belt_sim.space.mesh import Mesh


class SlidingStiffness(NamedTuple):
    """Blocks [N/m] of stations of even and odd number, each (2, 2 m, 2 m): own, of the next station when this one
    moves after; relief_first, relief_last: what the span beyond an outermost station takes off its own block."""

    own: Array
    after: Array
    relief_first: Array
    relief_last: Array


def read_sliding_stiffness(
    ties: Ties, bonds: bool, mesh: Mesh, loop: LaidLoop, inertia: np.ndarray | float = 0.0
) -> SlidingStiffness:
    """Read off in the middle of the upper span, laid and under tension.

    inertia [N/m], shape (m,): mass / dt^2 of a node, which a step of an implicit integrator adds to the stiffness of
    the free spans; 0 = they give way as they do at rest.
    """
    upper = np.flatnonzero(loop.z > 0.0)
    middle = int(upper[np.argmin(np.abs(loop.x[upper] - loop.x.mean()))])
    tail_x = loop.x.max() - loop.radius_tail
    free = int(np.count_nonzero(np.abs(loop.x[upper] - 0.5 * tail_x) < 0.5 * tail_x))
    numbers = np.arange(middle - 1, middle + 4)
    laid, curvature = np.moveaxis(mesh.laid[numbers], 0, -1), jax.jit(stretch_energy, static_argnums=1)
    cell = np.asarray(curvature(ties, bonds, laid, numbers, jnp.array(0.0), taut=laid).curvature)
    size = 3 * mesh.lines
    plane = np.arange(size).reshape(-1, 3)[:, [1, 0]].ravel()  # along the axis and along the turn on a pulley
    here, there = np.ix_(plane, plane), np.ix_(plane + size, plane + size)
    down, up = np.ix_(plane + size, plane), np.ix_(plane, plane + size)
    block = np.empty((2, 3, 2 * mesh.lines, 2 * mesh.lines))
    for k in (1, 2):
        before, behind = cell[..., k - 1], cell[..., k]
        block[numbers[k] % 2] = before[up], before[there] + behind[here], behind[down]
    still = np.diag(np.repeat(np.broadcast_to(inertia, (mesh.lines,)), 2))
    relief = np.zeros((2, 2, 2 * mesh.lines, 2 * mesh.lines))
    for (end, side), parity in itertools.product(enumerate((-1, 1)), (0, 1)):
        taken = relief[end, parity]  # static condensation of the free span, from its far end on
        for k in reversed(range(free)):
            own_parity = (parity + side + k) % 2
            own = block[own_parity, 1] + still - taken
            inwards = block[own_parity, 1 - side]  # felt by the station nearer to the pulley
            outwards = block[1 - own_parity, 1 + side]  # felt here when that one moves
            taken[:] = inwards @ np.linalg.solve(own, outwards)
    return SlidingStiffness(block[:, 1], block[:, 2], *relief)


def wrap_chain(grip: SlidingStiffness, first: Array, count: Array, longest: int) -> tuple[Array, Array]:
    """The chain of ``count`` stations from number ``first`` on, (2 m, 2 m, longest) twice: diagonal, on the next."""
    at = jnp.arange(longest)
    parity = (first + at) % 2
    own = jnp.asarray(grip.own)[parity]
    own = own.at[0].add(-jnp.asarray(grip.relief_first)[parity[0]])
    own = own.at[count - 1].add(-jnp.asarray(grip.relief_last)[parity[count - 1]])
    beside = jnp.swapaxes(jnp.asarray(grip.after)[parity], 1, 2)
    return jnp.moveaxis(own, 0, -1), jnp.moveaxis(jnp.where((at < count - 1)[:, None, None], beside, 0.0), 0, -1)


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

    def lowest(slip: Array, change: Array, before: Array, after: Array) -> tuple[Array, Array]:
        """Where on the way of a change the function is least, and what it is there; friction [N] before, after it."""
        ways = slip + _SHARES[:, None, None, None] * change
        rubbed = (bounded * jnp.sqrt((ways * ways).sum(axis=2))).sum(axis=(1, 2))
        cost = -_SHARES * (before * change).sum() + 0.5 * _SHARES**2 * ((before - after) * change).sum() + rubbed
        best = jnp.argmin(cost)
        return ways[best], cost[best]

    def iteration(carry: tuple[Array, Array, Array], _: None) -> tuple[tuple[Array, Array, Array], None]:
        slip, best, least = carry
        held = friction(slip)
        tried = _newton(held + scale * slip, scale, force, limit, chain)
        ways = [lowest(slip, s - slip, held, friction(s)) for s in tried]
        slip = jnp.where(ways[0][1] <= ways[1][1], ways[0][0], ways[1][0])
        error = wrong(slip)
        better = error < least
        return (slip, jnp.where(better, slip, best), jnp.where(better, error, least)), None

    bounded = jnp.where(jnp.isfinite(limit), limit, 0.0)
    guess = jnp.where(jnp.isfinite(limit)[:, None], guess, 0.0)
    (_, best, least), _ = jax.lax.scan(iteration, (guess, guess, wrong(guess)), None, length=_ITERATIONS)
    return best, least


def _newton(z: Array, scale: Array, force: Array, limit: Array, chain: tuple[Array, Array]) -> tuple[Array, Array]:
    """One iteration from z = h + r u [N], shape (m, 2, k), h the friction -(f + K u), r = ``scale`` [N/m]; and the same
    with nodes at rest that went back.

    At the minimum every node's h is z cut off at the limit. So a node with z within the limit rests; one beyond it gets
    the friction limit z / |z|, and what turning its direction costs.
    """
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
