"""A limp belt: how it leaves a pulley between two stations, and how its sway is calmed.

Where a limp belt runs off it has a kink, from the direction of the stations that lie on the pulley to that of the span.
If the span simply began at the last station held, each release would let its beginning jump by kink x chord (10-18 um
at 25 mm and a yaw of 0.042 deg). The spans of a limp belt ring with these jumps, and as the stations land in
step with them, each landing catches the same phase: the rate of drift comes out wrong by as much as a fifth. So the
span of a limp belt begins at the tangent point: the last station held stands on the straight line through the tangent
point and the first free station. Belts with bending stiffness have no kink and need none of this.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from belt_sim.mujoco3d.options import Options
from belt_sim.mujoco3d.wrap.contact import Contact
from belt_sim.mujoco3d.wrap.hold import HEAD, TAIL, Pose, Wrap, cylinder_coordinates

_BASE = 8  # stations over which the span's inclination is taken: vertical waves are shorter or small
_FURTHEST = 0.6  # chords; stations are let go half a chord beyond the tangent point, give or take a wave


def is_limp(belt: str, options: Options) -> bool:
    """Belts without in-plane bending stiffness in their spans."""
    return belt == "rope" or (belt == "grid" and "diagonal" not in options.bonds)


@dataclass
class Limp:
    """sign: +1 or -1, travel along station numbers; drag [N s/m], shape (m,): sideways damping of a node.

    last: the station at the run-off of the head and the tail pulley; slope: dy/ds of the stations there, shape (2, m).
    """

    contact: Contact
    sign: int
    drag: np.ndarray
    forces: np.ndarray
    last: list[int]
    slope: np.ndarray

    @staticmethod
    def of(contact: Contact, data: mujoco.MjData, sign: int, damping: float) -> "Limp":
        """damping [1/s]: per unit of mass, as in Options."""
        mesh = contact.scene.mesh
        forces = data.qfrc_applied[contact.scene.base :].reshape(contact.slides.shape)
        last = [_run_off(wrap, sign) for wrap in contact.wraps]
        return Limp(contact, sign, damping * mesh.mass, forces, last, np.zeros((2, mesh.across)))

    def lead_off(self, poses: tuple[Pose, Pose]) -> None:
        """Before a step, after Contact.follow: put the last stations on the lines through the tangent points.

        A station that has just become the last is moved there at once: the line then does not notice the change.
        """
        contact = self.contact
        mesh, n = contact.scene.mesh, contact.scene.mesh.stations
        for which, (wrap, pose) in enumerate(zip(contact.wraps, poses, strict=True)):
            last = _run_off(wrap, self.sign)
            k, landed, free = last % n, (last - self.sign) % n, (last + self.sign) % n
            r, y, angle = cylinder_coordinates(mesh.rest[[k, landed]] + contact.spring[[k, landed]], pose)
            self.slope[which] = (y[1] - y[0]) / mesh.chord
            beyond = self._beyond(pose, last, r[0], angle[0])
            tangent = y[0] + self.slope[which] * beyond
            y_free = cylinder_coordinates(contact.nodes(free), pose)[1]
            move = tangent + (y_free - tangent) * beyond / (beyond + mesh.chord) - y[0]
            aside = move[:, None] * pose.axes[:, 1]
            contact.spring[k] += aside
            if last != self.last[which]:
                contact.slides[k] += aside
                self.last[which] = last

    def _beyond(self, pose: Pose, last: int, r: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """How far the last nodes held, at radius r and material angle, are beyond the tangent point [m], shape (m,)."""
        mesh = self.contact.scene.mesh
        far = self.contact.nodes((last + self.sign * _BASE) % mesh.stations)
        r_far, _, angle_far = cylinder_coordinates(far, pose)
        ahead = r_far * np.sin(self.sign * (angle_far - angle))
        beyond = r * np.arctan2(r_far * np.cos(angle_far - angle) - r, ahead)
        return np.clip(beyond, -_FURTHEST * mesh.chord, _FURTHEST * mesh.chord)

    def spare(self, speed: float, dt: float) -> None:
        """Before a step, after lead_off: drag shall act against waves, not against the travel of a straight span.

        The nodes of a straight span between tangent point (theta its direction) and run-up move sideways at
        v (theta + slope) at one end and with the pulley at the other, and linearly in between: drag times this.
        """
        contact = self.contact
        n = contact.scene.mesh.stations
        self.forces[..., 1] = 0.0
        if speed == 0.0:
            return
        for begins, ends in ((HEAD, TAIL), (TAIL, HEAD)):
            wrap = contact.wraps[ends]
            landed = wrap.first if self.sign > 0 else wrap.last
            links = self.sign * (landed - self.last[begins]) % n
            k = (self.last[begins] + self.sign * np.arange(1, links + 1)) % n
            y = contact.nodes(k[-1])[:, 1]
            theta = (y - contact.nodes(k[0])[:, 1]) / (contact.scene.mesh.chord * (links - 1))
            at_run_off = speed * (theta + self.slope[begins])
            at_run_up = (contact.spring[k[-1]] - contact.slides[k[-1]])[:, 1] / dt
            share = np.arange(1, links)[:, None] / links
            self.forces[k[:-1], :, 1] = self.drag * (at_run_off + (at_run_up - at_run_off) * share)


def _run_off(wrap: Wrap, sign: int) -> int:
    return wrap.last if sign > 0 else wrap.first
