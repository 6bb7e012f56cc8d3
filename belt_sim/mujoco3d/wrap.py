"""The belt on a pulley: stations land, sink onto the circle, are held and leave, through a layer that is bent.

Landing. A polygon that rolls over a circle lifts and lowers its spans with every corner (chordal action,
chord^2 / 8 R), and the waves that this sends along a slack belt swing the entry moment in time with the landings. So a
station is caught half a chord before the place where the belt meets the pulley, runs straight on until half a chord
behind it, and sinks onto the circle along the next four (fewer on a pulley of few stations); it leaves the same way.
The free span then always ends on one straight line. (Sinking faster shakes the belt along its length: by 69 um within
one chord of 25 mm, 16 um within four, 9 um on a plain circle.)

Landing and sinking keep the lengths of the chords, edge by edge: what lies on the pulley is the strain that the belt
had at the run-up, so that the landed belt turns by the run-up curvature (dtheta/ds = -kappa).

Bending layer. A fibre under the stress sigma straightens over l = sqrt(D/(sigma h)), D its plate stiffness. So its
straight part passes l^2/2R outside the circle, and has l^3/12R^2 less belt between it and the pulley than a thread
would have; where it comes at a steeper angle than the others, by psi, it is drawn in by (l^2/2R) psi less. Stations
25 mm apart do not resolve a layer of 7-16 mm. It is a condition, therefore: each line of nodes comes and goes displaced
by these two lengths, counted from their mean over the width, with sigma and psi those of its own links beside the
pulley in this instant. How much the belt tilts there follows from the rest of the model.

The forces between belt and pulleys are those that balance the belt's pull where it is (loads.pull_on_nodes), not those
of the springs: the springs also make up for what the integrator's tangent misses of links that turn within a step.
"""

import math
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.mujoco3d.arrays import library_of, put
from belt_sim.mujoco3d.belt import BeltArrays, SurfaceArrays
from belt_sim.mujoco3d.elastic import strains
from belt_sim.mujoco3d.loop import chord_angle, fade, lift
from belt_sim.mujoco3d.options import CATCH_DISTANCE, FORGETTING, HYSTERESIS, RUNUP_LINKS, SLACKEST_FIBRE, SPAN_STATIONS
from belt_sim.pytrees import Numbers as Array

HEAD, TAIL = 0, 1
FIRST, LAST = 0, 1  # ends of a wrap
OUTWARDS = (-1, 1)  # along station numbers


class PoseArrays(NamedTuple):
    """Where a pulley is: centre [m], (3,); axes (3, 3), pulley frame to world; spin [rad]."""

    centre: Array
    axes: Array
    spin: Array


class WrapArrays(NamedTuple):
    """The stations that lie on a pulley: consecutive numbers first..last (modulo n), and their anchors.

    Anchors are cylinder coordinates in the spinning pulley: r, y [m], angle [rad] from the top towards +x, shape
    (m, n), valid for held stations only; landing_lift [m], (n,): how much higher than its path a station was caught;
    tangent [rad], (2,): where the belt meets the pulley, at ``first`` and at ``last``, from the top towards +x and not
    turning.
    """

    first: Array
    last: Array
    r: Array
    y: Array
    angle: Array
    landing_lift: Array
    tangent: Array


def wrapped_angle(angle: Array) -> Array:
    """The same direction between -pi and pi [rad]."""
    return angle - math.tau * library_of(angle).rint(angle / math.tau)


def axes_of(surface: SurfaceArrays, yaw: Array, share: Array, spin: Array, askew: Array | float = 1.0) -> Array:
    """Rotation (3, 3) from a pulley's frame (y along its axis, not spinning) to the world.

    yaw [rad]: commanded, and by compliance; share: how much of yaw offset and cant acts (0 before travel 0, where the
    machine is aligned); spin [rad]; askew: how much of the wobble acts (all of it, but while the belt is being laid).
    """
    phase, cone = spin + surface.wobble_phase, askew * surface.wobble
    xp = library_of(phase)
    turn = yaw + share * surface.yaw_offset + cone * xp.cos(phase)
    roll = share * surface.cant + cone * xp.sin(phase)
    c, s, cg, sg = xp.cos(turn), xp.sin(turn), xp.cos(roll), xp.sin(roll)
    return xp.array([[c, -s * cg, s * sg], [s, c * cg, -c * sg], [0.0, sg, cg]])


