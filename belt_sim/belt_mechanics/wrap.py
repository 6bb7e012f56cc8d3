"""The stations on the pulleys as arrays: the laws of belt_sim.mujoco3d.wrap without branches.

Unless it says otherwise a function is of one pulley. layer [m], (2, m, 2): how far the lines are displaced outwards and
into the pulley by the bending layer, at ``first`` and at ``last``; the anchors of a wrap are those without it.
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp

from belt_sim.belt_mechanics.belt import BatchShape, BeltArrays, SurfaceArrays
from belt_sim.belt_mechanics.elastic import strains
from belt_sim.jax_setup import Numbers as Array
from belt_sim.mujoco3d.options import (
    CATCH_DISTANCE,
    FORGETTING,
    HYSTERESIS,
    RUNUP_LINKS,
    SLACKEST_FIBRE,
    SPAN_STATIONS,
)

HEAD, TAIL = 0, 1
FIRST, LAST = 0, 1  # ends of a wrap
OUTWARDS = (-1, 1)  # along station numbers


class PoseArrays(NamedTuple):
    """Where a pulley is: centre [m], (3,); axes (3, 3), pulley frame to world; spin [rad]."""

    centre: Array
    axes: Array
    spin: Array


class WrapArrays(NamedTuple):
    """As belt_sim.mujoco3d.state.Wrap: first, last (); r, y [m], angle [rad], shape (m, n); lifted [m], (n,);
    tangent [rad], (2,). Its slip stands in quasi_static/friction.py."""

    first: Array
    last: Array
    r: Array
    y: Array
    angle: Array
    landing_lift: Array
    tangent: Array


def axes_of(surface: SurfaceArrays, yaw: Array, share: Array, spin: Array, askew: Array | float = 1.0) -> Array:
    """Rotation (3, 3) of a pulley, as PulleySurface.axes."""
    phase, cone = spin + surface.wobble_phase, askew * surface.wobble
    turn = yaw + share * surface.yaw_offset + cone * jnp.cos(phase)
    roll = share * surface.cant + cone * jnp.sin(phase)
    c, s, cg, sg = jnp.cos(turn), jnp.sin(turn), jnp.cos(roll), jnp.sin(roll)
    return jnp.array([[c, -s * cg, s * sg], [s, c * cg, -c * sg], [0.0, sg, cg]])


def roll_anchors(surface: SurfaceArrays, wrap: WrapArrays, pose: PoseArrays, rolled: Array) -> WrapArrays:
    """The anchors of a belt under which the axis has rolled by a small angle [rad], as Wrap.lay_anew."""
    there = wrap.y + rolled * wrap.r * jnp.cos(wrap.angle + pose.spin)
    wider = radius_at(surface, jnp.ones(()), there) - radius_at(surface, jnp.ones(()), wrap.y)
    return wrap._replace(y=there, r=wrap.r + wider)


def radius_at(surface: SurfaceArrays, shaped: Array, y: Array) -> Array:
    """Radius of a station's circle [m]; shaped: 1 where the pulley is what it is, 0 while it is a plain cylinder."""
    uneven = y * (surface.taper - 0.5 * surface.crown * y)
    return surface.radius + shaped * surface.radius * uneven + surface.extra


def cylinder_coordinates(places: Array, pose: PoseArrays) -> tuple[Array, Array, Array]:
    """r, y [m] and material angle [rad] of places (m, 3, ...)."""
    local = jnp.einsum("mi...,ij->mj...", places - _broadcast(pose.centre, places), pose.axes)
    x, y, z = local[:, 0], local[:, 1], local[:, 2]
    return jnp.sqrt(x * x + z * z), y, jnp.arctan2(x, z) - pose.spin


def _broadcast(vector: Array, places: Array) -> Array:
    return vector.reshape(1, 3, *[1] * (places.ndim - 2))


def spin_derivative(wrap: WrapArrays, pose: PoseArrays, k: Array) -> Array:
    """How the anchors of station k move with the pulley's spin [m/rad], shape (m, 3)."""
    turned, r = wrap.angle[:, k] + pose.spin, wrap.r[:, k]
    local = jnp.stack([r * jnp.cos(turned), jnp.zeros_like(r), -r * jnp.sin(turned)], axis=1)
    return local @ pose.axes.T


