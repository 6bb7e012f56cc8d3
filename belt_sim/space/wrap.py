"""The belt on a pulley: the stations that lie there, their anchors on the spinning surface, how they land and leave.

First the geometry of one pulley, then the bending layer, then landing, sinking and leaving. Throughout, here and in
chain.py, ``nodes`` [m] and forces [N] are (m, 3, n): lines, x y z, stations; ``share`` is that of camber and loads.
"""

import math
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Numbers as Array
from belt_sim.space import options
from belt_sim.space.belt import BeltArrays, SurfaceArrays
from belt_sim.space.elastic import SlidingStiffness, factorise, solve_chain, strains, sweep_inverse
from belt_sim.space.scene import chord_angle, lift, smoothstep

HEAD, TAIL = 0, 1
FIRST, LAST = 0, 1  # ends of a wrap
OUTWARDS = (-1, 1)  # along station numbers


class PoseArrays(NamedTuple):
    """Where a pulley is: centre [m], (3,); axes (3, 3), pulley frame to world; spin [rad]; bow [1/m] of its axis."""

    centre: Array
    axes: Array
    spin: Array
    bow: Array


class WrapArrays(NamedTuple):
    """The stations that lie on a pulley: consecutive numbers first..last (modulo n), and their anchors.

    Anchors are cylinder coordinates in the spinning pulley: r, y [m], angle [rad] from the top towards +x, (m, n),
    valid for held stations only; landing_lift [m], (n,): how much higher than its path a station was caught; tangent
    [rad], (2,): where the belt meets the pulley, from the top towards +x and not turning.
    """

    first: Array
    last: Array
    r: Array
    y: Array
    angle: Array
    landing_lift: Array
    tangent: Array

    def outer(self, end: int) -> Array:
        """Number of the outermost station at ``end``."""
        return (self.first, self.last)[end]


class BeltOnPulley(NamedTuple):
    """The stations on a pulley, its surface, where it is, and by how much the bending layer, if any, displaces the
    lines outwards and into the pulley at both ends [m], (2, m, 2). Both pulleys at once have a leading axis of head and
    tail."""

    wrap: WrapArrays
    surface: SurfaceArrays
    pose: PoseArrays
    layer: Array | None = None


def wrapped_angle(angle: Array) -> Array:
    """The same direction between -pi and pi [rad]."""
    return angle - math.tau * jnp.rint(angle / math.tau)


def axes_of(surface: SurfaceArrays, yaw: Array, share: Array, spin: Array, askew: Array | float = 1.0) -> Array:
    """Rotation (3, 3) from a pulley's frame (y along its axis, not spinning) to the world; yaw [rad]: commanded, and by
    compliance; share: of yaw offset and cant that acts; askew: of the wobble (all, but while the belt is being laid).
    """
    phase, cone = spin + surface.wobble_phase, askew * surface.wobble
    turn = yaw + share * surface.yaw_offset + cone * jnp.cos(phase)
    roll = share * surface.cant + cone * jnp.sin(phase)
    c, s, cg, sg = jnp.cos(turn), jnp.sin(turn), jnp.cos(roll), jnp.sin(roll)
    return jnp.array([[c, -s * cg, s * sg], [s, c * cg, -c * sg], [0.0, sg, cg]])


def radius_at(surface: SurfaceArrays, shaped: Array | float, y: Array) -> Array:
    """Radius of a station's circle [m]; shaped: 1 where the pulley is what it is, 0 while it is a plain cylinder."""
    uneven = y * (surface.taper - 0.5 * surface.crown * y)
    return surface.radius + shaped * surface.radius * uneven + surface.extra


def roll_anchors(pulley: BeltOnPulley, rolled: Array) -> WrapArrays:
    """The anchors after the axis has rolled by a small angle [rad] under a belt at rest, which does not go with it:
    where a cant begins to act, the belt has been laid straight on the canted pulley."""
    wrap, surface, pose, _ = pulley
    there = wrap.y + rolled * wrap.r * jnp.cos(wrap.angle + pose.spin)
    wider = radius_at(surface, 1.0, there) - radius_at(surface, 1.0, wrap.y)
    return wrap._replace(y=there, r=wrap.r + wider)


