"""How a belt without bending stiffness meets and leaves a pulley between two stations, and what damps its sway.

Where such a belt runs off it has a kink, from the direction of the stations that lie on the pulley to that of the
span. If the span simply began at the last station held, each release would let its beginning jump by kink x chord
(10-18 um at 25 mm and a yaw of 0.042 deg). The spans of a limp belt ring with these jumps, and as the stations land
in step with them, each landing catches the same phase: the rate of drift comes out wrong by as much as a fifth. So
the span of a limp belt begins at the tangent point: the last station held stands on the straight line through the
tangent point and the first free station.

At the run-up a yaw step makes such a kink. The belt on the pulley turns with it, and the span goes on from the
tangent point, which does not move. The outermost station held is up to half a chord before or behind that point and
the pulley would take it aside by yaw x this distance, and the span with it (15 um at 40 mm), for a span length of
travel. Before the tangent point a station belongs to the span and is not taken along; behind it, it is, but the
span's line goes through the tangent point until the next station lands.

Belts with bending stiffness have no kink and need none of this.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from belt_sim.case import Numbers as Array
from belt_sim.space.belt import BeltArrays
from belt_sim.space.chain import ChainLayout
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
    cylinder_coordinates,
    outer_depth,
)


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