def depth(wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, angle: Array, end: int) -> Array:
    """How far behind the belt's tangent at ``end`` stations of material angle ``angle`` [rad] lie [m]."""
    ahead = angle + pose.spin - wrap.tangent[end]
    return -OUTWARDS[end] * (ahead - math.tau * jnp.rint(ahead / math.tau)) * surface.radius


def lift(inside: Array, chord: Array, surface: SurfaceArrays) -> Array:
    """Height above the circle [m] of stations ``inside`` [m] behind the tangent point (loop.py)."""
    radius, along = surface.radius, surface.sinking
    straight = radius / jnp.cos(jnp.minimum(inside, 0.5 * chord) / radius) - radius
    t = jnp.clip((inside / chord - 0.5) / along, 0.0, 1.0)
    left = (1.0 - t) ** 2
    return straight * left * (1.0 + 2.0 * t) + (0.5 * chord**2 / radius * along) * t * left


def _chord_angle(flat: Array, r1: Array, r2: Array) -> Array:
    return 2.0 * jnp.arcsin(jnp.sqrt((flat - (r1 - r2) ** 2) / (4.0 * r1 * r2)))


def sink_ends(
    shape: BatchShape,
    wrap: WrapArrays,
    surface: SurfaceArrays,
    pose: PoseArrays,
    end: int,
    chord: Array,
    moved: Array,
    shaped: Array,
) -> WrapArrays:
    """The outermost stations at ``end`` on their path for the pulley's present place; moved [m]: what it turned."""
    outward = OUTWARDS[end]
    outer = (wrap.first, wrap.last)[end]
    k = (outer - outward * jnp.arange(shape.zone + 1)) % shape.stations
    off, r, angle, y = k[:-1], wrap.r[:, k], wrap.angle[:, k], wrap.y[:, k[:-1]]
    flat = jnp.diff(r) ** 2 + 4.0 * r[:, 1:] * r[:, :-1] * jnp.sin(0.5 * jnp.diff(angle)) ** 2
    lifted = wrap.landing_lift[off] * jnp.exp(-moved / (FORGETTING * chord))
    inside = depth(wrap, surface, pose, 0.5 * (angle[0] + angle[-1])[:-1], end)
    on_path = radius_at(surface, shaped, y) + lift(inside, chord, surface) + lifted
    turned = _chord_angle(flat, on_path, jnp.concatenate([on_path[:, 1:], r[:, -1:]], axis=1))
    behind = jnp.cumsum(turned[:, ::-1], axis=1)[:, ::-1]
    return wrap._replace(
        landing_lift=wrap.landing_lift.at[off].set(lifted),
        r=wrap.r.at[:, off].set(on_path),
        angle=wrap.angle.at[:, off].set(angle[:, -1:] + outward * behind),
    )


def update_tangents(shape: BatchShape, wrap: WrapArrays, pose: PoseArrays, places: Array, share: Array) -> WrapArrays:
    """The places where the belt meets the pulley, moved by ``share`` of the way to where the spans' directions say."""
    tangent = []
    for end, outer in enumerate((wrap.first, wrap.last)):
        inner, beyond = ((outer + i * OUTWARDS[end]) % shape.stations for i in (1, SPAN_STATIONS))
        along = (places[:, :, beyond] - places[:, :, inner]).sum(axis=0) * OUTWARDS[end]
        local = along @ pose.axes
        ahead = jnp.arctan2(-local[2], local[0]) - wrap.tangent[end]
        tangent.append(wrap.tangent[end] + share * (ahead - math.tau * jnp.rint(ahead / math.tau)))
    return wrap._replace(tangent=jnp.stack(tangent))


def release_station(
    shape: BatchShape, wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, end: int, chord: Array
) -> WrapArrays:
    """Without the outermost station at ``end``, where it has come far enough to be free."""
    outer = (wrap.first, wrap.last)[end]
    k = outer % shape.stations
    inside = depth(wrap, surface, pose, 0.5 * (wrap.angle[0, k] + wrap.angle[-1, k]), end)
    fewer = jnp.where(inside < -(CATCH_DISTANCE + HYSTERESIS) * chord, outer - OUTWARDS[end], outer)
    return wrap._replace(**{("first", "last")[end]: fewer})


class Approach(NamedTuple):
    """A free station and the outermost one held beside it, at one instant: depth [m], (), of the free one behind the
    tangent point; its r, y [m] and material angle [rad], (m,); square [m2], (m,): of its distance from the other."""

    depth: Array
    r: Array
    y: Array
    angle: Array
    square: Array