def radius_at(surface: SurfaceArrays, shaped: Array | float, y: Array) -> Array:
    """Radius of a station's circle [m]; shaped: 1 where the pulley is what it is, 0 while it is a plain cylinder."""
    uneven = y * (surface.taper - 0.5 * surface.crown * y)
    return surface.radius + shaped * surface.radius * uneven + surface.extra


def roll_anchors(surface: SurfaceArrays, wrap: WrapArrays, pose: PoseArrays, rolled: Array) -> WrapArrays:
    """The anchors after the axis has rolled by a small angle [rad] under a belt at rest, which does not go with it:
    where a cant begins to act, the belt has been laid straight on the canted pulley."""
    there = wrap.y + rolled * wrap.r * library_of(wrap.r).cos(wrap.angle + pose.spin)
    wider = radius_at(surface, 1.0, there) - radius_at(surface, 1.0, wrap.y)
    return wrap._replace(y=there, r=wrap.r + wider)


def slide_anchors(
    surface: SurfaceArrays, wrap: WrapArrays, shaped: Array | float, k: Array, increment: Array
) -> WrapArrays:
    """The anchors of stations k moved on the surface by slip increments [m], (m, 2, k): along the axis, the turn."""
    y, r = wrap.y[:, k], wrap.r[:, k]
    there = y + increment[:, 0]
    wider = radius_at(surface, shaped, there) - radius_at(surface, shaped, y)
    at = (slice(None), k)
    return wrap._replace(
        y=put(wrap.y, at, there),
        angle=put(wrap.angle, at, wrap.angle[at] + increment[:, 1] / r),
        r=put(wrap.r, at, r + wider),
    )


def surface_components(wrap: WrapArrays, pose: PoseArrays, k: Array, vectors: Array) -> tuple[Array, Array, Array]:
    """Parts (m, k) of world vectors (m, 3, k) at the anchors of stations k: outwards, along the axis, the turn."""
    xp, turned = library_of(vectors), wrap.angle[:, k] + pose.spin
    sin, cos = xp.sin(turned), xp.cos(turned)
    x, y, z = (pose.axes.T @ vectors).swapaxes(0, 1)
    return x * sin + z * cos, y, x * cos - z * sin


def cylinder_coordinates(places: Array, pose: PoseArrays) -> tuple[Array, Array, Array]:
    """r, y [m] and material angle [rad] of places (m, 3, ...), each (m, ...)."""
    xp, shape = library_of(places), (len(places), *places.shape[2:])
    local = pose.axes.T @ (places.reshape(len(places), 3, -1) - pose.centre[:, None])
    x, y, z = (local[:, i].reshape(shape) for i in range(3))
    return xp.sqrt(x * x + z * z), y, xp.arctan2(x, z) - pose.spin


def anchor_places(r: Array, y: Array, turned: Array, axes: Array, centre: Array) -> Array:
    """World places [m], (m, 3, k), of anchors r, y [m] at angles ``turned`` [rad] from the top, each (m, k).

    axes (3, 3, k), centre (3, k): of the pulley of each; k may be 1 there.
    """
    xp = library_of(r)
    local = r * xp.sin(turned), y, r * xp.cos(turned)
    return xp.stack([sum(axes[i, j] * local[j] for j in range(3)) + centre[i] for i in range(3)], axis=1)


def depth(wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, angle: Array, end: int) -> Array:
    """How far behind the belt's tangent at ``end`` stations of material angle ``angle`` [rad] lie [m]."""
    return -OUTWARDS[end] * wrapped_angle(angle + pose.spin - wrap.tangent[end]) * surface.radius


def outer_depth(wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, end: int) -> Array:
    """How far behind the belt's tangent at ``end`` the outermost held station lies [m]."""
    k = (wrap.first, wrap.last)[end] % wrap.r.shape[-1]
    return depth(wrap, surface, pose, 0.5 * (wrap.angle[0, k] + wrap.angle[-1, k]), end)


