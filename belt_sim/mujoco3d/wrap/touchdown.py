"""How stations come to lie on a pulley and leave it again, without a jolt and without losing length.

A polygon that rolls over a circle lifts and lowers its spans with every corner (chordal action, chord^2 / 8 R), and the
waves that this sends along a slack belt swing the entry moment in time with the landings. So a station is caught half
a chord before the place where the belt meets the pulley, runs straight on until half a chord behind it, and sinks onto
the circle along the next four (fewer on a pulley of few stations); it leaves the same way. The free span then always
ends on one straight line. (Sinking faster shakes the belt along its length: by 69 um within one chord of 25 mm, 16 um
within four, 9 um on a plain circle.)

Landing and sinking keep the lengths of the chords, edge by edge: what lies on the pulley is the strain that the belt
had at the run-up, so that the landed belt turns by the run-up curvature (physics: dtheta/ds = -kappa).
"""

import math

import numpy as np

from belt_sim.mujoco3d.constants import CATCH_DISTANCE, FORGETTING, HYSTERESIS
from belt_sim.mujoco3d.mesh.path import apart, apart_flat, lift, sinking
from belt_sim.mujoco3d.state import Pose, Wrap, cylinder_coordinates

FIRST, LAST = -1, 1
_TURN = 2.0 * math.pi


def depth(wrap: Wrap, pose: Pose, angle: np.ndarray, end: int) -> np.ndarray:
    """How far behind the belt's tangent at ``end`` stations of material angle ``angle`` [rad], shape (...), lie [m]."""
    ahead = angle + pose.spin - wrap.tangent[(end + 1) // 2]
    return -end * (ahead - _TURN * np.rint(ahead / _TURN)) * wrap.surface.radius


def sink(wrap: Wrap, pose: Pose, end: int, chord: float, moved: float) -> None:
    """Put the outermost stations at ``end`` on their path for the pulley's present place.

    chord [m] at rest; moved [m]: how far the pulley has turned since the last time.
    """
    outer = wrap.first if end == FIRST else wrap.last
    zone = sinking(chord, wrap.surface.radius) + 2  # stations that may be off the circle; the next one never is
    k = (outer - end * np.arange(zone + 1)) % len(wrap.lifted)
    off, r, angle = k[:-1], wrap.r[k], wrap.angle[k]
    flat = (r[1:] - r[:-1]) ** 2 + 4.0 * r[1:] * r[:-1] * np.sin(0.5 * (angle[1:] - angle[:-1])) ** 2
    wrap.lifted[off] *= math.exp(-moved / (FORGETTING * chord))
    inside = depth(wrap, pose, 0.5 * (angle[:-1, 0] + angle[:-1, -1]), end)
    high = lift(inside, chord, wrap.surface.radius) + wrap.lifted[off]
    r[:-1] = wrap.radius_at(wrap.y[off]) + high[:, None]
    turned = apart_flat(flat, r[:-1], r[1:])
    wrap.r[off] = r[:-1]
    wrap.angle[off] = angle[-1] + end * turned[::-1].cumsum(axis=0)[::-1]


def catches(wrap: Wrap, pose: Pose, end: int, nodes: np.ndarray, chord: float) -> bool:
    """Whether a free station with nodes at [m], shape (m, 3), has come close enough to be held."""
    _, _, angle = cylinder_coordinates(nodes, pose)
    return float(depth(wrap, pose, 0.5 * (angle[0] + angle[-1]), end)) > -CATCH_DISTANCE * chord


def lets_go(wrap: Wrap, pose: Pose, end: int, chord: float) -> bool:
    """Whether the outermost station at ``end`` has come far enough to be free."""
    outer = (wrap.first if end == FIRST else wrap.last) % len(wrap.lifted)
    return (
        float(depth(wrap, pose, 0.5 * (wrap.angle[outer, 0] + wrap.angle[outer, -1]), end))
        < -(CATCH_DISTANCE + HYSTERESIS) * chord
    )


def land(wrap: Wrap, pose: Pose, end: int, nodes: np.ndarray, beside: np.ndarray, chord: float) -> int:
    """Anchor the station next to ``end`` at its mean height and at its distance from the one landed before.

    nodes, beside: positions of the nodes of both [m], shape (m, 3). Returns the station's number.
    """
    outer = wrap.first if end == FIRST else wrap.last
    station, neighbour = ((outer + i * end) % len(wrap.lifted) for i in (1, 0))
    r, y, angle = cylinder_coordinates(nodes, pose)
    circle = wrap.radius_at(y)
    high = float(np.mean(r - circle))
    wrap.lifted[station] = high - lift(depth(wrap, pose, angle.mean(), end), chord, wrap.surface.radius)
    wrap.y[station], wrap.r[station] = y, circle + high
    length = np.linalg.norm(nodes - beside, axis=1)
    turned = apart(length, y - wrap.y[neighbour], wrap.r[station], wrap.r[neighbour])
    wrap.angle[station] = wrap.angle[neighbour] + end * turned
    wrap.first, wrap.last = (wrap.first - 1, wrap.last) if end == FIRST else (wrap.first, wrap.last + 1)
    wrap.renumber()
    return int(station)


def anchor(wrap: Wrap, pose: Pose, station: int, nodes: np.ndarray) -> None:
    """Anchor a station where its nodes are, at their mean height (used before the run)."""
    r, y, angle = cylinder_coordinates(nodes, pose)
    circle = wrap.radius_at(y)
    wrap.y[station], wrap.angle[station], wrap.r[station] = y, angle, circle + np.mean(r - circle)


def tangent_angle(pose: Pose, along: np.ndarray) -> float:
    """Angle [rad] from the top towards +x of the place where a belt that runs along a vector, shape (3,), meets it."""
    local = along @ pose.axes
    return float(np.arctan2(-local[2], local[0]))