def approach_of(
    shape: BatchShape, wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, places: Array, end: int
) -> Approach:
    """The station next to ``end``; places [m], shape (m, 3, n): of the belt as one sees it without its layer."""
    outer = (wrap.first, wrap.last)[end]
    nodes, beside = (places[:, :, k % shape.stations] for k in (outer + OUTWARDS[end], outer))
    r, y, angle = cylinder_coordinates(nodes, pose)
    behind = depth(wrap, surface, pose, 0.5 * (angle[0] + angle[-1]), end)
    return Approach(behind, r, y, angle, ((nodes - beside) ** 2).sum(axis=1))


def land_station(
    shape: BatchShape,
    wrap: WrapArrays,
    surface: SurfaceArrays,
    pose: PoseArrays,
    before: Approach,
    after: Approach,
    end: int,
    chord: Array,
    moved: Array,
    shaped: Array,
) -> WrapArrays:
    """With the station next to ``end``, where it has come close enough in the step: at its mean height and at its
    distance from the one landed before, edge by edge.

    before, after: that station at both ends of the step, of ``moved`` [m]. It is caught on the way between them, where
    it comes close enough, as if steps were short; else a slack belt would be as the step catches it, early or late.
    """
    outward = OUTWARDS[end]
    outer = (wrap.first, wrap.last)[end]
    k, beside = (outer + outward) % shape.stations, outer % shape.stations
    lands = after.depth > -CATCH_DISTANCE * chord
    nearer = after.depth - before.depth
    passed = lands & (nearer > 0.0) & (before.depth < -CATCH_DISTANCE * chord)
    left = jnp.where(passed, (after.depth + CATCH_DISTANCE * chord) / jnp.where(passed, nearer, 1.0), 0.0)
    _, r, y, _, square = jax.tree.map(lambda a, b: b - left * (b - a), before, after)
    circle = radius_at(surface, shaped, y)
    high = (r - circle).mean()
    lifted = high - lift(depth(wrap, surface, pose, after.angle.mean(), end) - left * nearer, chord, surface)
    turned = _chord_angle(square - (y - wrap.y[:, beside]) ** 2, circle + high, wrap.r[:, beside])
    new = {"r": circle + high, "y": y, "angle": wrap.angle[:, beside] + outward * turned}
    anchors = {f: (v := getattr(wrap, f)).at[:, k].set(jnp.where(lands, new[f], v[:, k])) for f in new}
    lifted = lifted * jnp.exp(-left * moved / (FORGETTING * chord))
    return wrap._replace(
        landing_lift=wrap.landing_lift.at[k].set(jnp.where(lands, lifted, wrap.landing_lift[k])),
        **anchors,
        **{("first", "last")[end]: jnp.where(lands, outer + outward, outer)},
    )


_AHEAD = 2.0  # chords before the tangent point: what lies further is on the other side of the pulley


def relax_layer(
    belt: BeltArrays, layers: Array, wraps: WrapArrays, pose: PoseArrays, nodes: Array, share: Array, rate: Array
) -> Array:
    """Displacements of both pulleys' ends (2, 2, m, 2) moved by ``rate`` of the way to what the fibres beside them say.

    nodes [m], (m, 3, n); share: of the layer and of the camber.
    """

    def one(wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays) -> Array:
        return jnp.stack(
            [line_displacements(belt, share, nodes, wrap, surface.radius, pose, end) for end in (FIRST, LAST)]
        )

    wanted = share * jax.vmap(one)(wraps, belt.surfaces, pose)
    return layers + rate * (wanted - layers)


def line_displacements(
    belt: BeltArrays, share: Array, nodes: Array, wrap: WrapArrays, radius: Array, pose: PoseArrays, end: int
) -> Array:
    """How far the lines are outside the circle, and drawn into the pulley, beyond their mean [m], (m, 2).

    nodes [m], (m, 3, n); share: of the camber; radius [m].
    """
    fibres, outward, n = belt.fibres, OUTWARDS[end], nodes.shape[-1]
    assert fibres is not None
    begin = wrap.first - 1 - RUNUP_LINKS if end == FIRST else wrap.last + 1
    k = (begin + jnp.arange(RUNUP_LINKS + 1)) % n
    strain = strains(belt.ties, nodes, k, share) - fibres.residual
    stress = fibres.modulus * jnp.maximum(strain, SLACKEST_FIBRE * jnp.maximum(strain.mean(), 1e-12))
    local = (nodes[:, :, k[-1]] - nodes[:, :, k[0]]) @ pose.axes
    ahead = jnp.arctan2(-local[:, 2], local[:, 0]) - wrap.tangent[end]
    steeper = outward * (ahead - math.tau * jnp.rint(ahead / math.tau))
    layer = jnp.sqrt(fibres.plate / (stress * fibres.thickness))
    out = layer**2 / (2.0 * radius)
    drawn = layer**3 / (12.0 * radius**2) - out.mean() * (steeper - steeper.mean())
    both = jnp.stack([out, drawn], axis=1)
    return fibres.own * (both - both.mean(axis=0))


