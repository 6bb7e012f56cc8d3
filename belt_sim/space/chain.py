"""The belt as a chain of stations, cut open in the middle of the head's wrap: what is free, what pulls, how stiffly."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Numbers as Array
from belt_sim.space.belt import BeltArrays
from belt_sim.space.elastic import stretch_energy, twist_energy
from belt_sim.space.options import FURTHEST_KINK, KINK_STATIONS
from belt_sim.space.wrap import (
    FIRST,
    HEAD,
    LAST,
    OUTWARDS,
    TAIL,
    BeltOnPulley,
    PoseArrays,
    WrapArrays,
    anchor_places,
    cylinder_coordinates,
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
    diagonal = cell[:size, :size] + jnp.roll(cell[size:, size:], 1, axis=-1)
    if more is not None:
        diagonal = diagonal + np.eye(size)[:, :, None] * more[:, None]
    diagonal = jnp.where(free, diagonal, jnp.eye(size)[:, :, None])
    return diagonal, jnp.where(free & jnp.roll(free, -1), cell[:size, size:], 0.0)


def pull_on_nodes(belt: BeltArrays, nodes: Array, share: Array) -> Array:
    """Forces of belt and weight [N] on nodes at ``nodes`` [m], both (m, 3, n) by stations' numbers."""
    size, stations = 3 * len(nodes), jnp.arange(nodes.shape[-1])
    cell = stretch_energy(belt.ties, belt.shape.bonds, nodes, stations, share).slope
    pull = -(cell[:size] + jnp.roll(cell[size:], 1, axis=-1)).reshape(nodes.shape)
    return pull - (belt.mass * belt.gravity)[:, None, None] * np.array([[0.0], [0.0], [1.0]])


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


# How a belt without bending stiffness meets and leaves a pulley between two stations, and what damps its sway.
#
# Where such a belt runs off it has a kink, from the direction of the stations that lie on the pulley to that of the
# span. If the span simply began at the last station held, each release would let its beginning jump by kink x chord
# (10-18 um at 25 mm and a yaw of 0.042 deg). The spans of a limp belt ring with these jumps, and as the stations land
# in step with them, each landing catches the same phase: the rate of drift comes out wrong by as much as a fifth. So
# the span of a limp belt begins at the tangent point: the last station held stands on the straight line through the
# tangent point and the first free station.
#
# At the run-up a yaw step makes such a kink. The belt on the pulley turns with it, and the span goes on from the
# tangent point, which does not move. The outermost station held is up to half a chord before or behind that point and
# the pulley would take it aside by yaw x this distance, and the span with it (15 um at 40 mm), for a span length of
# travel. Before the tangent point a station belongs to the span and is not taken along; behind it, it is, but the
# span's line goes through the tangent point until the next station lands.
#
# Belts with bending stiffness have no kink and need none of this.


def run_up_end(sign: int) -> int:
    """The end of a wrap at which a belt comes that travels along (+1) or against (-1) station numbers."""
    return FIRST if sign > 0 else LAST


def run_off_end(sign: int) -> int:
    """The end of a wrap at which it leaves."""
    return run_up_end(-sign)


class RopeKinks(NamedTuple):
    """At the run-up of a pulley: station, the number of the one that met the pulley last; yaw [rad]; offset [m]: how
    far the pulley would have taken the span's line since that station landed."""

    station: Array
    yaw: Array
    offset: Array

    @staticmethod
    def from_wrap(wrap: WrapArrays, sign: int) -> "RopeKinks":
        """Of a belt laid on a pulley that is square to it."""
        return RopeKinks(wrap.outer(run_up_end(sign)), 0.0 * wrap.tangent[..., 0], 0.0 * wrap.tangent[..., 0])


def hold_run_up_end(pulley: BeltOnPulley, kink: RopeKinks, sign: int) -> tuple[WrapArrays, RopeKinks]:
    """Before a step: the span's end stays at the tangent point while the pulley at its run-up is yawed."""
    wrap, pose = pulley.wrap, pulley.pose
    end = run_up_end(sign)
    outer, yaw = wrap.outer(end), jnp.arctan2(-pose.axes[0, 1], pose.axes[1, 1])
    inside = outer_depth(pulley, end)
    ahead = -OUTWARDS[end] * inside * jnp.cos(wrap.tangent[end])  # along x
    taken = (yaw - kink.yaw) * ahead
    offset = jnp.where(outer == kink.station, kink.offset, 0.0) + jnp.where(inside < 0.0, 0.0, taken)
    k = outer % wrap.y.shape[-1]
    wrap = wrap._replace(y=wrap.y.at[:, k].add(jnp.where(inside < 0.0, -taken, 0.0)))
    return wrap, RopeKinks(outer, yaw, offset)


