"""The belt on both pulleys during a run: landing, holding, slipping, letting go.

The forces between belt and pulleys are those that balance the belt's pull where it is (forces.py), not those of the
springs: the springs also make up for what the integrator's tangent misses of links that turn within a step.
"""

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from belt_sim.errors import RunFailed
from belt_sim.mujoco3d.forces import elastic_forces
from belt_sim.mujoco3d.friction import Friction
from belt_sim.mujoco3d.hold import HEAD, TAIL, Pose, Wrap
from belt_sim.mujoco3d.scene import Scene
from belt_sim.mujoco3d.touchdown import FIRST, LAST, anchor, catches, land, lets_go, sink, tangent_angle
from belt_sim.scene_parts import PulleySurface

_NEITHER = -1
_OUTSIDE = 4  # free stations over which the direction of a span is taken
_CALM = 0.02  # [s], over which it is averaged: waves pass


@dataclass
class Contact:
    """Views of MuJoCo's arrays for the nodes, shape (n, m, 3), and the two wraps.

    position [m] = rest + slides; spring, stiffness: qpos_spring [m] and jnt_stiffness [N/m], hold_stiffness of those
    that are held; slips: friction may be finite (while the laid belt settles it sticks); spin [rad]: of both pulleys at
    the last ``follow``; waits: the pulley whose belt does not slide in this step. When both belts slide as a whole they
    take turns, since each reckons with the other standing still; loads: force along x [N], moment about the axis and
    about z [N m] that the belt does to the head and the tail pulley.
    """

    scene: Scene
    data: mujoco.MjData
    slides: np.ndarray
    spring: np.ndarray
    stiffness: np.ndarray
    wraps: tuple[Wrap, Wrap]
    friction: Friction
    hold_stiffness: float
    slips: bool
    spin: list[float]
    waits: int
    loads: list[tuple[float, float, float]]

    @staticmethod
    def begin(
        scene: Scene, data: mujoco.MjData, poses: tuple[Pose, Pose], friction: Friction, hold_stiffness: float
    ) -> "Contact":
        """The stations that were laid on the pulleys are held there."""
        model, mesh, base = scene.model, scene.mesh, scene.base
        n, m = mesh.stations, mesh.across
        wraps = []
        for which, surface, circle in (
            (HEAD, scene.parts.head, scene.loop.radius_head),
            (TAIL, scene.parts.tail, scene.loop.radius_tail),
        ):
            plain = PulleySurface(radius=surface.radius)
            wraps.append(Wrap.empty(plain, circle - surface.radius, n, m))
            on = np.flatnonzero(scene.loop.on_head if which == HEAD else scene.loop.on_tail)
            jump = np.flatnonzero(np.diff(on) > 1)
            wraps[-1].first = int(on[jump[0] + 1]) - n if len(jump) else int(on[0])
            wraps[-1].last = int(on[jump[0]]) if len(jump) else int(on[-1])
            wraps[-1].renumber()
        shape = (n, m, 3)
        contact = Contact(
            scene=scene,
            data=data,
            slides=data.qpos[base:].reshape(shape),
            spring=model.qpos_spring[base:].reshape(shape),
            stiffness=model.jnt_stiffness[base:].reshape(shape),
            wraps=(wraps[HEAD], wraps[TAIL]),
            friction=friction,
            hold_stiffness=hold_stiffness,
            slips=False,
            spin=[pose.spin for pose in poses],
            waits=_NEITHER,
            loads=[(0.0, 0.0, 0.0)] * 2,
        )
        for wrap, pose in zip(contact.wraps, poses, strict=True):
            for k in wrap.stations:
                anchor(wrap, pose, k, contact.nodes(k))
            contact.stiffness[wrap.stations] = hold_stiffness
            contact._meet(wrap, pose, 1.0)
            for end in (FIRST, LAST):
                contact._change_end(wrap, pose, end)
        for wrap, pose in zip(contact.wraps, poses, strict=True):
            contact.spring[wrap.stations] = wrap.place(pose) - mesh.rest[wrap.stations]
        contact._pull(poses)
        return contact

    def _meet(self, wrap: Wrap, pose: Pose, share: float) -> None:
        """Move the places where the belt meets a pulley by ``share`` of the way to where the spans' directions say."""
        n = self.scene.mesh.stations
        for i, (inner, outer) in enumerate(
            ((wrap.first - 1, wrap.first - _OUTSIDE), (wrap.last + 1, wrap.last + _OUTSIDE))
        ):
            along = (self.nodes(outer % n) - self.nodes(inner % n)).sum(axis=0) * (-1.0 if i == 0 else 1.0)
            ahead = tangent_angle(pose, along) - wrap.tangent[i]
            wrap.tangent[i] += share * math.remainder(ahead, 2.0 * math.pi)

    def nodes(self, station: int) -> np.ndarray:
        """Positions of a station's nodes [m], shape (m, 3)."""
        return self.scene.mesh.rest[station] + self.slides[station]

    def shape_pulleys(self) -> None:
        """From now on stations land on the pulleys as they are; until travel 0 they land on plain cylinders."""
        for wrap, surface in zip(self.wraps, (self.scene.parts.head, self.scene.parts.tail), strict=True):
            wrap.surface = surface

    def follow(self, poses: tuple[Pose, Pose]) -> None:
        """Before a step: the springs' rest positions are where the anchors will be at its end."""
        for which, (wrap, pose) in enumerate(zip(self.wraps, poses, strict=True)):
            moved = abs(pose.spin - self.spin[which]) * wrap.surface.radius
            self.spin[which] = pose.spin
            for end in (FIRST, LAST):
                sink(wrap, pose, end, self.scene.mesh.chord, moved)
            k = wrap.stations
            self.spring[k] = wrap.place(pose) - self.scene.mesh.rest[k]

    def settle(self, poses: tuple[Pose, Pose], speed: float) -> None:
        """After a step: put held nodes on their anchors, find the forces, let slip, land and let go.

        speed [m/s]: of the belt.
        """
        scene = self.scene
        for wrap in self.wraps:
            self.slides[wrap.stations] = self.spring[wrap.stations]
        pull = self._pull(poses)
        if self.friction.acts:
            sliding = all(wrap.sliding.mean() > 0.5 for wrap in self.wraps)
            self.waits = _NEITHER if not sliding else TAIL if self.waits == HEAD else HEAD
        for which, (wrap, pose) in enumerate(zip(self.wraps, poses, strict=True)):
            if self.slips and self.waits != which and self.friction.acts:
                holding = -wrap.components(pose, pull[wrap.stations])
                holding[..., 0] -= scene.mesh.mass * speed**2 / wrap.surface.radius
                self.friction.apply(wrap, which, holding)
            self._meet(wrap, pose, scene.model.opt.timestep / _CALM)
            for end in (FIRST, LAST):
                self._change_end(wrap, pose, end)

    def _pull(self, poses: tuple[Pose, Pose]) -> np.ndarray:
        """Forces of belt and weight on the nodes [N], shape (n, m, 3); notes what they do to the pulleys."""
        scene = self.scene
        pull = elastic_forces(scene.model, self.data, scene.base, self.slides.shape)
        pull[..., 2] -= scene.mesh.mass * scene.parts.gravity
        for which, (wrap, pose) in enumerate(zip(self.wraps, poses, strict=True)):
            k = wrap.stations
            self.loads[which] = self._load(pose, scene.mesh.rest[k] + self.slides[k], pull[k])
        return pull

    def _load(self, pose: Pose, points: np.ndarray, pull: np.ndarray) -> tuple[float, float, float]:
        """Force on a pulley along x [N], moment about its axis and about z [N m], of nodes that pull at points."""
        arms, forces = (points - pose.centre).reshape(-1, 3), pull.reshape(-1, 3)
        t = arms.T @ forces  # arm x force by hand: numpy.cross takes 50 us
        moment = np.array((t[1, 2] - t[2, 1], t[2, 0] - t[0, 2], t[0, 1] - t[1, 0]))
        return float(forces[:, 0].sum()), float(moment @ pose.axes[:, 1]), float(moment[2])

    def _change_end(self, wrap: Wrap, pose: Pose, end: int) -> None:
        """Land a station or let one go."""
        mesh = self.scene.mesh
        outer = wrap.first if end == FIRST else wrap.last
        nodes = self.nodes((outer + end) % mesh.stations)
        if catches(wrap, pose, end, nodes, mesh.chord):
            station = land(wrap, pose, end, nodes, self.nodes(outer % mesh.stations), mesh.chord)
            self.stiffness[station] = self.hold_stiffness
        elif lets_go(wrap, pose, end, mesh.chord):
            self._let_go(wrap, outer % mesh.stations)
            wrap.first, wrap.last = (wrap.first + 1, wrap.last) if end == FIRST else (wrap.first, wrap.last - 1)
            wrap.renumber()

    def _let_go(self, wrap: Wrap, station: int) -> None:
        self.stiffness[station], wrap.way[station] = 0.0, 0.0
        if wrap.last - wrap.first < 3:
            raise RunFailed("the belt leaves a pulley: tension too low for its weight; raise settings.tension")