def sink_ends(
    belt: BeltArrays, wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, end: int, moved: Array, shaped: Array
) -> WrapArrays:
    """The outermost stations at ``end`` on their path for the pulley's present place.

    moved [m]: how far the pulley has turned since the last time.
    """
    xp, chord, zone = library_of(wrap.r), belt.chord, belt.shape.zone  # stations that may be off the circle
    outward, outer, n = OUTWARDS[end], (wrap.first, wrap.last)[end], wrap.r.shape[-1]
    k = (outer - outward * np.arange(zone + 1)) % n
    off, r, angle = k[:-1], wrap.r[:, k], wrap.angle[:, k]
    flat = (r[:, 1:] - r[:, :-1]) ** 2 + 4.0 * r[:, 1:] * r[:, :-1] * xp.sin(0.5 * (angle[:, 1:] - angle[:, :-1])) ** 2
    lifted = wrap.landing_lift[off] * xp.exp(-moved / (FORGETTING * chord))
    inside = depth(wrap, surface, pose, 0.5 * (angle[0] + angle[-1])[:-1], end)
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


def update_tangents(wrap: WrapArrays, pose: PoseArrays, nodes: Array, share: Array | float) -> WrapArrays:
    """The places where the belt meets the pulley, moved by ``share`` of the way to where the spans' directions say.

    nodes [m], (m, 3, n).
    """
    xp, n, tangent = library_of(nodes), nodes.shape[-1], []
    for end, outer in enumerate((wrap.first, wrap.last)):
        inner, beyond = ((outer + i * OUTWARDS[end]) % n for i in (1, SPAN_STATIONS))
        along = (nodes[:, :, beyond] - nodes[:, :, inner]).sum(axis=0) * OUTWARDS[end]
        local = along @ pose.axes
        ahead = xp.arctan2(-local[2], local[0]) - wrap.tangent[end]
        tangent.append(wrap.tangent[end] + share * wrapped_angle(ahead))
    return wrap._replace(tangent=xp.stack(tangent))


def is_released(wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, end: int, chord: Array) -> Array:
    """Whether the outermost station at ``end`` has come far enough to be free."""
    return outer_depth(wrap, surface, pose, end) < -(CATCH_DISTANCE + HYSTERESIS) * chord


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


def approach_of(
    belt: BeltArrays, wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, layer: Array, nodes: Array, end: int
) -> Approach:
    """The station next to ``end`` of a belt with nodes [m], (m, 3, n)."""
    pair = thread_places(belt, wrap, surface, pose, layer, nodes, end)
    r, y, angle = cylinder_coordinates(pair[..., 0], pose)
    behind = depth(wrap, surface, pose, 0.5 * (angle[0] + angle[-1]), end)
    return Approach(behind, r, y, angle, ((pair[..., 0] - pair[..., 1]) ** 2).sum(axis=1))


def land_station(
    wrap: WrapArrays,
    surface: SurfaceArrays,
    pose: PoseArrays,
    before: Approach,
    after: Approach,
    end: int,
    chord: Array,
    moved: Array,
    shaped: Array | float,
) -> WrapArrays:
    """With the station next to ``end``, where it has come close enough in the step: at its mean height and at its
    distance from the one landed before, edge by edge.

    before, after: that station at both ends of the step, of ``moved`` [m]. It is caught on the way between them, where
    it comes close enough, as if steps were short; else a slack belt would be as the step catches it, early or late.
    """
    xp, outward, n = library_of(wrap.r), OUTWARDS[end], wrap.r.shape[-1]
    outer = (wrap.first, wrap.last)[end]
    k, beside = (outer + outward) % n, outer % n
    lands, nearer = after.is_caught(chord), after.depth - before.depth
    passed = lands & (nearer > 0.0) & (before.depth < -CATCH_DISTANCE * chord)
    left = xp.where(passed, (after.depth + CATCH_DISTANCE * chord) / xp.where(passed, nearer, 1.0), 0.0)
    _, r, y, _, square = (b - left * (b - a) for a, b in zip(before, after, strict=True))
    circle = radius_at(surface, shaped, y)
    high = (r - circle).mean()
    inside = depth(wrap, surface, pose, after.angle.mean(), end) - left * nearer
    forgotten = xp.exp(-left * moved / (FORGETTING * chord))
    lifted = (high - lift(inside, chord, surface.radius, surface.sink_chords)) * forgotten
    turned = chord_angle(square - (y - wrap.y[:, beside]) ** 2, circle + high, wrap.r[:, beside])
    new = {"r": circle + high, "y": y, "angle": wrap.angle[:, beside] + outward * turned}

    def if_landed(there: Array, here: Array) -> Array:
        return xp.where(lands, there, here)

    at = (slice(None), k)
    anchors = {f: put(v := getattr(wrap, f), at, if_landed(new[f], v[at])) for f in new}
    heights = put(wrap.landing_lift, k, if_landed(lifted, wrap.landing_lift[k]))
    return wrap._replace(landing_lift=heights, **anchors, **{("first", "last")[end]: if_landed(outer + outward, outer)})