def run_off_line(
    wrap: WrapArrays, pose: PoseArrays, sign: int, free: Array, far: Array, chord: Array
) -> tuple[Array, Array]:
    """How far the last nodes held stand aside of their anchors [m], and the slope of y there against the travel, (m,).

    free [m], (m, 3): first free nodes; far [m], (m, 3): nodes further along the span, to which it runs straight.
    """
    n = wrap.y.shape[-1]
    last = wrap.outer(run_off_end(sign))
    k, landed = last % n, (last - sign) % n
    r, y, angle = wrap.r[:, k], wrap.y[:, k], wrap.angle[:, k]
    slope = (wrap.y[:, landed] - y) / chord
    r_far, _, angle_far = cylinder_coordinates(far, pose)
    ahead = r_far * jnp.sin(sign * (angle_far - angle))
    beyond = r * jnp.arctan2(r_far * jnp.cos(angle_far - angle) - r, ahead)
    beyond = jnp.clip(beyond, -FURTHEST_KINK * chord, FURTHEST_KINK * chord)  # of the tangent point
    tangent, y_free = y + slope * beyond, cylinder_coordinates(free, pose)[1]
    return tangent + (y_free - tangent) * beyond / (beyond + chord) - y, slope


def end_offsets(
    belt: BeltArrays, pulleys: BeltOnPulley, places: ChainLayout, taut: Array, moved: Array | float, kinks: RopeKinks
) -> tuple[Array, Array]:
    """By how much held stations of the chain of a limp belt stand aside of their anchors [m], shape (m, 3, n), and the
    slopes of y against the travel at the run-offs of head and tail, (2, m).

    taut [m], (m, 3, n): the chain in its last equilibrium; moved [1]: chords that it has been led on since.
    """
    sign, found, slopes = belt.shape.sign, jnp.zeros_like(taut), []
    for which in (HEAD, TAIL):
        pulley, kink = jax.tree.map(lambda values, which=which: values[which], (pulleys, kinks))
        wrap, pose = pulley.wrap, pulley.pose
        last, first = places.ends[which, run_off_end(sign)], places.ends[which, run_up_end(sign)]
        free, next_free, far = (taut[..., last + i * sign] for i in (1, 2, KINK_STATIONS))
        move, slope = run_off_line(wrap, pose, sign, free + moved * (next_free - free), far, belt.chord)
        found = found.at[..., last].add(move[:, None] * pose.axes[:, 1])
        found = found.at[..., first].add(-kink.offset * pose.axes[:, 1])
        slopes.append(slope)
    return found, jnp.stack(slopes)


def sway_drag(
    belt: BeltArrays, places: ChainLayout, y: Array, slopes: Array, landed: Array, speed: Array, damping: Array
) -> Array:
    """What is added to the drag of a limp belt's slides across the travel, (m, n) [N], so that it acts on waves only.

    It is drag times the sideways speed of a straight span, which is linear between its ends: at the tangent point
    (theta its direction) that is v (theta + slope), at the run-up it is the pulley's.

    y [m], (m, n): of the chain; slopes: of ``end_offsets``; landed [m/s], (m, n): speed of the held stations; speed
    [m/s] of the belt; damping [1/s].
    """
    sign, n, forces = belt.shape.sign, y.shape[-1], jnp.zeros_like(y)
    for begins, ends in ((HEAD, TAIL), (TAIL, HEAD)):
        first, last = places.ends[begins, run_off_end(sign)], places.ends[ends, run_up_end(sign)]
        links, link = sign * (last - first) % n, sign * (jnp.arange(n) - first) % n
        theta = (y[:, last] - y[:, (first + sign) % n]) / (belt.chord * (links - 1))
        at_run_off = speed * (theta + slopes[begins])
        speeds = at_run_off[:, None] + (landed[:, last] - at_run_off)[:, None] * link / links
        forces += jnp.where((link > 0) & (link < links), damping * belt.mass[:, None] * speeds, 0.0)
    return jnp.where(speed == 0.0, 0.0, forces)
