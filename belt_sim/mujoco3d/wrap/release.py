"""How a limp belt leaves a pulley between two stations.

Where a limp belt runs off it has a kink, from the direction of the stations that lie on the pulley to that of the span.
If the span simply began at the last station held, each release would let its beginning jump by kink x chord (10-18 um
at 25 mm and a yaw of 0.042 deg). The spans of a limp belt ring with these jumps, and as the stations land in
step with them, each landing catches the same phase: the rate of drift comes out wrong by as much as a fifth. So the
span of a limp belt begins at the tangent point: the last station held stands on the straight line through the tangent
point and the first free station. Belts with bending stiffness have no kink and need none of this.
"""

import numpy as np

from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.mujoco_4 import Springs
from belt_sim.mujoco3d.state import Pose, State, Wrap, cylinder_coordinates

_BASE = 8  # stations over which the span's inclination is taken: vertical waves are shorter or small
_FURTHEST = 0.6  # chords; stations are let go half a chord beyond the tangent point, give or take a wave


def run_off(wrap: Wrap, sign: int) -> int:
    """The last station held where the belt leaves; sign: +1 or -1, travel along station numbers."""
    return wrap.last if sign > 0 else wrap.first


def lead_off(mesh: Mesh, state: State, springs: Springs, sign: int) -> None:
    """Before a step: put the last stations on the lines through the tangent points.

    A station that has just become the last is moved there at once: the line then does not notice the change.
    """
    n = mesh.stations
    for which, (wrap, pose) in enumerate(zip(state.wraps, state.poses, strict=True)):
        last = run_off(wrap, sign)
        k, landed, free = last % n, (last - sign) % n, (last + sign) % n
        r, y, angle = cylinder_coordinates(mesh.at(springs.rest, [k, landed]), pose)
        state.kink_slope[which] = slope = (y[1] - y[0]) / mesh.chord
        beyond = _beyond(mesh, mesh.at(state.slides, (last + sign * _BASE) % n), pose, sign, r[0], angle[0])
        tangent = y[0] + slope * beyond
        y_free = cylinder_coordinates(mesh.at(state.slides, free), pose)[1]
        move = tangent + (y_free - tangent) * beyond / (beyond + mesh.chord) - y[0]
        aside = move[:, None] * pose.axes[:, 1]
        springs.rest[k] += aside
        if last != state.led[which]:
            state.slides[k] += aside
            state.led[which] = last


def _beyond(mesh: Mesh, far: np.ndarray, pose: Pose, sign: int, r: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """How far the last nodes held, at radius r and material angle, are beyond the tangent point [m], shape (m,).

    far [m], shape (m, 3): nodes further along the span, to which it runs straight.
    """
    r_far, _, angle_far = cylinder_coordinates(far, pose)
    ahead = r_far * np.sin(sign * (angle_far - angle))
    beyond = r * np.arctan2(r_far * np.cos(angle_far - angle) - r, ahead)
    return np.clip(beyond, -_FURTHEST * mesh.chord, _FURTHEST * mesh.chord)
