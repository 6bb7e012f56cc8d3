"""The belt as a chain of stations, cut open in the middle of the head's wrap: what is free, what pulls, how stiffly."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Numbers as Array
from belt_sim.space.belt import BeltArrays
from belt_sim.space.elastic import stretch_energy, twist_energy
from belt_sim.space.wrap import (
    FIRST,
    HEAD,
    LAST,
    TAIL,
    BeltOnPulley,
    PoseArrays,
    WrapArrays,
    anchor_places,
    layer_displacements,
    outer_depth,
)


class ChainLayout(NamedTuple):
    """Of the chain: numbers of its stations (n,), which of them are free and which lie on the tail pulley (n,), and
    the places of the outermost stations held, by pulley and end (2, 2)."""

    stations: Array
    free: Array
    on_tail: Array
    ends: Array


def cut_chain(wraps: WrapArrays) -> ChainLayout:
    """The loop cut in the middle of the head's wrap."""
    start, n = (wraps.first[HEAD] + wraps.last[HEAD]) // 2, wraps.r.shape[-1]
    return divide_chain(wraps, (start + jnp.arange(n)) % n)


def divide_chain(wraps: WrapArrays, stations: Array) -> ChainLayout:
    """The chain of these stations, which begins within the head's wrap, as the wraps part it."""
    at = jnp.arange(len(stations))
    ends = jnp.stack([wraps.first - stations[0], wraps.last - stations[0]], axis=1) % len(stations)
    (before_head, after_head), (entry, leaves) = ends
    free = ((at > after_head) & (at < entry)) | ((at > leaves) & (at < before_head))
    return ChainLayout(stations, free, (at >= entry) & (at <= leaves), ends)


def anchor_positions(belt: BeltArrays, pulleys: BeltOnPulley, places: ChainLayout) -> Array:
    """Where the chain's stations are held by the pulley that holds them [m], (m, 3, n); of free ones it says nothing.

    Reckoned once a station and not for both pulleys: sines are what a step is slow at.
    """

    def by_pulley(values: Array) -> Array:
        return jnp.where(places.on_tail, values[TAIL], values[HEAD])

    wraps, pose = pulleys.wrap, pulleys.pose
    r, y, angle = (by_pulley(v[..., places.stations]) for v in (wraps.r, wraps.y, wraps.angle))
    turned, axes = angle + by_pulley(pose.spin[:, None]), by_pulley(pose.axes[..., None])
    found = anchor_places(r, y, turned, axes, by_pulley(pose.centre[..., None]), by_pulley(pose.bow[:, None]))
    if pulleys.layer is None:
        return found
    return found + by_pulley(jax.vmap(partial(layer_displacements, belt, k=places.stations))(pulleys))


def chain_forces(
    belt: BeltArrays, nodes: Array, places: ChainLayout, twist: Array, share: Array
) -> tuple[Array, Array]:
    """Elastic forces on all nodes of the chain [N], (3 m, n), and those of the spans' stretch on the outermost stations
    held, by pulley and end (2, 2, 3 m).

    nodes [m], (m, 3, n); twist [N/m], (n,): of ``torsion``.
    """
    size = 3 * len(nodes)
    cell = stretch_energy(belt.ties, belt.shape.bonds, nodes, places.stations, share).slope
    on_nodes = -cell[:size] - jnp.roll(cell[size:], 1, axis=-1)
    if len(nodes) > 1:
        on_nodes += twist_on_nodes(belt, nodes, twist).reshape(size, -1)
    first, last = cell[size:, places.ends[:, FIRST] - 1], cell[:size, places.ends[:, LAST]]
    return on_nodes, -jnp.stack([first, last]).transpose(2, 0, 1)


def twist_on_nodes(belt: BeltArrays, nodes: Array, twist: Array) -> Array:
    """Forces [N] of the couples of torsion on nodes [m] of the chain, both (m, 3, n)."""
    cell, size = twist_energy(nodes, twist, belt.twist.cubic).slope, 3 * len(nodes)
    return -(cell[:size] + jnp.roll(cell[size:], 1, axis=-1)).reshape(nodes.shape)