def station_displacement(
    belt: BeltArrays, wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, layer: Array, inside: Array, end: int
) -> Array:
    """By how much the layer at ``end`` displaces stations ``inside`` [m] behind the tangent point, (k,): (m, 3, k).

    Sections that are drawn in unequally turn, and with them the line that they stand on.
    """
    line_y, chord = belt.line_y, belt.chord
    outward, (out, drawn), at = OUTWARDS[end], layer[end].T, wrap.tangent[end]
    turned = (drawn @ line_y) / (line_y @ line_y)
    t = jnp.clip((inside / chord - 0.5) / surface.sinking, 0.0, 1.0)
    fading = jnp.where(inside > -_AHEAD * chord, (1.0 - t) ** 2 * (1.0 + 2.0 * t), 0.0)
    level = [out * jnp.sin(at) - outward * drawn * jnp.cos(at), out * jnp.cos(at) + outward * drawn * jnp.sin(at)]
    ones = jnp.ones_like(inside)
    aside = jnp.broadcast_to(-turned * inside, (len(line_y), *inside.shape))
    local = jnp.stack([level[0][:, None] * ones, aside, level[1][:, None] * ones], axis=1)
    return jnp.einsum("mjk,ij->mik", fading * local, pose.axes)


def layer_displacements(
    belt: BeltArrays, wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, layer: Array
) -> Array:
    """By how much the layer displaces every station's anchors [m], (m, 3, n); those inside the wrap not at all."""
    angle = wrap.angle.mean(axis=0)
    ends = [
        station_displacement(belt, wrap, surface, pose, layer, depth(wrap, surface, pose, angle, end), end)
        for end in (FIRST, LAST)
    ]
    return ends[FIRST] + ends[LAST]


def without_layer(
    belt: BeltArrays,
    wrap: WrapArrays,
    surface: SurfaceArrays,
    pose: PoseArrays,
    layer: Array | None,
    nodes: Array,
    end: int,
) -> Array:
    """Nodes [m], (m, 3, n), with the station next to ``end`` and the outermost held one where a thread would be."""
    if layer is None:
        return nodes
    k = ((wrap.first, wrap.last)[end] + OUTWARDS[end] * jnp.array([1, 0])) % nodes.shape[-1]
    angle = cylinder_coordinates(nodes[:, :, k], pose)[2].mean(axis=0)
    inside = depth(wrap, surface, pose, angle, end)
    moved = station_displacement(belt, wrap, surface, pose, layer, inside, end)
    return nodes.at[:, :, k].add(-moved)


def land_stations(
    shape: BatchShape,
    belt: BeltArrays,
    wraps: WrapArrays,
    before: tuple[PoseArrays, Array],
    after: tuple[PoseArrays, Array],
    layer: Array | None,
    moved: Array,
    shaped: Array,
) -> WrapArrays:
    """The wraps of both pulleys with the stations that they have caught in a step of ``moved`` [m].

    before, after: poses and nodes [m], (m, 3, n), at both ends of the step; layer: as in layer.py, or None; shaped: 1
    where the pulleys are what they are, 0 while they are plain cylinders.
    """
    for end in (FIRST, LAST):

        def lands(
            w: WrapArrays, s: SurfaceArrays, p: PoseArrays, old: PoseArrays, layer: Array | None, end: int = end
        ) -> WrapArrays:
            one, other = (
                approach_of(shape, w, s, at, without_layer(belt, w, s, at, layer, nodes, end), end)
                for at, nodes in ((old, before[1]), (p, after[1]))
            )
            return land_station(shape, w, s, p, one, other, end, belt.chord, moved, shaped)

        wraps = jax.vmap(lands)(wraps, belt.surfaces, after[0], before[0], layer)
    return wraps