def cylinder_coordinates(places: Array, pose: PoseArrays) -> tuple[Array, Array, Array]:
    """r, y [m] and material angle [rad] of places (m, 3, ...), each (m, ...)."""
    shape = (len(places), *places.shape[2:])
    local = pose.axes.T @ (places.reshape(len(places), 3, -1) - pose.centre[:, None])
    x, y, z = (local[:, i].reshape(shape) for i in range(3))
    along = y / (1.0 - pose.bow * (x - 0.5 * pose.bow * y * y))  # y of the circle, yawed by -bow y, that it lies on
    x = x - 0.5 * pose.bow * along * along
    return jnp.sqrt(x * x + z * z), y / (1.0 - pose.bow * x), jnp.arctan2(x, z) - pose.spin


def anchor_places(r: Array, y: Array, turned: Array, axes: Array, centre: Array, bow: Array) -> Array:
    """World places [m], (m, 3, k), of anchors r, y [m] at angles ``turned`` [rad] from the top, each (m, k), on pulleys
    of these axes (3, 3, k), centre (3, k), bow (k,): the axis is the line x = bow y^2/2, square to the circle at y."""
    x = r * jnp.sin(turned)
    local = x + 0.5 * bow * y * y, y * (1.0 - bow * x), r * jnp.cos(turned)
    return jnp.stack([sum(axes[i, j] * local[j] for j in range(3)) + centre[i] for i in range(3)], axis=1)


def depth(pulley: BeltOnPulley, angle: Array, end: int) -> Array:
    """How far behind the belt's tangent at ``end`` stations of material angle ``angle`` [rad] lie [m]."""
    wrap, surface, pose, _ = pulley
    return -OUTWARDS[end] * wrapped_angle(angle + pose.spin - wrap.tangent[end]) * surface.radius


def outer_depth(pulley: BeltOnPulley, end: int) -> Array:
    """How far behind the belt's tangent at ``end`` the outermost held station lies [m]."""
    wrap = pulley.wrap
    k = wrap.outer(end) % wrap.r.shape[-1]
    return depth(pulley, 0.5 * (wrap.angle[0, k] + wrap.angle[-1, k]), end)


def update_tangents(wrap: WrapArrays, pose: PoseArrays, nodes: Array, share: Array | float) -> WrapArrays:
    """The places where the belt meets the pulley, moved by ``share`` of the way to where the spans' directions say."""
    n, tangent = nodes.shape[-1], []
    for end in (FIRST, LAST):
        inner, beyond = ((wrap.outer(end) + i * OUTWARDS[end]) % n for i in (1, options.DIRECTION_STATIONS))
        along = (nodes[:, :, beyond] - nodes[:, :, inner]).sum(axis=0) * OUTWARDS[end]
        local = along @ pose.axes
        ahead = jnp.arctan2(-local[2], local[0]) - wrap.tangent[end]
        tangent.append(wrap.tangent[end] + share * wrapped_angle(ahead))
    return wrap._replace(tangent=jnp.stack(tangent))


# The bending layer, in which the belt takes on the curvature of a pulley: where the lines of nodes come and go.
#
# A fibre under the stress sigma straightens over l = sqrt(D/(sigma h)), D its plate stiffness. So its straight part
# passes l^2/2R outside the circle, and has l^3/12R^2 less belt between it and the pulley than a thread would have;
# where it comes at a steeper angle than the others, by psi, it is drawn in by (l^2/2R) psi less. Stations 25 mm apart
# do not resolve a layer of 7-16 mm. It is a condition, therefore: each line of nodes comes and goes displaced by these
# two lengths, counted from their mean over the width, with sigma and psi those of its own links beside the pulley in
# this instant. How much the belt tilts there follows from the rest of the model. The anchors of a wrap are those
# without it.

_AHEAD = 2.0  # chords before the tangent point: what lies further is on the other side of the pulley


