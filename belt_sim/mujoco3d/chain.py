"""The belt as a chain of stations, cut open in the middle of the head's wrap: what is free, what pulls, how stiffly."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.mujoco3d.belt import BatchShape, BeltArrays
from belt_sim.mujoco3d.elastic import stretch_energy, twist_energy
from belt_sim.mujoco3d.wrap import (
    FIRST,
    HEAD,
    LAST,
    TAIL,
    PoseArrays,
    WrapArrays,
    anchor_places,
    layer_displacements,
)
from belt_sim.pytrees import Numbers as Array


class ChainLayout(NamedTuple):
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


def cut_chain(shape: BatchShape, wraps: WrapArrays) -> ChainLayout:
    """The loop cut in the middle of the head's wrap."""
    start = (wraps.first[HEAD] + wraps.last[HEAD]) // 2
    return divide_chain(shape, wraps, (start + jnp.arange(shape.stations)) % shape.stations)


def divide_chain(shape: BatchShape, wraps: WrapArrays, stations: Array) -> ChainLayout:
    """The chain of these stations, which begins within the head's wrap, as the wraps part it."""
    at = jnp.arange(shape.stations)
    ends = jnp.stack([wraps.first - stations[0], wraps.last - stations[0]], axis=1) % shape.stations
    (before_head, after_head), (entry, leaves) = ends
    free = ((at > after_head) & (at < entry)) | ((at > leaves) & (at < before_head))
    return ChainLayout(stations, free, (at >= entry) & (at <= leaves), ends)


def anchor_positions(
    belt: BeltArrays, wraps: WrapArrays, pose: PoseArrays, layer: Array | None, places: ChainLayout
) -> Array:
    """Where the chain's stations are held by the pulley that holds them [m], (m, 3, n); of free ones it says nothing.

    Reckoned once a station and not for both pulleys: sines are what a step is slow at.
    """

    def by_pulley(values: Array) -> Array:
        return jnp.where(places.on_tail, values[TAIL], values[HEAD])

    r, y, angle = (by_pulley(v[..., places.stations]) for v in (wraps.r, wraps.y, wraps.angle))
    turned, axes = angle + by_pulley(pose.spin[:, None]), by_pulley(pose.axes[..., None])
    found = anchor_places(r, y, turned, axes, by_pulley(pose.centre[..., None]))
    if layer is None:
        return found
    displaced = partial(layer_displacements, belt, k=places.stations)
    moved = jax.vmap(displaced)(wraps, belt.surfaces, pose, layer)
    return found + by_pulley(moved)


def chain_forces(
    shape: BatchShape, belt: BeltArrays, nodes: Array, places: ChainLayout, twist: Array, share: Array
) -> tuple[Array, Array]:
    """Elastic forces on all nodes of the chain [N], (3 m, n), and those of the spans' stretch on the outermost stations
    held, by pulley and end (2, 2, 3 m).

    nodes [m], (m, 3, n); twist [N/m], (n,): of ``torsion``.
    """
    size = 3 * shape.lines
    cell = stretch_energy(belt.ties, shape.bonds, nodes, places.stations, share).slope
    both = cell
    if shape.lines > 1:
        both = cell + twist_energy(nodes, twist, belt.twist.cubic, curved=False).slope
    on_nodes = -both[:size] - jnp.roll(both[size:], 1, axis=-1)
    first, last = cell[size:, places.ends[:, FIRST] - 1], cell[:size, places.ends[:, LAST]]
    return on_nodes, -jnp.stack([first, last]).transpose(2, 0, 1)


def station_weight(shape: BatchShape, belt: BeltArrays) -> Array:
    """Of the nodes of a station [N], (3 m, 1)."""
    return jnp.zeros((shape.lines, 3)).at[:, 2].set(-belt.mass * belt.gravity).reshape(3 * shape.lines, 1)


def chain_stiffness(
    shape: BatchShape, belt: BeltArrays, nodes: Array, taut: Array, places: ChainLayout, twist: Array, share: Array
) -> tuple[Array, Array]:
    """Curvature of the cells' energy at ``nodes`` [N/m], (6 m, 6 m, n): of stretch alone, and with the torsion.

    taut [m], like nodes: places whose tension stiffens the belt across its direction.
    """
    cell = stretch_energy(belt.ties, shape.bonds, nodes, places.stations, share, taut=taut).curvature
    assert cell is not None
    if shape.lines == 1:
        return cell, cell
    couple = twist_energy(nodes, twist, belt.twist.cubic, curved=True).curvature
    return cell, cell + couple


def spans_blocks(shape: BatchShape, cell: Array, places: ChainLayout, more: Array | None = None) -> tuple[Array, Array]:
    """Blocks of the chain (3 m, 3 m, n): its diagonal and those on the next station, held stations as unit blocks.

    cell (6 m, 6 m, n): stiffness of the cells [N/m]; more [N/m], (3 m, n): what is added on the diagonal.
    """
    size, rows, free = 3 * shape.lines, np.arange(3 * shape.lines), places.free
    diagonal = cell[:size, :size] + jnp.roll(cell[size:, size:], 1, axis=-1)
    if more is not None:
        diagonal = diagonal.at[rows, rows].add(more)
    diagonal = jnp.where(free, diagonal, jnp.eye(size)[:, :, None])
    return diagonal, jnp.where(free & jnp.roll(free, -1), cell[:size, size:], 0.0)


def pull_on_nodes(shape: BatchShape, belt: BeltArrays, nodes: Array, share: Array) -> Array:
    """Forces of belt and weight [N] on nodes at ``nodes`` [m], both (m, 3, n) by stations' numbers."""
    size = 3 * shape.lines
    cell = stretch_energy(belt.ties, shape.bonds, nodes, jnp.arange(shape.stations), share).slope
    pull = -(cell[:size] + jnp.roll(cell[size:], 1, axis=-1)).reshape(nodes.shape)
    return pull.at[:, 2].add(-belt.mass[:, None] * belt.gravity)