# The bending layer. Its displacements [m], (2, m, 2): how far the lines are displaced outwards and into the pulley at
# ``first`` and at ``last``; the anchors of a wrap are those without it.

_AHEAD = 2.0  # chords before the tangent point: what lies further is on the other side of the pulley


def layer_of_fibres(
    belt: BeltArrays, share: Array | float, nodes: Array, wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays
) -> Array:
    """Displacements (2, m, 2) [m] that the fibres beside a pulley lead to; share: of the layer and of the camber."""
    ends = [line_displacements(belt, share, nodes, wrap, surface.radius, pose, end) for end in (FIRST, LAST)]
    return share * library_of(nodes).stack(ends)


def line_displacements(
    belt: BeltArrays, share: Array | float, nodes: Array, wrap: WrapArrays, radius: Array, pose: PoseArrays, end: int
) -> Array:
    """How far the lines are outside the circle, and drawn into the pulley, beyond their mean [m], (m, 2).

    nodes [m], (m, 3, n); share: of the camber; radius [m].
    """
    xp, fibres, n = library_of(nodes), belt.fibres, nodes.shape[-1]
    assert fibres is not None
    begin = wrap.first - 1 - RUNUP_LINKS if end == FIRST else wrap.last + 1
    k = (begin + np.arange(RUNUP_LINKS + 1)) % n
    strain = strains(belt.ties, nodes, k, share) - fibres.residual
    stress = fibres.modulus * xp.maximum(strain, SLACKEST_FIBRE * xp.maximum(strain.mean(), 1e-12))
    local = (nodes[:, :, k[-1]] - nodes[:, :, k[0]]) @ pose.axes
    steeper = OUTWARDS[end] * wrapped_angle(xp.arctan2(-local[:, 2], local[:, 0]) - wrap.tangent[end])
    layer = xp.sqrt(fibres.plate / (stress * fibres.thickness))
    out = layer**2 / (2.0 * radius)
    drawn = layer**3 / (12.0 * radius**2) - out.mean() * (steeper - steeper.mean())
    both = xp.stack([out, drawn], axis=1)
    return fibres.tension_share * (both - both.mean(axis=0))


def station_displacement(
    belt: BeltArrays, wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, layer: Array, inside: Array, end: int
) -> Array:
    """By how much the layer at ``end`` displaces stations ``inside`` [m] behind the tangent point, (k,): (m, 3, k) [m].

    Sections that are drawn in unequally turn, and with them the line that they stand on; wholly on the straight part
    of the path, less along the stations that sink onto the circle.
    """
    line_y, chord, xp = belt.line_y, belt.chord, library_of(inside)
    outward, (out, drawn), at = OUTWARDS[end], layer[end].T, wrap.tangent[end]
    turned = (drawn @ line_y) / (line_y @ line_y)
    fading = xp.where(inside > -_AHEAD * chord, fade(inside, chord, surface.sink_chords), 0.0)
    ones = xp.ones_like(inside)
    x = out * xp.sin(at) - outward * drawn * xp.cos(at)
    z = out * xp.cos(at) + outward * drawn * xp.sin(at)
    aside = xp.broadcast_to(-turned * inside, (len(line_y), *inside.shape))
    local = xp.stack([x[:, None] * ones, aside, z[:, None] * ones], axis=1)
    return xp.einsum("mjk,ij->mik", fading * local, pose.axes)