def line_displacements(belt: BeltArrays, pulley: BeltOnPulley, share: Array | float, nodes: Array, end: int) -> Array:
    """How far the lines are outside the circle, and drawn into the pulley, beyond their mean [m], (m, 2)."""
    wrap, surface, pose, _ = pulley
    fibres, radius = belt.fibres, surface.radius
    assert fibres is not None
    begin = wrap.first - 1 - options.RUNUP_LINKS if end == FIRST else wrap.last + 1
    k = (begin + np.arange(options.RUNUP_LINKS + 1)) % nodes.shape[-1]
    strain = strains(belt.ties, nodes, k, share) - fibres.residual
    stress = fibres.modulus * jnp.maximum(strain, options.SLACKEST_FIBRE * jnp.maximum(strain.mean(), 1e-12))
    local = (nodes[:, :, k[-1]] - nodes[:, :, k[0]]) @ pose.axes
    steeper = OUTWARDS[end] * wrapped_angle(jnp.arctan2(-local[:, 2], local[:, 0]) - wrap.tangent[end])
    layer = jnp.sqrt(fibres.plate / (stress * fibres.thickness))
    out = layer**2 / (2.0 * radius)
    drawn = layer**3 / (12.0 * radius**2) - out.mean() * (steeper - steeper.mean())
    both = jnp.stack([out, drawn], axis=1)
    return fibres.tension_share * (both - both.mean(axis=0))


def station_displacement(belt: BeltArrays, pulley: BeltOnPulley, inside: Array, end: int) -> Array:
    """By how much the layer at ``end`` displaces stations ``inside`` [m] behind the tangent point, (k,): (m, 3, k) [m].
    Sections that are drawn in unequally turn, and with them their line; less along the stations that sink."""
    assert pulley.layer is not None
    line_y, chord = belt.line_y, belt.chord
    outward, (out, drawn), at = OUTWARDS[end], pulley.layer[end].T, pulley.wrap.tangent[end]
    turned = (drawn @ line_y) / (line_y @ line_y)
    sunk = jnp.clip((inside / chord - 0.5) / pulley.surface.sink_chords, 0.0, 1.0)
    fading = jnp.where(inside > -_AHEAD * chord, 1.0 - smoothstep(sunk), 0.0)
    ones = jnp.ones_like(inside)
    x = out * jnp.sin(at) - outward * drawn * jnp.cos(at)
    z = out * jnp.cos(at) + outward * drawn * jnp.sin(at)
    aside = jnp.broadcast_to(-turned * inside, (len(line_y), *inside.shape))
    local = jnp.stack([x[:, None] * ones, aside, z[:, None] * ones], axis=1)
    return jnp.einsum("mjk,ij->mik", fading * local, pulley.pose.axes)


def thread_places(belt: BeltArrays, pulley: BeltOnPulley, nodes: Array, end: int) -> Array:
    """Where the station next to ``end`` and the outermost held one would be without the layer [m], (m, 3, 2)."""
    k = (pulley.wrap.outer(end) + OUTWARDS[end] * np.array([1, 0])) % nodes.shape[-1]
    pair = nodes[:, :, k]
    if pulley.layer is None:
        return pair
    angle = cylinder_coordinates(pair, pulley.pose)[2].mean(axis=0)
    return pair - station_displacement(belt, pulley, depth(pulley, angle, end), end)


def relax_layers(belt: BeltArrays, pulleys: BeltOnPulley, nodes: Array, share: Array, rate: Array) -> BeltOnPulley:
    """With the layers, if any, moved by ``rate`` of the way to what the fibres beside the pulleys say."""
    if pulleys.layer is None:
        return pulleys
    ends = [partial(line_displacements, belt, share=share, nodes=nodes, end=end) for end in (FIRST, LAST)]
    wanted = share * jnp.stack([jax.vmap(one)(pulleys) for one in ends], axis=1)
    return pulleys._replace(layer=pulleys.layer + rate * (wanted - pulleys.layer))


# Stations land on a pulley, sink onto its circle, and leave it.
#
# A polygon that rolls over a circle lifts and lowers its spans with every corner (chordal action, chord^2 / 8 R), and
# the waves that this sends along a slack belt swing the entry moment in time with the landings. So a station is caught
# half a chord before the place where the belt meets the pulley, runs straight on until half a chord behind it, and
# sinks onto the circle along the next four (fewer on a pulley of few stations); it leaves the same way. The free span
# then always ends on one straight line. (Sinking faster shakes the belt along its length: by 69 um within one chord of
# 25 mm, 16 um within four, 9 um on a plain circle.)
#
# Landing and sinking keep the lengths of the chords, edge by edge: what lies on the pulley is the strain that the belt
# had at the run-up, so that the landed belt turns by the run-up curvature (dtheta/ds = -kappa).


