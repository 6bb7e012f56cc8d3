"""Static equilibrium of the spans between held stations, with the tail pulley on its slide and its free axis.

One factorisation of the block-tridiagonal stiffness, then a few corrections with it. The chain of blocks is the whole
loop, cut in the middle of the head's wrap; rows of held stations are unit blocks, which part the spans.
"""

from typing import NamedTuple

import jax.numpy as jnp

from belt_sim.belt_mechanics.belt import Belt, Shape
from belt_sim.belt_mechanics.blocks import Level, factorised, solved
from belt_sim.belt_mechanics.chain import Places, spans_blocks, stiffness
from belt_sim.belt_mechanics.guides import Press
from belt_sim.pytree import Numbers as Array


class Stiffness(NamedTuple):
    """A factorised equilibrium.

    levels: of the chain; entry, exit (6 m, 6 m): stiffness of the cells at the tail's ends; pulls (3 m, 2, n): forces
    on the free nodes by the tail pulley's slide and spin; moves (2, 3 m, 2): how its outermost stations move with them.
    """

    levels: list[Level]
    entry: Array
    exit: Array
    pulls: Array
    moves: Array


def factorise(
    shape: Shape,
    belt: Belt,
    nodes: Array,
    taut: Array,
    places: Places,
    twist: Array,
    share: Array,
    moves: Array,
    press: Press | None,
) -> Stiffness:
    """Of the chain at ``nodes`` [m], (m, 3, n), whose ``taut`` places are those of its last equilibrium.

    moves (2, 3 m, 2): how the tail's outermost stations move with its slide and its spin; press: of guides.
    """
    size = 3 * shape.lines
    cell, whole = stiffness(shape, belt, nodes, taut, places, twist, share)
    entry, leave = cell[:, :, places.entry - 1], cell[:, :, places.exit]
    more = None
    if press is not None:
        more = jnp.zeros((shape.lines, 3, shape.stations)).at[:, 1].set(press.stiffness).reshape(size, -1)
    levels = factorised(*spans_blocks(shape, whole, places, more))
    pulls = jnp.zeros((size, 2, shape.stations))
    pulls = pulls.at[:, :, places.entry - 1].add(-entry[:size, size:] @ moves[0])
    pulls = pulls.at[:, :, places.exit + 1].add(-leave[size:, :size] @ moves[1])
    return Stiffness(levels, entry, leave, pulls, moves)


def corrected(belt: Belt, stiffness: Stiffness, on_nodes: Array, places: Places, lacking: Array) -> tuple[Array, Array]:
    """Moves of the free nodes (3 m, n) [m] and of the tail pulley (2,) [m, rad] towards equilibrium.

    lacking (2,): force [N] and moment [N m] on the tail pulley, which are to become 0.
    """
    size, moves = on_nodes.shape[0], stiffness.moves
    wanted = jnp.where(places.free, on_nodes, 0.0)[:, None]
    found = solved(stiffness.levels, jnp.concatenate([wanted, stiffness.pulls], axis=1))
    entry = stiffness.entry[size:, :size] @ found[..., places.entry - 1]
    leave = stiffness.exit[:size, size:] @ found[..., places.exit + 1]
    felt = -jnp.stack([entry, leave])  # by the tail's outermost stations: alone, with its slide, with its spin
    own = -jnp.stack([stiffness.entry[size:, size:] @ moves[0], stiffness.exit[:size, :size] @ moves[1]])
    lacking = lacking + jnp.einsum("eip,ei->p", moves, felt[..., 0])
    (a, b), (c, d) = jnp.einsum("eip,eiq->pq", moves, felt[..., 1:] + own)
    fixed = belt.length
    a, b, first = jnp.where(fixed > 0, 1.0, a), jnp.where(fixed > 0, 0.0, b), jnp.where(fixed > 0, 0.0, lacking[0])
    tail = -jnp.stack([d * first - b * lacking[1], a * lacking[1] - c * first]) / (a * d - b * c)
    return found[:, 0] + jnp.einsum("ipn,p->in", found[:, 1:], tail), tail
