"""How a belt without bending stiffness meets and leaves its pulleys between two stations: mujoco3d.rope as arrays.

Such a belt has kinks where it leaves a pulley and, while that is yawed, where it meets it. Its spans begin and end at
the tangent points, not at the outermost stations held: these stand on the lines that go through the tangent points.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.belt_mechanics.belt import BatchShape, SurfaceArrays
from belt_sim.belt_mechanics.chain import ChainLayout
from belt_sim.belt_mechanics.wrap import FIRST, LAST, OUTWARDS, PoseArrays, WrapArrays, cylinder_coordinates, depth
from belt_sim.jax_setup import Numbers as Array
from belt_sim.mujoco3d.options import FURTHEST_KINK, KINK_STATIONS


class RopeKinks(NamedTuple):
    """At the run-ups of head and tail, every field of shape (2,): met: number of the station that met the pulley last;
    turned [rad]: yaw; aside [m]: how far the pulley would have taken the span's line since that station landed."""

    station: Array
    compliance_yaw: Array
    offset: Array

    @staticmethod
    def none(wraps: WrapArrays, sign: int) -> "RopeKinks":
        """Of a belt laid on pulleys that are square to it."""
        return RopeKinks(wraps.first if sign > 0 else wraps.last, np.zeros(2), np.zeros(2))


def hold_run_up_ends(
    shape: BatchShape, wraps: WrapArrays, surfaces: SurfaceArrays, poses: PoseArrays, kinks: RopeKinks
) -> tuple[WrapArrays, RopeKinks]:
    """Before a step: the spans' ends stay at the tangent points while the pulleys at their run-ups are yawed."""
    end = FIRST if shape.sign > 0 else LAST

    def one(
        wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays, kinks: RopeKinks
    ) -> tuple[WrapArrays, RopeKinks]:
        outer, yaw = (wrap.first, wrap.last)[end], jnp.arctan2(-pose.axes[0, 1], pose.axes[1, 1])
        k = outer % shape.stations
        inside = depth(wrap, surface, pose, 0.5 * (wrap.angle[0, k] + wrap.angle[-1, k]), end)
        ahead = -OUTWARDS[end] * inside * jnp.cos(wrap.tangent[end])  # along x
        taken = (yaw - kinks.compliance_yaw) * ahead
        aside = jnp.where(outer == kinks.station, kinks.offset, 0.0) + jnp.where(inside < 0.0, 0.0, taken)
        wrap = wrap._replace(y=wrap.y.at[:, k].add(jnp.where(inside < 0.0, -taken, 0.0)))
        return wrap, RopeKinks(outer, yaw, aside)

    return jax.vmap(one)(wraps, surfaces, poses, kinks)


def end_offsets(
    shape: BatchShape,
    wraps: WrapArrays,
    poses: PoseArrays,
    places: ChainLayout,
    taut: Array,
    moved: Array,
    kinks: RopeKinks | None,
    chord: Array,
) -> Array | float:
    """By how much held stations of the chain stand aside of their anchors [m], shape (m, 3, n); 0.0 without kinks.

    taut [m], (m, 3, n): the chain in its last equilibrium; moved [1]: chords that it has been led on since.
    """
    if kinks is None:
        return 0.0
    sign = shape.sign
    off, up = (LAST, FIRST) if sign > 0 else (FIRST, LAST)
    found = jnp.zeros_like(taut)
    for pulley in range(2):
        wrap, pose, kink = (jax.tree.map(lambda v, p=pulley: v[p], tree) for tree in (wraps, poses, kinks))
        last, first = places.ends[pulley, off], places.ends[pulley, up]
        k, landed = ((wrap.first, wrap.last)[off] - i * sign for i in (0, 1))
        r, y, angle = (v[:, k % shape.stations] for v in (wrap.r, wrap.y, wrap.angle))
        slope = (wrap.y[:, landed % shape.stations] - y) / chord  # backwards
        beyond = _beyond_tangent(taut[..., last + sign * KINK_STATIONS], pose, sign, r, angle, chord)
        tangent = y + slope * beyond
        free, next_free = (taut[..., last + i * sign] for i in (1, 2))
        y_free = cylinder_coordinates(free + moved * (next_free - free), pose)[1]
        move = tangent + (y_free - tangent) * beyond / (beyond + chord) - y
        found = found.at[..., last].add(move[:, None] * pose.axes[:, 1])
        found = found.at[..., first].add(-kink.offset * pose.axes[:, 1])
    return found


def _beyond_tangent(far: Array, pose: PoseArrays, sign: int, r: Array, angle: Array, chord: Array) -> Array:
    """How far the last nodes held, at radius r and material angle, are beyond the tangent point [m], shape (m,).

    far [m], shape (m, 3): nodes further along the span, to which it runs straight.
    """
    r_far, _, angle_far = cylinder_coordinates(far, pose)
    ahead = r_far * jnp.sin(sign * (angle_far - angle))
    beyond = r * jnp.arctan2(r_far * jnp.cos(angle_far - angle) - r, ahead)
    return jnp.clip(beyond, -FURTHEST_KINK * chord, FURTHEST_KINK * chord)