def land_station(
    belt: BeltArrays, pulley: BeltOnPulley, old: PoseArrays, *, end: int, before: Array, nodes: Array, moved: Array,
    shaped: Array | float,
) -> WrapArrays:  # fmt: skip
    """With the station next to ``end``, where it has come close enough in the step, at its mean height and at its
    distance from the one landed before, edge by edge; old, before: pose and nodes at the step's beginning. It is caught
    on the way, as if steps were short; else a slack belt would be as the step catches it, early or late."""
    wrap, surface, chord = pulley.wrap, pulley.surface, belt.chord
    outward, outer, n = OUTWARDS[end], wrap.outer(end), wrap.r.shape[-1]
    k, beside = (outer + outward) % n, outer % n

    def approach(pulley: BeltOnPulley, nodes: Array) -> tuple[Array, ...]:
        """How far it is behind the tangent point; its r, y and angle; square of its distance from the one beside."""
        pair = thread_places(belt, pulley, nodes, end)
        r, y, angle = cylinder_coordinates(pair[..., 0], pulley.pose)
        behind = depth(pulley, 0.5 * (angle[0] + angle[-1]), end)
        return behind, r, y, angle, ((pair[..., 0] - pair[..., 1]) ** 2).sum(axis=1)

    was, now = approach(pulley._replace(pose=old), before), approach(pulley, nodes)
    caught = -options.CATCH_DISTANCE * chord
    lands, nearer = now[0] > caught, now[0] - was[0]
    passed = lands & (nearer > 0.0) & (was[0] < caught)
    left = jnp.where(passed, (now[0] - caught) / jnp.where(passed, nearer, 1.0), 0.0)
    _, r, y, _, square = (b - left * (b - a) for a, b in zip(was, now, strict=True))
    circle = radius_at(surface, shaped, y)
    high = (r - circle).mean()
    inside = depth(pulley, now[3].mean(), end) - left * nearer
    forgotten = jnp.exp(-left * moved / (options.FORGETTING * chord))
    lifted = (high - lift(inside, chord, surface.radius, surface.sink_chords)) * forgotten
    turned = chord_angle(square - (y - wrap.y[:, beside]) ** 2, circle + high, wrap.r[:, beside])

    def put_if_landed(values: Array, at: Any, there: Array) -> Array:
        return values.at[at].set(jnp.where(lands, there, values[at]))

    at = (slice(None), k)
    return wrap._replace(
        **{wrap._fields[end]: outer + outward * (1 * lands)},
        landing_lift=put_if_landed(wrap.landing_lift, k, lifted),
        r=put_if_landed(wrap.r, at, circle + high),
        y=put_if_landed(wrap.y, at, y),
        angle=put_if_landed(wrap.angle, at, wrap.angle[:, beside] + outward * turned),
    )


def sink_ends(belt: BeltArrays, pulley: BeltOnPulley, moved: Array, *, end: int, shaped: Array) -> WrapArrays:
    """The outermost stations at ``end`` on their path for the place of a pulley that has turned by ``moved`` [m]."""
    wrap, surface = pulley.wrap, pulley.surface
    chord, zone = belt.chord, belt.shape.zone  # stations that may be off the circle
    outward, n = OUTWARDS[end], wrap.r.shape[-1]
    k = (wrap.outer(end) - outward * np.arange(zone + 1)) % n
    off, r, angle = k[:-1], wrap.r[:, k], wrap.angle[:, k]
    flat = (r[:, 1:] - r[:, :-1]) ** 2 + 4.0 * r[:, 1:] * r[:, :-1] * jnp.sin(0.5 * (angle[:, 1:] - angle[:, :-1])) ** 2
    lifted = wrap.landing_lift[off] * jnp.exp(-moved / (options.FORGETTING * chord))
    inside = depth(pulley, 0.5 * (angle[0] + angle[-1])[:-1], end)
    high = lift(inside, chord, surface.radius, surface.sink_chords) + lifted
    r = r.at[:, :zone].set(radius_at(surface, shaped, wrap.y[:, off]) + high)
    turned = chord_angle(flat, r[:, :-1], r[:, 1:])
    behind = turned[:, ::-1].cumsum(axis=1)[:, ::-1]
    return wrap._replace(
        landing_lift=wrap.landing_lift.at[off].set(lifted),
        r=wrap.r.at[:, off].set(r[:, :-1]),
        angle=wrap.angle.at[:, off].set(angle[:, -1:] + outward * behind),
    )