def chain_stiffness(
    belt: BeltArrays, nodes: Array, taut: Array, places: ChainLayout, twist: Array, share: Array
) -> tuple[Array, Array]:
    """Curvature of the cells' energy at ``nodes`` [N/m], (6 m, 6 m, n): of stretch alone, and with the torsion.

    taut [m], like nodes: places whose tension stiffens the belt across its direction.
    """
    cell = stretch_energy(belt.ties, belt.shape.bonds, nodes, places.stations, share, taut=taut).curvature
    assert cell is not None
    if len(nodes) == 1:
        return cell, cell
    couple = twist_energy(nodes, twist, belt.twist.cubic).curvature
    return cell, cell + couple


def spans_blocks(cell: Array, places: ChainLayout, more: Array | None = None) -> tuple[Array, Array]:
    """Blocks of the chain (3 m, 3 m, n): its diagonal and those on the next station, held stations as unit blocks.

    cell (6 m, 6 m, n): stiffness of the cells [N/m]; more [N/m], (3 m, n): what is added on the diagonal.
    """
    size, free = len(cell) // 2, places.free
    rows = np.arange(size)
    diagonal = cell[:size, :size] + jnp.roll(cell[size:, size:], 1, axis=-1)
    if more is not None:
        diagonal = diagonal.at[rows, rows].add(more)
    diagonal = jnp.where(free, diagonal, jnp.eye(size)[:, :, None])
    return diagonal, jnp.where(free & jnp.roll(free, -1), cell[:size, size:], 0.0)


def pull_on_nodes(belt: BeltArrays, nodes: Array, share: Array) -> Array:
    """Forces of belt and weight [N] on nodes at ``nodes`` [m], both (m, 3, n) by stations' numbers."""
    size, stations = 3 * len(nodes), jnp.arange(nodes.shape[-1])
    cell = stretch_energy(belt.ties, belt.shape.bonds, nodes, stations, share).slope
    pull = -(cell[:size] + jnp.roll(cell[size:], 1, axis=-1)).reshape(nodes.shape)
    return pull.at[:, 2].add(-belt.mass[:, None] * belt.gravity)


def twist_of_cells(belt: BeltArrays, pulleys: BeltOnPulley, places: ChainLayout, tension: Array) -> Array:
    """Stiffness of the couples on the sections of the chain [N/m], (n,), at a tension [N]; see TwistStiffness."""
    behind = jnp.stack([jax.vmap(partial(outer_depth, end=end))(pulleys) for end in (FIRST, LAST)], axis=1)
    return belt.twist.of_cells(belt.chord, places.ends, behind, tension, len(places.stations))


def tail_derivatives(wraps: WrapArrays, pose: PoseArrays) -> Array:
    """How the tail's outermost stations move with its slide and its spin, (2, 3 m, 2)."""
    wrap, at = (jax.tree.map(lambda v: v[TAIL], tree) for tree in (wraps, pose))
    along, ends = jnp.tile(jnp.array([1.0, 0.0, 0.0]), len(wrap.r)), []
    for outer in (wrap.first, wrap.last):
        k = outer % wrap.r.shape[-1]
        turned, r = wrap.angle[:, k] + at.spin, wrap.r[:, k]
        local = jnp.stack([r * jnp.cos(turned), jnp.zeros_like(r), -r * jnp.sin(turned)], axis=1)
        ends.append(jnp.stack([along, (local @ at.axes.T).ravel()], axis=1))
    return jnp.stack(ends)


def loads_on_tail(
    belt: BeltArrays, nodes: Array, places: ChainLayout, pose: PoseArrays, moves: Array, at_ends: Array
) -> Array:
    """Force along x [N] and moment about its axis [N m] by belt and weight on the tail pulley, (2,).

    nodes [m], (m, 3, n): the chain; moves: ``tail_derivatives``; at_ends: as of ``chain_forces``.
    """
    arms = jnp.where(places.on_tail, nodes[:, 0] - pose.centre[TAIL, 0], 0.0).sum(axis=1)
    return jnp.einsum("eip,ei->p", moves, at_ends[TAIL]).at[1].add(belt.gravity * (belt.mass @ arms))
