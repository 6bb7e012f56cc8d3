"""Stations land on a pulley, sink onto its circle, and leave it.

A polygon that rolls over a circle lifts and lowers its spans with every corner (chordal action, chord^2 / 8 R), and the
waves that this sends along a slack belt swing the entry moment in time with the landings. So a station is caught half a
chord before the place where the belt meets the pulley, runs straight on until half a chord behind it, and sinks onto
the circle along the next four (fewer on a pulley of few stations); it leaves the same way. The free span then always
ends on one straight line. (Sinking faster shakes the belt along its length: by 69 um within one chord of 25 mm, 16 um
within four, 9 um on a plain circle.)

Landing and sinking keep the lengths of the chords, edge by edge: what lies on the pulley is the strain that the belt
had at the run-up, so that the landed belt turns by the run-up curvature (dtheta/ds = -kappa).
"""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.mujoco3d.arrays import library_of, put
from belt_sim.mujoco3d.belt import BeltArrays
from belt_sim.mujoco3d.bending_layer import thread_places
from belt_sim.mujoco3d.loop import chord_angle, lift
from belt_sim.mujoco3d.options import CATCH_DISTANCE, FORGETTING, HYSTERESIS
from belt_sim.mujoco3d.wrap import (
    FIRST,
    LAST,
    OUTWARDS,
    BeltOnPulley,
    PoseArrays,
    WrapArrays,
    cylinder_coordinates,
    depth,
    outer_depth,
    radius_at,
    roll_anchors,
)
from belt_sim.pytrees import Numbers as Array


def is_released(pulley: BeltOnPulley, end: int, chord: Array) -> Array:
    """Whether the outermost station at ``end`` has come far enough to be free."""
    return outer_depth(pulley, end) < -(CATCH_DISTANCE + HYSTERESIS) * chord


class Approach(NamedTuple):
    """A free station and the outermost one held beside it, at one instant: depth [m], (), of the free one behind the
    tangent point; its r, y [m] and material angle [rad], (m,); square [m2], (m,): of its distance from the other."""

    depth: Array
    r: Array
    y: Array
    angle: Array
    square: Array

    def is_caught(self, chord: Array) -> Array:
        """Whether it has come close enough to be held."""
        return self.depth > -CATCH_DISTANCE * chord


def approach_of(belt: BeltArrays, pulley: BeltOnPulley, nodes: Array, end: int) -> Approach:
    """The station next to ``end`` of a belt with nodes [m], (m, 3, n)."""
    pair = thread_places(belt, pulley, nodes, end)
    r, y, angle = cylinder_coordinates(pair[..., 0], pulley.pose)
    behind = depth(pulley, 0.5 * (angle[0] + angle[-1]), end)
    return Approach(behind, r, y, angle, ((pair[..., 0] - pair[..., 1]) ** 2).sum(axis=1))


def land_station(
    pulley: BeltOnPulley, before: Approach, after: Approach, end: int, chord: Array, moved: Array, shaped: Array | float
) -> WrapArrays:
    """With the station next to ``end``, where it has come close enough in the step: at its mean height and at its
    distance from the one landed before, edge by edge.

    before, after: that station at both ends of the step, of ``moved`` [m]. It is caught on the way between them, where
    it comes close enough, as if steps were short; else a slack belt would be as the step catches it, early or late.
    """
    wrap, surface = pulley.wrap, pulley.surface
    xp, outward, outer, n = library_of(wrap.r), OUTWARDS[end], wrap.outer(end), wrap.r.shape[-1]
    k, beside = (outer + outward) % n, outer % n
    lands, nearer = after.is_caught(chord), after.depth - before.depth
    passed = lands & (nearer > 0.0) & (before.depth < -CATCH_DISTANCE * chord)
    left = xp.where(passed, (after.depth + CATCH_DISTANCE * chord) / xp.where(passed, nearer, 1.0), 0.0)
    _, r, y, _, square = (b - left * (b - a) for a, b in zip(before, after, strict=True))
    circle = radius_at(surface, shaped, y)
    high = (r - circle).mean()
    inside = depth(pulley, after.angle.mean(), end) - left * nearer
    forgotten = xp.exp(-left * moved / (FORGETTING * chord))
    lifted = (high - lift(inside, chord, surface.radius, surface.sink_chords)) * forgotten
    turned = chord_angle(square - (y - wrap.y[:, beside]) ** 2, circle + high, wrap.r[:, beside])

    def put_if_landed(values: Array, at: Any, there: Array) -> Array:
        return put(values, at, xp.where(lands, there, values[at]))

    at = (slice(None), k)
    wrap = wrap.with_outer(end, xp.where(lands, outer + outward, outer))
    return wrap._replace(
        landing_lift=put_if_landed(wrap.landing_lift, k, lifted),
        r=put_if_landed(wrap.r, at, circle + high),
        y=put_if_landed(wrap.y, at, y),
        angle=put_if_landed(wrap.angle, at, wrap.angle[:, beside] + outward * turned),
    )