def layer_displacements(
    belt: BeltArrays, wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, layer: Array, k: Array
) -> Array:
    """By how much the layer displaces the anchors of stations k [m], (m, 3, k); those inside the wrap not at all."""
    angle = wrap.angle[:, k].mean(axis=0)
    first, last = (
        station_displacement(belt, wrap, surface, pose, layer, depth(wrap, surface, pose, angle, end), end)
        for end in (FIRST, LAST)
    )
    return first + last


def thread_places(
    belt: BeltArrays, wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, layer: Array, nodes: Array, end: int
) -> Array:
    """Where the station next to ``end`` and the outermost held one would be without the layer [m], (m, 3, 2)."""
    k = ((wrap.first, wrap.last)[end] + OUTWARDS[end] * np.array([1, 0])) % nodes.shape[-1]
    pair = nodes[:, :, k]
    if layer is None:
        return pair
    angle = cylinder_coordinates(pair, pose)[2].mean(axis=0)
    inside = depth(wrap, surface, pose, angle, end)
    return pair - station_displacement(belt, wrap, surface, pose, layer, inside, end)


# Both pulleys at once, compiled: every leaf of wraps and poses with a leading axis of head and tail.


def sink_wraps(
    belt: BeltArrays, wraps: WrapArrays, poses: tuple[PoseArrays, PoseArrays], moved: Array, shaped: Array, rests: Array
) -> WrapArrays:
    """The stations on the pulleys on their paths for where the pulleys will be.

    poses: at both ends of the step; moved [m]: in the step; rests: whether the belt is at rest, which then does not
    roll with an axis that begins to be canted.
    """
    (before, pose), shape = poses, belt.shape
    if shape.canted:
        rolled = jnp.where(rests, pose.axes[:, 2, 1] - before.axes[:, 2, 1], 0.0)
        wraps = jax.vmap(roll_anchors)(belt.surfaces, wraps, pose, rolled)
    for end in (FIRST, LAST):
        sink = partial(sink_ends, belt, end=end, moved=moved, shaped=shaped)
        wraps = jax.vmap(sink)(wraps, belt.surfaces, pose)
    return wraps


def release_stations(belt: BeltArrays, wraps: WrapArrays, pose: PoseArrays) -> WrapArrays:
    """The wraps without their outermost stations, where these have come far enough to be free."""

    def one(wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, end: int) -> WrapArrays:
        outer, goes = (wrap.first, wrap.last)[end], is_released(wrap, surface, pose, end, belt.chord)
        return wrap._replace(**{("first", "last")[end]: outer - OUTWARDS[end] * goes})

    for end in (FIRST, LAST):
        wraps = jax.vmap(partial(one, end=end))(wraps, belt.surfaces, pose)
    return wraps


def land_stations(
    belt: BeltArrays,
    wraps: WrapArrays,
    before: tuple[PoseArrays, Array],
    after: tuple[PoseArrays, Array],
    layers: Array | None,
    moved: Array,
    shaped: Array,
) -> WrapArrays:
    """The wraps with the stations that they have caught in a step of ``moved`` [m].

    before, after: poses and nodes [m], (m, 3, n), at both ends of the step; shaped: 1 where the pulleys are what they
    are, 0 while they are plain cylinders.
    """

    def one(
        wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, old: PoseArrays, layer: Array | None, end: int
    ) -> WrapArrays:
        was, now = (
            approach_of(belt, wrap, surface, at, layer, nodes, end)
            for at, nodes in ((old, before[1]), (pose, after[1]))
        )
        return land_station(wrap, surface, pose, was, now, end, belt.chord, moved, shaped)

    for end in (FIRST, LAST):
        wraps = jax.vmap(partial(one, end=end))(wraps, belt.surfaces, after[0], before[0], layers)
    return wraps


def relax_layers(
    belt: BeltArrays, layers: Array, wraps: WrapArrays, pose: PoseArrays, nodes: Array, share: Array, rate: Array
) -> Array:
    """Displacements (2, 2, m, 2) [m] moved by ``rate`` of the way to what the fibres beside the pulleys say."""
    wanted = jax.vmap(lambda w, s, p: layer_of_fibres(belt, share, nodes, w, s, p))(wraps, belt.surfaces, pose)
    return layers + rate * (wanted - layers)
