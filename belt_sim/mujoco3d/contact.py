"""The belt on both pulleys during a run: landing, holding, slipping, letting go."""

from dataclasses import dataclass

import mujoco
import numpy as np

from belt_sim.errors import RunFailed
from belt_sim.mujoco3d.friction import Friction
from belt_sim.mujoco3d.hold import HEAD, TAIL, Pose, Wrap, anchor, height, land
from belt_sim.mujoco3d.scene import Scene


@dataclass
class Contact:
    """Views of MuJoCo's arrays for the nodes, shape (n, m, 3), and the two wraps.

    position [m] = rest + slides; spring, stiffness: qpos_spring [m] and jnt_stiffness [N/m]; loads: force along x [N],
    moment about the axis and about z [N m] that the belt does to the head and the tail pulley.
    """

    scene: Scene
    slides: np.ndarray
    spring: np.ndarray
    stiffness: np.ndarray
    wraps: tuple[Wrap, Wrap]
    friction: Friction
    loads: list[tuple[float, float, float]]

    @staticmethod
    def begin(scene: Scene, data: mujoco.MjData, poses: tuple[Pose, Pose], friction: Friction) -> "Contact":
        """All stations beyond the pulleys' axes lie on the pulleys."""
        model, mesh, base = scene.model, scene.mesh, scene.base
        n, m = mesh.stations, mesh.across
        wraps = []
        for which, surface, circle in (
            (HEAD, scene.parts.head, scene.loop.radius_head),
            (TAIL, scene.parts.tail, scene.loop.radius_tail),
        ):
            wraps.append(Wrap.empty(surface, circle - surface.radius, n, m))
            beyond = scene.loop.x <= 0.0 if which == HEAD else scene.loop.x >= poses[TAIL].centre[0]
            on = np.flatnonzero(beyond)
            jump = np.flatnonzero(np.diff(on) > 1)
            wraps[-1].first = int(on[jump[0] + 1]) - n if len(jump) else int(on[0])
            wraps[-1].last = int(on[jump[0]]) if len(jump) else int(on[-1])
            wraps[-1].renumber()
        shape = (n, m, 3)
        contact = Contact(
            scene=scene,
            slides=data.qpos[base:].reshape(shape),
            spring=model.qpos_spring[base:].reshape(shape),
            stiffness=model.jnt_stiffness[base:].reshape(shape),
            wraps=(wraps[HEAD], wraps[TAIL]),
            friction=friction,
            loads=[(0.0, 0.0, 0.0)] * 2,
        )
        for wrap, pose in zip(contact.wraps, poses, strict=True):
            for k in wrap.stations:
                anchor(wrap, pose, k, contact.nodes(k))
            contact.stiffness[wrap.stations] = friction.hold_stiffness
        return contact

    def nodes(self, station: int) -> np.ndarray:
        """Positions of a station's nodes [m], shape (m, 3)."""
        return self.scene.mesh.rest[station] + self.slides[station]

    def follow(self, poses: tuple[Pose, Pose]) -> None:
        """Before a step: the springs' rest positions are where the anchors will be at its end."""
        for wrap, pose in zip(self.wraps, poses, strict=True):
            k = wrap.stations
            self.spring[k] = wrap.place(pose) - self.scene.mesh.rest[k]

    def settle(self, poses: tuple[Pose, Pose], travel_sign: float) -> None:
        """After a step: measure the forces, let slip, land and let go.

        travel_sign: +1 or -1 along station numbers, 0 at rest before the run (both ends then land and let go).
        """
        for which, (wrap, pose) in enumerate(zip(self.wraps, poses, strict=True)):
            k = wrap.stations
            force = self.stiffness[k] * (self.spring[k] - self.slides[k])
            normals = wrap.normals(pose)
            self.friction.apply(which, self, wrap, pose, force, normals)
            self.loads[which] = _reaction(wrap, pose, force)
            self._change_ends(wrap, pose, force, normals, travel_sign)

    def _change_ends(self, wrap: Wrap, pose: Pose, force, normals, travel_sign: float) -> None:
        pressure_first = float(np.sum(force[0] * normals[0]))
        pressure_last = float(np.sum(force[-1] * normals[-1]))
        n = self.scene.mesh.stations
        if travel_sign <= 0.0 and pressure_first < 0.0:
            self._let_go(wrap, wrap.first % n)
            wrap.first += 1
        elif travel_sign >= 0.0:
            self._try_landing(wrap, pose, wrap.first - 1, wrap.first)
        if travel_sign >= 0.0 and pressure_last < 0.0:
            self._let_go(wrap, wrap.last % n)
            wrap.last -= 1
        elif travel_sign <= 0.0:
            self._try_landing(wrap, pose, wrap.last + 1, wrap.last)
        wrap.renumber()

    def _try_landing(self, wrap: Wrap, pose: Pose, station: int, neighbour: int) -> None:
        n = self.scene.mesh.stations
        nodes = self.nodes(station % n)
        if height(wrap, pose, nodes) > 0.0:
            return
        land(wrap, pose, station % n, neighbour % n, nodes, self.nodes(neighbour % n))
        self.stiffness[station % n] = self.friction.hold_stiffness
        wrap.first, wrap.last = min(wrap.first, station), max(wrap.last, station)

    def _let_go(self, wrap: Wrap, station: int) -> None:
        self.stiffness[station] = 0.0
        if wrap.last - wrap.first < 3:
            raise RunFailed("the belt leaves a pulley: tension too low for its weight; raise settings.tension")


def _reaction(wrap: Wrap, pose: Pose, force: np.ndarray) -> tuple[float, float, float]:
    """Force on the pulley along x [N], moment about its axis and about z [N m], of the belt's holding forces."""
    moment = -np.cross(wrap.place(pose) - pose.centre, force).sum(axis=(0, 1))
    return -float(force[:, :, 0].sum()), float(moment @ pose.axes[:, 1]), float(moment[2])
