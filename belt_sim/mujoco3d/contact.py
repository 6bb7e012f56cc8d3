"""The belt on both pulleys during a run: landing, holding, slipping, letting go.

The forces between belt and pulleys are those that balance the belt's pull where it is (forces.py), not those of the
springs: the springs also make up for what the integrator's tangent misses of links that turn within a step.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from belt_sim.errors import RunFailed
from belt_sim.mujoco3d.forces import elastic_forces
from belt_sim.mujoco3d.friction import Friction
from belt_sim.mujoco3d.hold import HEAD, TAIL, Pose, Wrap, anchor, height, land
from belt_sim.mujoco3d.scene import Scene
from belt_sim.mujoco3d.surface import PulleySurface

@dataclass
class Contact:
    """Views of MuJoCo's arrays for the nodes, shape (n, m, 3), and the two wraps.

    position [m] = rest + slides; before: slides at the beginning of the step; spring, stiffness: qpos_spring [m]
    and jnt_stiffness [N/m]; slips: friction may be finite (while the laid belt settles it sticks); loads: force along x [N], moment about the axis and about z [N m] that the belt does to
    the head and the tail pulley.
    """

    scene: Scene
    data: mujoco.MjData
    slides: np.ndarray
    before: np.ndarray
    spring: np.ndarray
    stiffness: np.ndarray
    wraps: tuple[Wrap, Wrap]
    friction: Friction
    hold_stiffness: float
    slips: bool
    loads: list[tuple[float, float, float]]

    @staticmethod
    def begin(
        scene: Scene, data: mujoco.MjData, poses: tuple[Pose, Pose], friction: Friction, hold_stiffness: float
    ) -> "Contact":
        """All stations beyond the pulleys' axes lie on the pulleys."""
        model, mesh, base = scene.model, scene.mesh, scene.base
        n, m = mesh.stations, mesh.across
        wraps = []
        for which, surface, circle in (
            (HEAD, scene.parts.head, scene.loop.radius_head),
            (TAIL, scene.parts.tail, scene.loop.radius_tail),
        ):
            plain = PulleySurface(radius=surface.radius)
            wraps.append(Wrap.empty(plain, circle - surface.radius, n, m))
            beyond = scene.loop.x <= 0.0 if which == HEAD else scene.loop.x >= poses[TAIL].centre[0]
            on = np.flatnonzero(beyond)
            jump = np.flatnonzero(np.diff(on) > 1)
            wraps[-1].first = int(on[jump[0] + 1]) - n if len(jump) else int(on[0])
            wraps[-1].last = int(on[jump[0]]) if len(jump) else int(on[-1])
            wraps[-1].renumber()
        shape = (n, m, 3)
        contact = Contact(
            scene=scene,
            data=data,
            slides=data.qpos[base:].reshape(shape),
            before=data.qpos[base:].reshape(shape).copy(),
            spring=model.qpos_spring[base:].reshape(shape),
            stiffness=model.jnt_stiffness[base:].reshape(shape),
            wraps=(wraps[HEAD], wraps[TAIL]),
            friction=friction,
            hold_stiffness=hold_stiffness,
            slips=False,
            loads=[(0.0, 0.0, 0.0)] * 2,
        )
        for wrap, pose in zip(contact.wraps, poses, strict=True):
            for k in wrap.stations:
                anchor(wrap, pose, k, contact.nodes(k))
            contact.stiffness[wrap.stations] = hold_stiffness
        return contact

    def nodes(self, station: int) -> np.ndarray:
        """Positions of a station's nodes [m], shape (m, 3)."""
        return self.scene.mesh.rest[station] + self.slides[station]

    def shape_pulleys(self) -> None:
        """From now on stations land on the pulleys as they are; until travel 0 they land on plain cylinders."""
        for wrap, surface in zip(self.wraps, (self.scene.parts.head, self.scene.parts.tail), strict=True):
            wrap.surface = surface

    def follow(self, poses: tuple[Pose, Pose]) -> None:
        """Before a step: the springs' rest positions are where the anchors will be at its end."""
        self.before[:] = self.slides
        for wrap, pose in zip(self.wraps, poses, strict=True):
            k = wrap.stations
            self.spring[k] = wrap.place(pose) - self.scene.mesh.rest[k]

    def settle(self, poses: tuple[Pose, Pose], travel_sign: float, speed: float) -> None:
        """After a step: put held nodes on their anchors, find the forces, let slip, land and let go.

        travel_sign: +1 or -1 along station numbers, 0 at rest before the run (both ends then land and let go);
        speed [m/s] of the belt.
        """
        scene = self.scene
        for wrap in self.wraps:
            self.slides[wrap.stations] = self.spring[wrap.stations]
        pull = elastic_forces(scene.model, self.data, scene.base, self.slides.shape)
        pull[..., 2] -= scene.mesh.mass * scene.parts.gravity
        for which, (wrap, pose) in enumerate(zip(self.wraps, poses, strict=True)):
            k = wrap.stations
            self.loads[which] = self._load(pose, scene.mesh.rest[k] + self.slides[k], pull[k])
            holding = -wrap.components(pose, pull[k])
            holding[..., 0] -= scene.mesh.mass * speed**2 / wrap.surface.radius
            if self.slips:
                self.friction.apply(wrap, which, holding)
            pressure = holding[..., 0].sum(axis=1)
            self._change_ends(wrap, pose, float(pressure[0]), float(pressure[-1]), travel_sign)

    def _load(self, pose: Pose, points: np.ndarray, pull: np.ndarray) -> tuple[float, float, float]:
        """Force on a pulley along x [N], moment about its axis and about z [N m], of nodes that pull at points."""
        moment = np.cross(points - pose.centre, pull).sum(axis=(0, 1))
        return float(pull[..., 0].sum()), float(moment @ pose.axes[:, 1]), float(moment[2])

    def _change_ends(self, wrap: Wrap, pose: Pose, first: float, last: float, travel_sign: float) -> None:
        """Land and let go; first, last: pressure [N] of the stations at either end."""
        n = self.scene.mesh.stations
        if travel_sign <= 0.0 and first < 0.0:
            self._let_go(wrap, wrap.first % n)
            wrap.first += 1
        elif travel_sign >= 0.0:
            self._try_landing(wrap, pose, wrap.first - 1, wrap.first)
        if travel_sign >= 0.0 and last < 0.0:
            self._let_go(wrap, wrap.last % n)
            wrap.last -= 1
        elif travel_sign <= 0.0:
            self._try_landing(wrap, pose, wrap.last + 1, wrap.last)
        wrap.renumber()

    def _try_landing(self, wrap: Wrap, pose: Pose, station: int, neighbour: int) -> None:
        """Land a station that will be inside the pulley half a step from now."""
        n = self.scene.mesh.stations
        k = station % n
        nodes = self.nodes(k)
        ahead = nodes + 0.5 * (self.slides[k] - self.before[k])
        if height(wrap, pose, ahead) > 0.0:
            return
        land(wrap, pose, k, neighbour % n, nodes, np.linalg.norm(nodes - self.nodes(neighbour % n), axis=1))
        self.stiffness[k] = self.hold_stiffness
        wrap.first, wrap.last = min(wrap.first, station), max(wrap.last, station)

    def _let_go(self, wrap: Wrap, station: int) -> None:
        self.stiffness[station], wrap.way[station] = 0.0, 0.0
        if wrap.last - wrap.first < 3:
            raise RunFailed("the belt leaves a pulley: tension too low for its weight; raise settings.tension")

