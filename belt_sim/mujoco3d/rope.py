"""How a belt without bending stiffness meets and leaves a pulley between two stations, and what damps its sway.

Where such a belt runs off it has a kink, from the direction of the stations that lie on the pulley to that of the span.
If the span simply began at the last station held, each release would let its beginning jump by kink x chord (10-18 um
at 25 mm and a yaw of 0.042 deg). The spans of a limp belt ring with these jumps, and as the stations land in
step with them, each landing catches the same phase: the rate of drift comes out wrong by as much as a fifth. So the
span of a limp belt begins at the tangent point: the last station held stands on the straight line through the tangent
point and the first free station.

At the run-up a yaw step makes such a kink. The belt on the pulley turns with it, and the span goes on from the tangent
point, which does not move. The outermost station held is up to half a chord before or behind that point and the pulley
would take it aside by yaw x this distance, and the span with it (15 um at 40 mm), for a span length of travel. Before
the tangent point a station belongs to the span and is not taken along; behind it, it is, but the span's line goes
through the tangent point until the next station lands.

Belts with bending stiffness have no kink and need none of this.
"""

import math
from dataclasses import dataclass

import numpy as np

from belt_sim.mujoco3d.constants import FURTHEST_KINK, KINK_STATIONS
from belt_sim.mujoco3d.mesh import Mesh
from belt_sim.mujoco3d.mujoco_4 import Springs
from belt_sim.mujoco3d.state import HEAD, TAIL, Pose, RunState, Wrap, cylinder_coordinates
from belt_sim.mujoco3d.wrap import FIRST, LAST, depth


def run_off(wrap: Wrap, sign: int) -> int:
    """The last station held where the belt leaves; sign: +1 or -1, travel along station numbers."""
    return wrap.last if sign > 0 else wrap.first


def place_run_off_stations(mesh: Mesh, state: RunState, springs: Springs, sign: int) -> None:
    """Before a step: put the last stations on the lines through the tangent points.

    A station that has just become the last is moved there at once: the line then does not notice the change.
    """
    n = mesh.stations
    for which, (wrap, pose) in enumerate(zip(state.wraps, state.poses, strict=True)):
        last = run_off(wrap, sign)
        k, landed, free = last % n, (last - sign) % n, (last + sign) % n
        r, y, angle = cylinder_coordinates(mesh.at(springs.rest, [k, landed]), pose)
        state.kink_slope[which] = slope = (y[1] - y[0]) / mesh.chord
        beyond = _beyond_tangent(
            mesh, mesh.at(state.slides, (last + sign * KINK_STATIONS) % n), pose, sign, r[0], angle[0]
        )
        tangent = y[0] + slope * beyond
        y_free = cylinder_coordinates(mesh.at(state.slides, free), pose)[1]
        move = tangent + (y_free - tangent) * beyond / (beyond + mesh.chord) - y[0]
        aside = move[:, None] * pose.axes[:, 1]
        springs.rest[k] += aside
        if last != state.run_off_stations[which]:
            state.slides[k] += aside
            state.run_off_stations[which] = last


def hold_run_up_ends(mesh: Mesh, state: RunState, springs: Springs, sign: int) -> None:
    """Before a step: keep the spans' ends at the tangent points while the pulleys at their run-ups are yawed."""
    end = FIRST if sign > 0 else LAST
    for which, (wrap, pose) in enumerate(zip(state.wraps, state.poses, strict=True)):
        outer, yaw = run_off(wrap, -sign), math.atan2(-pose.axes[0, 1], pose.axes[1, 1])
        if outer != state.run_up_stations[which]:
            state.run_up_stations[which], state.run_up_offset[which] = outer, 0.0
        k = outer % mesh.stations
        inside = float(depth(wrap, pose, wrap.angle[k].mean(), end))
        ahead = -end * inside * math.cos(wrap.tangent[(end + 1) // 2])  # along x
        taken = (yaw - state.run_up_yaw[which]) * ahead
        state.run_up_yaw[which] = yaw
        if inside < 0.0:
            wrap.y[k] -= taken
            springs.rest[k] -= taken * pose.axes[:, 1]
        else:
            state.run_up_offset[which] += taken
        springs.rest[k] -= state.run_up_offset[which] * pose.axes[:, 1]


def _beyond_tangent(mesh: Mesh, far: np.ndarray, pose: Pose, sign: int, r: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """How far the last nodes held, at radius r and material angle, are beyond the tangent point [m], shape (m,).

    far [m], shape (m, 3): nodes further along the span, to which it runs straight.
    """
    r_far, _, angle_far = cylinder_coordinates(far, pose)
    ahead = r_far * np.sin(sign * (angle_far - angle))
    beyond = r * np.arctan2(r_far * np.cos(angle_far - angle) - r, ahead)
    return np.clip(beyond, -FURTHEST_KINK * mesh.chord, FURTHEST_KINK * mesh.chord)


@dataclass(frozen=True)
class SwayDrag:
    """What is added to the drag of the nodes' slides, so that it acts against waves only.

    sign: +1 or -1, travel along station numbers; drag [N s/m], shape (m,): sideways damping of a node; dt [s].
    """

    mesh: Mesh
    sign: int
    drag: np.ndarray
    dt: float

    def forces(self, state: RunState, springs: Springs) -> np.ndarray:
        """Drag times the sideways speed of a straight span, which is linear between its ends.

        At the tangent point (theta its direction) that is v (theta + slope), at the run-up it is the pulley's.
        """
        mesh, forces = self.mesh, np.zeros_like(state.slides)
        if state.speed == 0.0:
            return forces
        for begins, ends in ((HEAD, TAIL), (TAIL, HEAD)):
            wrap, first = state.wraps[ends], state.run_off_stations[begins]
            landed = wrap.first if self.sign > 0 else wrap.last
            links = self.sign * (landed - first) % mesh.stations
            k = (first + self.sign * np.arange(1, links + 1)) % mesh.stations
            y = mesh.at(state.slides, k[-1])[:, 1]
            theta = (y - mesh.at(state.slides, k[0])[:, 1]) / (mesh.chord * (links - 1))
            at_run_off = state.speed * (theta + state.kink_slope[begins])
            at_run_up = (springs.rest[k[-1]] - state.slides[k[-1]])[:, 1] / self.dt
            share = np.arange(1, links)[:, None] / links
            forces[k[:-1], :, 1] = self.drag * (at_run_off + (at_run_up - at_run_off) * share)
        return forces
