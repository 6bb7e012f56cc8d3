"""The belt on a pulley: the stations that lie there, their anchors on the spinning surface, and its geometry."""

import math
from typing import NamedTuple

from belt_sim.mujoco3d.arrays import library_of, put
from belt_sim.mujoco3d.belt import SurfaceArrays
from belt_sim.mujoco3d.options import SPAN_STATIONS
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

    def outer(self, end: int) -> Array:
        """Number of the outermost station at ``end``."""
        return (self.first, self.last)[end]

    def with_outer(self, end: int, station: Array) -> "WrapArrays":
        """The wrap with this outermost station at ``end``."""
        return self._replace(last=station) if end else self._replace(first=station)


class BeltOnPulley(NamedTuple):
    """The stations on a pulley, its surface, where it is, and what the bending layer displaces there, None without one.

    layer [m], (2, m, 2): by how much the lines are displaced outwards and into the pulley at ``first`` and at ``last``.
    Both pulleys at once have a leading axis of head and tail in every array.
    """

    wrap: WrapArrays
    surface: SurfaceArrays
    pose: PoseArrays
    layer: Array | None = None


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


def roll_anchors(pulley: BeltOnPulley, rolled: Array) -> WrapArrays:
    """The anchors after the axis has rolled by a small angle [rad] under a belt at rest, which does not go with it:
    where a cant begins to act, the belt has been laid straight on the canted pulley."""
    wrap, surface, pose, _ = pulley
    there = wrap.y + rolled * wrap.r * library_of(wrap.r).cos(wrap.angle + pose.spin)
    wider = radius_at(surface, 1.0, there) - radius_at(surface, 1.0, wrap.y)
    return wrap._replace(y=there, r=wrap.r + wider)


def slide_anchors(pulley: BeltOnPulley, shaped: Array | float, k: Array, increment: Array) -> WrapArrays:
    """The anchors of stations k moved on the surface by slip increments [m], (m, 2, k): along the axis, the turn."""
    wrap, surface = pulley.wrap, pulley.surface
    at = (slice(None), k)
    y, r = wrap.y[at], wrap.r[at]
    there = y + increment[:, 0]
    wider = radius_at(surface, shaped, there) - radius_at(surface, shaped, y)
    angle = put(wrap.angle, at, wrap.angle[at] + increment[:, 1] / r)
    return wrap._replace(y=put(wrap.y, at, there), angle=angle, r=put(wrap.r, at, r + wider))


def surface_components(pulley: BeltOnPulley, k: Array, vectors: Array) -> tuple[Array, Array, Array]:
    """Parts (m, k) of world vectors (m, 3, k) at the anchors of stations k: outwards, along the axis, the turn."""
    xp, turned = library_of(vectors), pulley.wrap.angle[:, k] + pulley.pose.spin
    sin, cos = xp.sin(turned), xp.cos(turned)
    x, y, z = (pulley.pose.axes.T @ vectors).swapaxes(0, 1)
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
    """The places where the belt meets the pulley, moved by ``share`` of the way to where the spans' directions say.

    nodes [m], (m, 3, n).
    """
    xp, n, tangent = library_of(nodes), nodes.shape[-1], []
    for end in (FIRST, LAST):
        inner, beyond = ((wrap.outer(end) + i * OUTWARDS[end]) % n for i in (1, SPAN_STATIONS))
        along = (nodes[:, :, beyond] - nodes[:, :, inner]).sum(axis=0) * OUTWARDS[end]
        local = along @ pose.axes
        ahead = xp.arctan2(-local[2], local[0]) - wrap.tangent[end]
        tangent.append(wrap.tangent[end] + share * wrapped_angle(ahead))
    return wrap._replace(tangent=xp.stack(tangent))
