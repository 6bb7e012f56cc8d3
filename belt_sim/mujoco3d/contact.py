"""The belt on both pulleys during a run: landing, holding, slipping, letting go.

The discrete integrator takes the belt's force at the end of a step from its tangent at the beginning. A link that turns
by an angle d within a step then seems shorter by d^2 / 2, up to a fifth of its strain on a pulley. So the springs of
landed stations carry, beyond the true holding force, the opposite of that missing tension (``misread``), and friction
is compared with what is left. Both edges are misread alike: a belt that sticks does not notice.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from belt_sim.errors import RunFailed
from belt_sim.mujoco3d.belt import Mesh
from belt_sim.mujoco3d.friction import Friction
from belt_sim.mujoco3d.hold import HEAD, TAIL, Pose, Wrap, anchor, height, land
from belt_sim.mujoco3d.scene import Scene
from belt_sim.mujoco3d.surface import PulleySurface


@dataclass
class Contact:
    """Views of MuJoCo's arrays for the nodes, shape (n, m, 3), and the two wraps.

    position [m] = rest + slides; before: slides at the beginning of the step; spring, stiffness: qpos_spring [m]
    and jnt_stiffness [N/m]; spin [rad]: of both pulleys at the last ``settle``; loads: force along x [N], moment
    about the axis and about z [N m] that the belt does to the head and the tail pulley.
    """

    scene: Scene
    slides: np.ndarray
    before: np.ndarray
    spring: np.ndarray
    stiffness: np.ndarray
    wraps: tuple[Wrap, Wrap]
    friction: Friction
    spin: list[float]
    loads: list[tuple[float, float, float]]

    @staticmethod
    def begin(scene: Scene, data: mujoco.MjData, poses: tuple[Pose, Pose], friction: Friction) -> "Contact":
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
            slides=data.qpos[base:].reshape(shape),
            before=data.qpos[base:].reshape(shape).copy(),
            spring=model.qpos_spring[base:].reshape(shape),
            stiffness=model.jnt_stiffness[base:].reshape(shape),
            wraps=(wraps[HEAD], wraps[TAIL]),
            friction=friction,
            spin=[pose.spin for pose in poses],
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

    def settle(self, poses: tuple[Pose, Pose], travel_sign: float) -> None:
        """After a step: measure the forces, let slip, land and let go.

        travel_sign: +1 or -1 along station numbers, 0 at rest before the run (both ends then land and let go).
        """
        rest = self.scene.mesh.rest
        for which, (wrap, pose) in enumerate(zip(self.wraps, poses, strict=True)):
            k = wrap.stations
            slides = self.slides[k]
            force = self.stiffness[k] * (self.spring[k] - slides)
            points = rest[k] + slides
            parts = wrap.components(pose, force)
            surplus = misread(self.scene.mesh, len(k), pose.spin - self.spin[which], wrap.surface.radius)
            self.spin[which] = pose.spin
            self.loads[which] = self._load(wrap, pose, points, force)
            if not self.friction.sticks:
                self.friction.apply(wrap, pose, which, points, parts, surplus, self.stiffness)
            pressure = (parts - surplus)[..., 0].sum(axis=1)
            self._change_ends(wrap, pose, float(pressure[0]), float(pressure[-1]), travel_sign)

    def _load(self, wrap: Wrap, pose: Pose, points: np.ndarray, force: np.ndarray) -> tuple[float, float, float]:
        """Force on a pulley along x [N], moment about its axis and about z [N m].

        The moment about the axis is that of the links that come and go, from their true strain.
        """
        arm = points - pose.centre
        moment_z = -float(np.sum(arm[..., 0] * force[..., 1] - arm[..., 1] * force[..., 0]))
        axis, mesh, moment = pose.axes[:, 1], self.scene.mesh, 0.0
        for end, station in ((0, wrap.first - 1), (-1, wrap.last + 1)):
            link = self.nodes(station % mesh.stations) - points[end]
            length = np.sqrt(np.einsum("ij,ij->i", link, link))
            free = mesh.lengths[min(station, station + 2 * end + 1) % mesh.stations]
            pull = (mesh.line_stiffness * (1.0 / free - 1.0 / length))[:, None] * link
            moment += moment_about(axis, arm[end], pull)
        return -float(force[..., 0].sum()), moment, moment_z

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
        self.stiffness[k] = self.friction.hold_stiffness
        wrap.first, wrap.last = min(wrap.first, station), max(wrap.last, station)

    def _let_go(self, wrap: Wrap, station: int) -> None:
        self.stiffness[station], wrap.push[station], wrap.sliding[station] = 0.0, 0.0, False
        wrap.held_for[station] = 0
        if wrap.last - wrap.first < 3:
            raise RunFailed("the belt leaves a pulley: tension too low for its weight; raise settings.tension")


def moment_about(axis: np.ndarray, arms: np.ndarray, forces: np.ndarray) -> float:
    """axis . sum of arm x force [N m]; arms [m], forces [N], shape (m, 3). numpy.cross would take 50 us a call."""
    t = arms.T @ forces
    return float(axis @ (t[1, 2] - t[2, 1], t[2, 0] - t[0, 2], t[0, 1] - t[1, 0]))


def misread(mesh: Mesh, held: int, turn: float, radius: float) -> np.ndarray:
    """What the springs of landed stations carry beyond the holding force [N]: outwards, along axis, along turn.

    Links between landed stations that turn by ``turn`` [rad] in a step lack the tension e = k turn^2 / 2 with k from
    mesh.turn_stiffness, and the section the lateral force mesh.turn_pressure turn^2 / 2; shape (held, m, 3).
    """
    strain = np.full(held + 1, 0.5 * turn**2)
    strain[[0, -1]] = 0.0
    missing = strain[:, None] * mesh.turn_stiffness
    beside = 0.5 * (missing[1:] + missing[:-1])
    squeeze = 0.5 * (strain[1:] + strain[:-1])[:, None] * mesh.turn_pressure
    return np.stack([-beside * mesh.chord / radius, -squeeze, missing[1:] - missing[:-1]], axis=-1)