# Both pulleys at once.


def sink_wraps(
    belt: BeltArrays, pulleys: BeltOnPulley, before: PoseArrays, moved: Array, shaped: Array, rests: Array
) -> BeltOnPulley:
    """With the stations on pulleys that have come from ``before``, by ``moved`` [m], on their paths for where the
    pulleys are; rests: whether the belt is at rest, which then does not roll with an axis that begins to be canted."""
    if belt.shape.canted:
        rolled = jnp.where(rests, pulleys.pose.axes[:, 2, 1] - before.axes[:, 2, 1], 0.0)
        pulleys = pulleys._replace(wrap=jax.vmap(roll_anchors)(pulleys, rolled))
    for end in (FIRST, LAST):
        sink = jax.vmap(partial(sink_ends, belt, end=end, shaped=shaped))
        pulleys = pulleys._replace(wrap=sink(pulleys, jnp.broadcast_to(moved, (2,))))
    return pulleys


def release_stations(belt: BeltArrays, pulleys: BeltOnPulley) -> BeltOnPulley:
    """Without the outermost stations, where these have come far enough to be free."""
    far = -(options.CATCH_DISTANCE + options.HYSTERESIS) * belt.chord
    for end in (FIRST, LAST):
        free = jax.vmap(partial(outer_depth, end=end))(pulleys) < far
        station = pulleys.wrap.outer(end) + OUTWARDS[end] * (-1 * free)
        pulleys = pulleys._replace(wrap=pulleys.wrap._replace(**{WrapArrays._fields[end]: station}))
    return pulleys


def land_stations(
    belt: BeltArrays, pulleys: BeltOnPulley, before: tuple[PoseArrays, Array], nodes: Array, moved: Array, shaped: Array
) -> BeltOnPulley:
    """With the stations caught in a step of ``moved`` [m] to ``nodes``; before: poses and nodes at its beginning;
    shaped: 1 where the pulleys are what they are, 0 while they are plain cylinders."""
    land = partial(land_station, belt, before=before[1], nodes=nodes, moved=moved, shaped=shaped)
    for end in (FIRST, LAST):
        pulleys = pulleys._replace(wrap=jax.vmap(partial(land, end=end))(pulleys, before[0]))
    return pulleys


def carry_wraps(
    belt: BeltArrays, pulleys: BeltOnPulley, before: tuple[PoseArrays, Array], nodes: Array, moved: Array,
    shaped: Array, share: Array, dt: Array,
) -> BeltOnPulley:  # fmt: skip
    """After a step in time of ``dt`` [s]: tangents turned, stations landed and released, layers relaxed."""
    turn = jax.vmap(partial(update_tangents, nodes=nodes, share=dt / options.SPAN_TIME))
    pulleys = pulleys._replace(wrap=turn(pulleys.wrap, pulleys.pose))
    pulleys = release_stations(belt, land_stations(belt, pulleys, before, nodes, moved, shaped))
    return relax_layers(belt, pulleys, nodes, share, jnp.minimum(dt / options.LAYER_TIME, 1.0))


# Coulomb friction of landed nodes: how far they slide until no node pulls harder than friction allows.
#
# The increments u make 1/2 u K u + f u + sum of limit |u_i| least (Tresca's problem). Newton's method finds them in a
# fixed number of iterations on the stations of a wrap, a block-tridiagonal chain.


def wrap_chain(grip: SlidingStiffness, first: Array, count: Array, longest: int) -> tuple[Array, Array]:
    """The chain of ``count`` stations from number ``first`` on, (2 m, 2 m, longest) twice: diagonal, on the next."""
    at = jnp.arange(longest)
    parity = (first + at) % 2
    own = jnp.asarray(grip.own)[parity]
    own = own.at[0].add(-jnp.asarray(grip.relief_first)[parity[0]])
    own = own.at[count - 1].add(-jnp.asarray(grip.relief_last)[parity[count - 1]])
    beside = jnp.swapaxes(jnp.asarray(grip.after)[parity], 1, 2)
    return jnp.moveaxis(own, 0, -1), jnp.moveaxis(jnp.where((at < count - 1)[:, None, None], beside, 0.0), 0, -1)


