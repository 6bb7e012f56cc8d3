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
    last = block_inverse(other - block_product(_transpose(across), carried))
    beside = -block_product(carried, last)
    first = alone - block_product(beside, _transpose(carried))
    above, below = jnp.concatenate([first, beside], axis=1), jnp.concatenate([_transpose(beside), last], axis=1)
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


def _transpose(blocks: Array) -> Array:
    return jnp.swapaxes(blocks, 0, 1)


def _lane_length(rows: int) -> int:
    """Rows a lane of a chain of so many: a power of 2 that leaves some _LANES lanes."""
    return 2 ** max(round(math.log2(rows / _LANES)), 0) if rows > _LANES else rows


def _fold(chain: Array, length: int, filling: Array) -> Array:
    """A chain (b, c, n) in lanes (b, c, length, lanes), one behind the other, filled up at its end."""
    rows = chain.shape[-1]
    lanes = math.ceil(rows / length)
    if lanes * length > rows:
        more = jnp.broadcast_to(filling[..., 0], (*chain.shape[:-1], lanes * length - rows))
        chain = jnp.concatenate([chain, more], axis=-1)
    return jnp.swapaxes(chain.reshape(*chain.shape[:-1], lanes, length), -1, -2)


def _shift_to_even(odd: Array) -> Array:
    """What stands before each even row, of values at odd ones (b, c, k, lanes)."""
    last = odd[..., -1:, :]
    across = jnp.concatenate([jnp.zeros_like(last[..., :1]), last[..., :-1]], axis=-1)
    return jnp.concatenate([across, odd[..., :-1, :]], axis=-2)


def _shift_to_odd(even: Array) -> Array:
    """What stands behind each odd row, of values at even ones (b, c, k, lanes)."""
    first = even[..., :1, :]
    across = jnp.concatenate([first[..., 1:], jnp.zeros_like(first[..., :1])], axis=-1)
    return jnp.concatenate([even[..., 1:, :], across], axis=-2)


def factorise(diagonal: Array, beside: Array, inverse: Callable[[Array], Array] = block_inverse) -> list[Level]:
    """Of a chain with blocks diagonal (b, b, n) and ``beside`` (b, b, n): of row i on unknown i + 1; its last is 0."""
    size, rows = diagonal.shape[0], diagonal.shape[-1]
    length = _lane_length(rows)
    alone = jnp.eye(size)[:, :, None, None]
    diagonal, beside = _fold(diagonal, length, alone), _fold(beside, length, jnp.zeros_like(alone))
    levels: list[Level] = []
    while diagonal.shape[-2:] != (1, 1):
        if diagonal.shape[-2] == 1:  # one row a lane is left: from here on one lane of them all
            diagonal, beside = (jnp.swapaxes(v, -1, -2) for v in (diagonal, beside))
        if diagonal.shape[-2] % 2:
            diagonal = jnp.concatenate([diagonal, jnp.broadcast_to(alone, (size, size, 1, 1))], axis=-2)
            beside = jnp.concatenate([beside, jnp.zeros_like(alone)], axis=-2)
        inner, right, left = inverse(diagonal[..., 0::2, :]), beside[..., 0::2, :], _shift_to_even(beside[..., 1::2, :])
        after, before = block_product(inner, right), block_product(inner, _transpose(left))
        levels.append(Level(inner, before, after))
        diagonal = (
            diagonal[..., 1::2, :]
            - block_product(_transpose(right), after)
            - _shift_to_odd(block_product(left, before))
        )
        beside = -_shift_to_odd(block_product(left, after))
    inner = inverse(diagonal)
    return [*levels, Level(inner, jnp.zeros_like(inner), jnp.zeros_like(inner))]


def solve_chain(levels: list[Level], wanted: Array) -> Array:
    """Unknowns (b, c, n) for right-hand sides (b, c, n)."""
    rows, kept = wanted.shape[-1], []
    wanted = _fold(wanted, _lane_length(rows), jnp.zeros((*wanted.shape[:2], 1, 1)))
    for level in levels[:-1]:
        if wanted.shape[-2] == 1:
            wanted = jnp.swapaxes(wanted, -1, -2)
        if wanted.shape[-2] % 2:
            wanted = jnp.concatenate([wanted, jnp.zeros_like(wanted[..., :1, :])], axis=-2)
        outer = wanted[..., 0::2, :]
        kept.append(block_product(level.inverse, outer))
        back, on = block_product(_transpose(level.before), outer), block_product(_transpose(level.after), outer)
        wanted = wanted[..., 1::2, :] - on - _shift_to_odd(back)
    found = block_product(levels[-1].inverse, wanted)
    for level, alone in zip(reversed(levels[:-1]), reversed(kept), strict=True):
        count, lanes = alone.shape[-2:]
        if found.shape[-1] != lanes:
            found = jnp.swapaxes(found, -1, -2)[..., :lanes]
        found = found[..., :count, :]
        outer = alone - block_product(level.before, _shift_to_even(found)) - block_product(level.after, found)
        found = jnp.stack([outer, found], axis=-2).reshape(*outer.shape[:-2], 2 * count, lanes)
    return jnp.swapaxes(found, -1, -2).reshape(*found.shape[:2], -1)[..., :rows]