def sink_ends(belt: BeltArrays, pulley: BeltOnPulley, end: int, moved: Array, shaped: Array) -> WrapArrays:
    """The outermost stations at ``end`` on their path for the pulley's present place.

    moved [m]: how far the pulley has turned since the last time.
    """
    wrap, surface = pulley.wrap, pulley.surface
    xp, chord, zone = library_of(wrap.r), belt.chord, belt.shape.zone  # stations that may be off the circle
    outward, n = OUTWARDS[end], wrap.r.shape[-1]
    k = (wrap.outer(end) - outward * np.arange(zone + 1)) % n
    off, r, angle = k[:-1], wrap.r[:, k], wrap.angle[:, k]
    flat = (r[:, 1:] - r[:, :-1]) ** 2 + 4.0 * r[:, 1:] * r[:, :-1] * xp.sin(0.5 * (angle[:, 1:] - angle[:, :-1])) ** 2
    lifted = wrap.landing_lift[off] * xp.exp(-moved / (FORGETTING * chord))
    inside = depth(pulley, 0.5 * (angle[0] + angle[-1])[:-1], end)
    high = lift(inside, chord, surface.radius, surface.sink_chords) + lifted
    r = put(r, (slice(None), slice(zone)), radius_at(surface, shaped, wrap.y[:, off]) + high)
    turned = chord_angle(flat, r[:, :-1], r[:, 1:])
    behind = turned[:, ::-1].cumsum(axis=1)[:, ::-1]
    at = (slice(None), off)
    return wrap._replace(
        landing_lift=put(wrap.landing_lift, off, lifted),
        r=put(wrap.r, at, r[:, :-1]),
        angle=put(wrap.angle, at, angle[:, -1:] + outward * behind),
    )


# Both pulleys at once, compiled.


def sink_wraps(
    belt: BeltArrays, pulleys: BeltOnPulley, before: PoseArrays, moved: Array, shaped: Array, rests: Array
) -> BeltOnPulley:
    """With the stations on pulleys that have come from ``before`` on their paths for where the pulleys are.

    moved [m]: how far the pulleys turn in the step; rests: whether the belt is at rest, which then does not roll with
    an axis that begins to be canted.
    """
    if belt.shape.canted:
        rolled = jnp.where(rests, pulleys.pose.axes[:, 2, 1] - before.axes[:, 2, 1], 0.0)
        pulleys = pulleys._replace(wrap=jax.vmap(roll_anchors)(pulleys, rolled))
    for end in (FIRST, LAST):
        sink = partial(sink_ends, belt, end=end, moved=moved, shaped=shaped)
        pulleys = pulleys._replace(wrap=jax.vmap(sink)(pulleys))
    return pulleys


def release_stations(belt: BeltArrays, pulleys: BeltOnPulley) -> BeltOnPulley:
    """Without the outermost stations, where these have come far enough to be free."""

    def release(pulley: BeltOnPulley, end: int) -> WrapArrays:
        goes = is_released(pulley, end, belt.chord)
        return pulley.wrap.with_outer(end, pulley.wrap.outer(end) - OUTWARDS[end] * goes)

    for end in (FIRST, LAST):
        pulleys = pulleys._replace(wrap=jax.vmap(partial(release, end=end))(pulleys))
    return pulleys


def land_stations(
    belt: BeltArrays, pulleys: BeltOnPulley, before: tuple[PoseArrays, Array], nodes: Array, moved: Array, shaped: Array
) -> BeltOnPulley:
    """With the stations that the pulleys have caught in a step of ``moved`` [m] to ``nodes`` [m], (m, 3, n).

    before: poses and nodes at the step's beginning; shaped: 1 where the pulleys are what they are, 0 while they are
    plain cylinders.
    """

    def land(pulley: BeltOnPulley, old: PoseArrays, end: int) -> WrapArrays:
        was = approach_of(belt, pulley._replace(pose=old), before[1], end)
        return land_station(pulley, was, approach_of(belt, pulley, nodes, end), end, belt.chord, moved, shaped)

    for end in (FIRST, LAST):
        pulleys = pulleys._replace(wrap=jax.vmap(partial(land, end=end))(pulleys, before[0]))
    return pulleys
