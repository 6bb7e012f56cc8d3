"""Block-tridiagonal systems, symmetric and positive definite, by cyclic reduction.

Every level eliminates every other row of blocks at once, so a chain of n rows takes log2(n) levels. Blocks stand first
and the rows of the chain last in every array: all arithmetic runs along the chain.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from belt_sim.pytree import Numbers as Array


class Level(NamedTuple):
    """One level of a factorised chain: of the rows that it eliminates, inverse (b, b, k) of the diagonal block, and
    that times the block on the row before and after, (b, b, k)."""

    inverse: Array
    before: Array
    after: Array


def product(one: Array, other: Array) -> Array:
    """Products of blocks (a, b, k) and (b, c, k), shape (a, c, k)."""
    return (one[:, :, None] * other[None]).sum(axis=1)


def inverse(block: Array) -> Array:
    """Inverses of positive definite blocks (b, b, k), by sweeping one row after another."""
    for i in range(block.shape[0]):
        here = (np.arange(block.shape[0]) == i)[:, None]
        cross, corner = (here | here.T)[..., None], (here & here.T)[..., None]
        pivot = 1.0 / block[i, i]
        others = block - block[:, i, None] * (block[None, i] * pivot)
        block = jnp.where(corner, -pivot, jnp.where(cross, block * pivot, others))
    return -block


def _turned(blocks: Array) -> Array:
    return jnp.swapaxes(blocks, 0, 1)


def factorised(diagonal: Array, beside: Array) -> list[Level]:
    """Of a chain with blocks diagonal (b, b, n) and ``beside`` (b, b, n): of row i on unknown i + 1; its last is 0."""
    size = diagonal.shape[0]
    levels: list[Level] = []
    while True:
        if diagonal.shape[-1] % 2 == 0:  # a row that stands alone makes the number odd
            alone = jnp.eye(size)[:, :, None]
            diagonal = jnp.concatenate([diagonal, alone], axis=-1)
            beside = jnp.concatenate([beside, jnp.zeros_like(alone)], axis=-1)
        inner = inverse(diagonal[..., 0::2])
        if diagonal.shape[-1] == 1:
            return [*levels, Level(inner, jnp.zeros_like(inner), jnp.zeros_like(inner))]
        none = jnp.zeros((size, size, 1))
        right, left = beside[..., 0::2], jnp.concatenate([none, beside[..., 1::2]], axis=-1)
        after, before = product(inner, right), product(inner, _turned(left))
        levels.append(Level(inner, before, after))
        diagonal = (
            diagonal[..., 1::2]
            - product(_turned(right)[..., :-1], after[..., :-1])
            - product(left[..., 1:], before[..., 1:])
        )
        beside = -product(left[..., 1:], after[..., 1:])


def solved(levels: list[Level], wanted: Array) -> Array:
    """Unknowns (b, c, n) for right-hand sides (b, c, n)."""
    rows, kept = wanted.shape[-1], []
    for level in levels[:-1]:
        if wanted.shape[-1] % 2 == 0:
            wanted = jnp.concatenate([wanted, jnp.zeros_like(wanted[..., :1])], axis=-1)
        outer = wanted[..., 0::2]
        kept.append(product(level.inverse, outer))
        back, on = product(_turned(level.before), outer), product(_turned(level.after), outer)
        wanted = wanted[..., 1::2] - on[..., :-1] - back[..., 1:]
    found = product(levels[-1].inverse, wanted)
    for level, alone in zip(reversed(levels[:-1]), reversed(kept), strict=True):
        count = alone.shape[-1] - 1
        found = found[..., :count]
        none = jnp.zeros_like(found[..., :1])
        before, after = jnp.concatenate([none, found], axis=-1), jnp.concatenate([found, none], axis=-1)
        outer = alone - product(level.before, before) - product(level.after, after)
        found = _woven(outer, found)
    return found[..., :rows]


def _woven(outer: Array, inner: Array) -> Array:
    """Rows 0, 2, 4 ... from ``outer`` (b, c, k + 1), the others from ``inner`` (b, c, k)."""
    pairs = jnp.stack([outer[..., :-1], inner], axis=-1).reshape(*inner.shape[:-1], -1)
    return jnp.concatenate([pairs, outer[..., -1:]], axis=-1)
