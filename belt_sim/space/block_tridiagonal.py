"""Block-tridiagonal systems, symmetric and positive definite, by cyclic reduction: log2(n) levels of every other row.

Blocks stand first in every array. The chain is folded into lanes, stretches of it side by side, which stand last: every
other row of all lanes lies together in memory, and all arithmetic runs along the lanes.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from belt_sim.case import Numbers as Array

_LANES = 128


class Level(NamedTuple):
    """One level of a factorised chain: of the k rows a lane that it eliminates, inverse (b, b, k, lanes) of the
    diagonal block, and that times the block on the row before and after, of the same shape."""

    inverse: Array
    before: Array
    after: Array


def block_product(one: Array, other: Array) -> Array:
    """Products of blocks (a, b, ...) and (b, c, ...), shape (a, c, ...)."""
    found = one[:, 0, None] * other[None, 0]
    for k in range(1, one.shape[1]):  # written out, it is faster than a sum over an axis
        found = found + one[:, k, None] * other[None, k]
    return found


def block_inverse(block: Array) -> Array:
    """Inverses of symmetric positive definite blocks (b, b, ...), halved down to single numbers.

    Elimination, not cofactors, which would lose what is soft beside a stiff link.
    """
    size = block.shape[0]
    if size == 1:
        return 1.0 / block
    half = size // 2
    one, across, other = block[:half, :half], block[:half, half:], block[half:, half:]
    alone = block_inverse(one)
    carried = block_product(alone, across)
    last = block_inverse(other - block_product(across.swapaxes(0, 1), carried))
    beside = -block_product(carried, last)
    first = alone - block_product(beside, carried.swapaxes(0, 1))
    above, below = jnp.concatenate([first, beside], axis=1), jnp.concatenate([beside.swapaxes(0, 1), last], axis=1)
    return jnp.concatenate([above, below])


def sweep_inverse(block: Array) -> Array:
    """Inverses of positive definite blocks (b, b, k, lanes), by sweeping one row after another.

    Five times slower than ``block_inverse``, and as exact where entries of a block differ by many powers of ten.
    """
    for i in range(block.shape[0]):
        here = (np.arange(block.shape[0]) == i)[:, None]
        cross, corner = (v[..., None, None] for v in (here | here.T, here & here.T))
        pivot = 1.0 / block[i, i]
        others = block - block[:, i, None] * (block[None, i] * pivot)
        block = jnp.where(corner, -pivot, jnp.where(cross, block * pivot, others))
    return -block


def _fold(chain: Array, filling: Array | float) -> Array:
    """A chain (b, c, n) in lanes (b, c, length, lanes), one behind the other, filled up at its end; their length is the
    power of 2 that leaves some _LANES lanes."""
    rows = chain.shape[-1]
    length = 2 ** max(round(math.log2(rows / _LANES)), 0) if rows > _LANES else rows
    lanes = math.ceil(rows / length)
    if lanes * length > rows:
        more = jnp.broadcast_to(filling, (*chain.shape[:-1], lanes * length - rows))
        chain = jnp.concatenate([chain, more], axis=-1)
    return chain.reshape(*chain.shape[:-1], lanes, length).swapaxes(-1, -2)


def _shift(values: Array, by: int) -> Array:
    """What stands before each even row, of values at odd ones (b, c, k, lanes): by = 1; behind each odd row, of values
    at even ones: by = -1."""
    if by > 0:
        last = values[..., -1:, :]
        across = jnp.concatenate([jnp.zeros_like(last[..., :1]), last[..., :-1]], axis=-1)
        return jnp.concatenate([across, values[..., :-1, :]], axis=-2)
    first = values[..., :1, :]
    across = jnp.concatenate([first[..., 1:], jnp.zeros_like(first[..., :1])], axis=-1)
    return jnp.concatenate([values[..., 1:, :], across], axis=-2)


def factorise(diagonal: Array, beside: Array, inverse: Callable[[Array], Array] = block_inverse) -> list[Level]:
    """Of a chain with blocks diagonal (b, b, n) and ``beside`` (b, b, n): of row i on unknown i + 1; its last is 0."""
    size = diagonal.shape[0]
    alone = jnp.eye(size)[:, :, None, None]
    diagonal, beside = _fold(diagonal, alone[..., 0]), _fold(beside, 0.0)
    levels: list[Level] = []
    while diagonal.shape[-2:] != (1, 1):
        if diagonal.shape[-2] == 1:  # one row a lane is left: from here on one lane of them all
            diagonal, beside = (v.swapaxes(-1, -2) for v in (diagonal, beside))
        if diagonal.shape[-2] % 2:
            diagonal = jnp.concatenate([diagonal, jnp.broadcast_to(alone, (size, size, 1, 1))], axis=-2)
            beside = jnp.concatenate([beside, jnp.zeros_like(alone)], axis=-2)
        inner, right, left = inverse(diagonal[..., 0::2, :]), beside[..., 0::2, :], _shift(beside[..., 1::2, :], 1)
        after, before = block_product(inner, right), block_product(inner, left.swapaxes(0, 1))
        levels.append(Level(inner, before, after))
        diagonal = (
            diagonal[..., 1::2, :]
            - block_product(right.swapaxes(0, 1), after)
            - _shift(block_product(left, before), -1)
        )
        beside = -_shift(block_product(left, after), -1)
    inner = inverse(diagonal)
    return [*levels, Level(inner, jnp.zeros_like(inner), jnp.zeros_like(inner))]


def solve_chain(levels: list[Level], wanted: Array) -> Array:
    """Unknowns (b, c, n) for right-hand sides (b, c, n)."""
    rows, kept = wanted.shape[-1], []
    wanted = _fold(wanted, 0.0)
    for level in levels[:-1]:
        if wanted.shape[-2] == 1:
            wanted = wanted.swapaxes(-1, -2)
        if wanted.shape[-2] % 2:
            wanted = jnp.concatenate([wanted, jnp.zeros_like(wanted[..., :1, :])], axis=-2)
        outer = wanted[..., 0::2, :]
        kept.append(block_product(level.inverse, outer))
        back, on = block_product(level.before.swapaxes(0, 1), outer), block_product(level.after.swapaxes(0, 1), outer)
        wanted = wanted[..., 1::2, :] - on - _shift(back, -1)
    found = block_product(levels[-1].inverse, wanted)
    for level, alone in zip(reversed(levels[:-1]), reversed(kept), strict=True):
        count, lanes = alone.shape[-2:]
        if found.shape[-1] != lanes:
            found = found.swapaxes(-1, -2)[..., :lanes]
        found = found[..., :count, :]
        outer = alone - block_product(level.before, _shift(found, 1)) - block_product(level.after, found)
        found = jnp.stack([outer, found], axis=-2).reshape(*outer.shape[:-2], 2 * count, lanes)
    return found.swapaxes(-1, -2).reshape(*found.shape[:2], -1)[..., :rows]