_ITERATIONS = 20
_SHARES = np.array([1.0, 0.5, 0.25, 0.1, 0.03])  # of a Newton step: whole ones alone may go in circles
_TINY = 1e-300


def slip_increments(force: Array, limit: Array, chain: tuple[Array, Array], guess: Array) -> tuple[Array, Array]:
    """Slip increments [m], (m, 2, k), and the largest force that contradicts Coulomb's law, in the largest limit.

    force [N], (m, 2, k): holding forces if none slid; limit [N], (m, k), inf = it rests; chain: blocks of the stiffness
    [N/m], diagonal and those on the next station; guess [m], (m, 2, k).
    """
    lines, _, count = force.shape
    size = 2 * lines
    scale = jnp.trace(chain[0][..., count // 2]) / size
    largest = jnp.maximum(jnp.where(jnp.isfinite(limit), limit, 0.0).max(), _TINY)

    def friction(slip: Array) -> Array:
        u = slip.reshape(size, count)
        pulled = (chain[0] * u[None]).sum(axis=1)
        pulled = pulled.at[:, :-1].add((chain[1][..., :-1] * u[None, :, 1:]).sum(axis=1))
        pulled = pulled.at[:, 1:].add((chain[1][..., :-1] * u[:, None, :-1]).sum(axis=0))
        return -force - pulled.reshape(force.shape)

    def wrong(slip: Array) -> Array:
        """By how much a step's friction contradicts the law."""
        held, way = friction(slip), jnp.sqrt((slip * slip).sum(axis=1))
        against = held - slip * (jnp.where(way > 0.0, limit, 0.0) / jnp.maximum(way, _TINY))[:, None]
        left = jnp.sqrt((against * against).sum(axis=1))
        return jnp.where(way > 0.0, left, jnp.maximum(left - limit, 0.0)).max() / largest

    def iteration(carry: tuple[Array, Array, Array], _: None) -> tuple[tuple[Array, Array, Array], None]:
        slip, best, least = carry
        held, found = friction(slip), []
        for tried in _newton(held + scale * slip, scale, force, limit, chain):  # where on either way it is least
            change = tried - slip
            ways = slip + _SHARES[:, None, None, None] * change
            rubbed = (bounded * jnp.sqrt((ways * ways).sum(axis=2))).sum(axis=(1, 2))
            bent = ((held - friction(tried)) * change).sum()
            cost = -_SHARES * (held * change).sum() + 0.5 * _SHARES**2 * bent + rubbed
            lowest = jnp.argmin(cost)
            found.append((ways[lowest], cost[lowest]))
        slip = jnp.where(found[0][1] <= found[1][1], found[0][0], found[1][0])
        error = wrong(slip)
        better = error < least
        return (slip, jnp.where(better, slip, best), jnp.where(better, error, least)), None

    bounded = jnp.where(jnp.isfinite(limit), limit, 0.0)
    guess = jnp.where(jnp.isfinite(limit)[:, None], guess, 0.0)
    (_, best, least), _ = jax.lax.scan(iteration, (guess, guess, wrong(guess)), None, length=_ITERATIONS)
    return best, least


def _newton(z: Array, scale: Array, force: Array, limit: Array, chain: tuple[Array, Array]) -> tuple[Array, Array]:
    """One iteration from z = h + r u [N], (m, 2, k), h the friction -(f + K u), r = ``scale`` [N/m]; and the same with
    nodes at rest that went back.

    At the minimum every node's h is z cut off at the limit. So a node with z within the limit rests; one beyond it gets
    the friction limit z / |z|, and what turning its direction costs.
    """
    lines, _, count = force.shape
    size = 2 * lines
    long = jnp.sqrt((z * z).sum(axis=1))
    moves = long > limit
    along = z / jnp.maximum(long, _TINY)[:, None]
    bounded = jnp.where(moves, limit, 0.0)
    turning = scale * bounded / jnp.where(moves, long - bounded, 1.0)
    across = (jnp.eye(2)[..., None] - along[:, :, None] * along[:, None]) * turning[:, None, None]
    free = jnp.repeat(moves, 2, axis=0)
    diagonal = jnp.where(free[:, None] & free[None], chain[0], 0.0)
    for j in range(lines):
        rows = slice(2 * j, 2 * j + 2)
        diagonal = diagonal.at[rows, rows].add(across[j])
    diagonal = jnp.where((jnp.eye(size, dtype=bool))[..., None] & ~free[:, None], 1.0, diagonal)
    beside = jnp.where(free[:, None] & jnp.roll(free, -1, axis=-1)[None], chain[1], 0.0).at[..., -1].set(0.0)
    wanted = jnp.where(free, -(force + bounded[:, None] * along).reshape(size, count), 0.0)
    slip = solve_chain(factorise(diagonal, beside, sweep_inverse), wanted[:, None])[:, 0].reshape(force.shape)
    back = ((slip * along).sum(axis=1) < 0.0) & (bounded > 0.0)
    return slip, jnp.where(back[:, None], 0.0, slip)


class SlipState(NamedTuple):
    """Of both pulleys. increment [m], (2, m, 2, n): of the last step, along the axis, along the turn; total [m], (2,):
    mean lateral slip so far; sliding (2,): share of held nodes that slid; residual (2,): force that contradicts
    Coulomb's law in the last step, in the largest limit."""

    increment: Array
    total: Array
    sliding: Array
    residual: Array

    @staticmethod
    def none(lines: int, stations: int) -> "SlipState":
        """Of a belt that has never slid."""
        return SlipState(np.zeros((2, lines, 2, stations)), *np.zeros((3, 2)))


def slide_wrap(
    belt: BeltArrays, pull: Array, friction: Array, speed: Array | float, shaped: Array, pulley: BeltOnPulley,
    slip: SlipState,
) -> tuple[WrapArrays, SlipState]:  # fmt: skip
    """A wrap with the anchors moved of nodes that pull harder than friction allows; the next step starts from there.

    A return mapping on the holding forces of a wrap, as one system, without inertia. The forces between belt and pulley
    are those that balance the belt's pull where it is. pull: of belt and weight; friction [1], inf = it
    sticks; speed [m/s] of the belt, which presses the less; shaped: 1 where the pulleys are what they are.
    """
    assert belt.sliding_stiffness is not None
    wrap, shape = pulley.wrap, belt.shape
    at = jnp.arange(shape.longest_wrap)
    count, k = (wrap.last - wrap.first) % shape.stations + 1, (wrap.first + at) % shape.stations
    held = at < count
    turned = wrap.angle[:, k] + pulley.pose.spin
    x, across, z = (pulley.pose.axes.T @ pull[:, :, k]).swapaxes(0, 1)  # along the pulley's axes
    outwards = x * jnp.sin(turned) + z * jnp.cos(turned)
    along = x * jnp.cos(turned) - z * jnp.sin(turned)
    pressure = jnp.maximum(-outwards - belt.mass[:, None] * speed**2 / pulley.surface.radius, 0.0)
    limit = jnp.where(held & jnp.isfinite(friction), friction * pressure, jnp.inf)
    holding = jnp.where(held, -jnp.stack([across, along], axis=1), 0.0)
    chain = wrap_chain(belt.sliding_stiffness, wrap.first, count, shape.longest_wrap)
    way, residual = jax.lax.cond(
        (jnp.hypot(across, along) > limit).any(),
        lambda: slip_increments(holding, limit, chain, slip.increment[:, :, k]),
        lambda: (jnp.zeros_like(holding), 0.0),
    )
    residual = jnp.where(count > shape.longest_wrap, jnp.inf, residual)
    nodes, y, r = shape.lines * count, wrap.y[:, k], wrap.r[:, k]
    there = y + way[:, 0]
    wider = radius_at(pulley.surface, shaped, there) - radius_at(pulley.surface, shaped, y)
    wrap = wrap._replace(
        y=wrap.y.at[:, k].set(there), angle=wrap.angle.at[:, k].add(way[:, 1] / r), r=wrap.r.at[:, k].set(r + wider)
    )
    return wrap, SlipState(
        increment=jnp.zeros_like(slip.increment).at[:, :, k].set(way),
        total=slip.total + way[:, 0].sum() / nodes,
        sliding=(way != 0.0).any(axis=1).sum() / nodes,
        residual=residual,
    )


NEITHER = -1
