"""Static equilibrium of the spans between held stations, with the tail pulley on its slide and its free axis.

One factorisation of the block-tridiagonal stiffness, then a few corrections with it. The chain of blocks is the whole
loop, cut in the middle of the head's wrap; rows of held stations are unit blocks, which part the spans.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from belt_sim.pytree import Numbers as Array
from belt_sim.quasi_static.belt import Belt, Shape
from belt_sim.quasi_static.blocks import Level, factorised, solved
from belt_sim.quasi_static.elastic import stretched, twisted
from belt_sim.quasi_static.guides import Press
from belt_sim.quasi_static.wrap import FIRST, HEAD, LAST, TAIL, Wrap


class Places(NamedTuple):
    """Of the chain: numbers of its stations (n,), which of them are free and which lie on the tail pulley (n,), and
    the places of the outermost stations held, by pulley and end (2, 2)."""

    stations: Array
    free: Array
    on_tail: Array
    ends: Array

    @property
    def entry(self) -> Array:
        """Place of the tail's first station."""
        return self.ends[TAIL, FIRST]

    @property
    def exit(self) -> Array:
        """Place of the tail's last station."""
        return self.ends[TAIL, LAST]


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


def chain(shape: Shape, wraps: Wrap) -> Places:
    """The loop cut in the middle of the head's wrap."""
    start = (wraps.first[HEAD] + wraps.last[HEAD]) // 2
    return parted(shape, wraps, (start + jnp.arange(shape.stations)) % shape.stations)


def parted(shape: Shape, wraps: Wrap, stations: Array) -> Places:
    """The chain of these stations, which begins within the head's wrap, as the wraps part it."""
    at = jnp.arange(shape.stations)
    ends = jnp.stack([wraps.first - stations[0], wraps.last - stations[0]], axis=1) % shape.stations
    (before_head, after_head), (entry, leaves) = ends
    free = ((at > after_head) & (at < entry)) | ((at > leaves) & (at < before_head))
    return Places(stations, free, (at >= entry) & (at <= leaves), ends)


def torsion(belt: Belt, behind: Array, places: Places, tension: Array) -> Array:
    """Stiffness of the couples of each cell [N/m], (n,); behind [m], (2, 2): how far the outermost stations lie behind
    the tangent points, by pulley and end."""
    whole = tension * belt.twist.tense + belt.twist.still
    stiffness = jnp.full(len(places.stations), whole - tension * belt.twist.own)
    behind = jnp.clip(behind, -0.5 * belt.chord, 0.5 * belt.chord)
    seems = whole * (belt.chord / (belt.chord - behind) - 1.0)
    for pulley in (HEAD, TAIL):
        stiffness = stiffness.at[places.ends[pulley, FIRST] - 1].add(seems[pulley, FIRST])
        stiffness = stiffness.at[places.ends[pulley, LAST]].add(seems[pulley, LAST])
    return stiffness


def forces(shape: Shape, belt: Belt, nodes: Array, places: Places, twist: Array, share: Array) -> tuple[Array, Array]:
    """On all nodes of the chain [N], (3 m, n), and those of the spans' stretch on the outermost stations held.

    The latter by pulley and end (2, 2, 3 m). nodes [m], (m, 3, n); twist [N/m], (n,).
    """
    size = 3 * shape.lines
    cell = stretched(belt.ties, shape.bonds, nodes, places.stations, share).slope
    both = cell + twisted(nodes, twist, belt.twist.stretched, curved=False).slope
    down = jnp.zeros((shape.lines, 3)).at[:, 2].set(-belt.mass * belt.gravity).reshape(size, 1)
    on_nodes = down - both[:size] - jnp.roll(both[size:], 1, axis=-1)
    first, last = cell[size:, places.ends[:, FIRST] - 1], cell[:size, places.ends[:, LAST]]
    return on_nodes, -jnp.stack([first, last]).transpose(2, 0, 1)


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
    cell = stretched(belt.ties, shape.bonds, nodes, places.stations, share, taut=taut).curvature
    assert cell is not None
    entry, leave = cell[:, :, places.entry - 1], cell[:, :, places.exit]
    couple = twisted(nodes, twist, belt.twist.stretched, curved=True).curvature
    cell = cell + couple
    free = places.free
    diagonal = cell[:size, :size] + jnp.roll(cell[size:, size:], 1, axis=-1)
    if press is not None:
        rows = 1 + 3 * np.arange(shape.lines)
        diagonal = diagonal.at[rows, rows].add(press.stiffness)
    unit = jnp.eye(size)[:, :, None]
    diagonal = jnp.where(free, diagonal, unit)
    beside = jnp.where(free & jnp.roll(free, -1), cell[:size, size:], 0.0)
    levels = factorised(diagonal, beside)
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
