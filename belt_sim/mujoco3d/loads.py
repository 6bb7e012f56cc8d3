"""Forces and springs on the nodes: belt and weight, torsion, edge guides, loads at a place or all along."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from belt_sim.case import Belt
from belt_sim.mujoco3d.mesh import Mesh
from belt_sim.mujoco3d.mujoco_4 import Solver, Springs
from belt_sim.mujoco3d.options import RESIDUAL_TORSION
from belt_sim.mujoco3d.state import TAIL, Pose, RunState, Wrap
from belt_sim.mujoco3d.wrap import FIRST, LAST, depth
from belt_sim.scene_parts import GuideRoller, Push


class NodeLoad(Protocol):
    """Something that acts on the nodes during a step."""

    def forces(self, state: RunState, springs: Springs) -> np.ndarray:
        """[N], shape (n, m, 3); springs: those that hold the nodes during the step."""


def pull_on_nodes(mesh: Mesh, solver: Solver, slides: np.ndarray, gravity: float) -> np.ndarray:
    """Forces of belt and weight [N] on nodes at ``slides``, shape (n, m, 3); gravity [m/s2]."""
    pull = solver.elastic_forces(slides)
    pull[..., 2] -= mesh.mass * gravity
    return pull


def loads_on_pulleys(
    mesh: Mesh, slides: np.ndarray, pull: np.ndarray, wraps: tuple[Wrap, Wrap], poses: tuple[Pose, Pose]
) -> np.ndarray:
    """Force along x [N], moment about the axis and about z [N m] that the belt does to either pulley, shape (2, 3)."""
    loads = np.empty((2, 3))
    for which, (wrap, pose) in enumerate(zip(wraps, poses, strict=True)):
        k = wrap.stations
        arms, forces = (mesh.at(slides, k) - pose.centre).reshape(-1, 3), pull[k].reshape(-1, 3)
        t = arms.T @ forces  # arm x force by hand: numpy.cross takes 50 us
        moment = np.array((t[1, 2] - t[2, 1], t[2, 0] - t[0, 2], t[0, 1] - t[1, 0]))
        loads[which] = forces[:, 0].sum(), moment @ pose.axes[:, 1], moment[2]
    return loads


@dataclass(frozen=True)
class Torsion:
    """Couples on the sections of the free spans: C phi'', phi the roll of a section.

    The strip has F b^2 / 12 + G b h^3 / 3; lines at y_j with shares w_j of the section have F sum(w_j y_j^2), and C is
    the rest: 8 % (40 N/mm2) to 16 % (7 N/mm2) for two lines. A twist also stretches the edges, by (y phi')^2 / 2. Of
    the strip that is a couple E h b^5 phi'^3 / 360, of lines EA phi'^3 (sum(w_j y_j^4) - sum(w_j y_j^2)^2) / 2, nothing
    for two. tense [1/m], own [1/m], still [N/m]: b^2 / 12, sum(w_j y_j^2) and G b h^3 / 3, all over chord b'^2, b' the
    outer lines' distance; locked [N/m]: of the residual stress, what the lines have by themselves, as ``still`` has the
    strip's; cubic [N/m3]: what the lines lack of the couple, as a force on them over the cube of what
    a link of the one rises more than the other; lean [m], shape (n,): height of the first line above the last in the
    stress-free places.

    A strip does not roll where it meets the pulley. The last landed station is up to half a chord before or behind that
    place, so that the next station rolls too little or too much, and the entry moment of a belt that tilts swings with
    every landing. The couples on that station are those of a link as long as its distance from the right place.
    """

    mesh: Mesh
    tense: float
    own: float
    still: float
    cubic: float
    lean: np.ndarray
    locked: float

    @staticmethod
    def of(belt: Belt, mesh: Mesh) -> "Torsion":
        """Of a belt of two or more lines."""
        width, thickness = float(belt.width), float(belt.thickness)
        share = mesh.line_stiffness / mesh.line_stiffness.sum()
        apart = float(mesh.line_y[0] - mesh.line_y[-1])
        per = 1.0 / (mesh.chord * apart**2)
        lacking = width**4 / 180.0 - float(share @ mesh.line_y**4) + float(share @ mesh.line_y**2) ** 2
        stiffness = float(belt.youngs_modulus) * float(belt.area)
        stress_free = RESIDUAL_TORSION * stiffness * mesh.residual * width**2 / 12.0
        return Torsion(
            mesh=mesh,
            tense=per * width**2 / 12.0,
            own=per * float(share @ mesh.line_y**2),
            still=per * (float(belt.shear_modulus) * width * thickness**3 / 3.0 - stress_free),
            cubic=0.5 * stiffness * lacking / (apart * (mesh.chord * apart) ** 3),
            lean=mesh.rest[:, 0, 2] - mesh.rest[:, -1, 2],
            locked=per * stiffness * float((share * mesh.line_y**2) @ mesh.residual_strain),
        )

    def forces(self, state: RunState, springs: Springs) -> np.ndarray:
        """The couples as vertical forces on the outer nodes; landed sections do not roll."""
        tension = max(-0.5 * float(state.loads[TAIL, 0]), 0.0)
        whole = tension * self.tense + self.still
        roll = self.lean + state.slides[:, 0, 2] - state.slides[:, -1, 2]
        bent = -2.0 * roll
        bent[1:] += roll[:-1]
        bent[:-1] += roll[1:]
        bent[0] += roll[-1]
        bent[-1] += roll[0]
        twisted = self.cubic * (np.roll(roll, -1) - roll) ** 3
        couple = (whole - tension * self.own - self.locked) * bent + twisted - np.roll(twisted, 1)
        for wrap in state.wraps:
            couple[wrap.stations] = 0.0
        for wrap, pose in zip(state.wraps, state.poses, strict=True):
            for landed, end in ((wrap.first, FIRST), (wrap.last, LAST)):
                couple[(landed + end) % len(roll)] -= whole * self._end(wrap, pose, landed, end, roll)
        forces = np.zeros_like(state.slides)
        forces[:, 0, 2], forces[:, -1, 2] = couple, -couple
        return forces

    def _end(self, wrap: Wrap, pose: Pose, landed: int, end: int, roll: np.ndarray) -> float:
        """How much longer or shorter the link from the last landed station to the first free one is to seem.

        Its roll [m] times (chord / distance from the right place - 1).
        """
        n, chord = len(roll), self.mesh.chord
        last = landed % n
        behind = float(depth(wrap, pose, 0.5 * (wrap.angle[last, 0] + wrap.angle[last, -1]), end))
        behind = min(max(behind, -0.5 * chord), 0.5 * chord)
        return (chord / (chord - behind) - 1.0) * float(roll[(landed + end) % n] - roll[last])


@dataclass(frozen=True)
class EdgeGuideSprings:
    """Springs on the lateral slides of free nodes near a roller, in the solver's metric like those of landed ones.

    A roller takes hold of the stations within one chord of it, by a share that falls linearly with the distance, so
    that stations come and go without a jolt.
    """

    guides: tuple[GuideRoller, ...]
    mesh: Mesh

    def press(self, state: RunState, springs: Springs) -> None:
        """A free node y beyond its place gets a spring that pushes the edge back to the roller's face."""
        if not self.guides:
            return
        mesh = self.mesh
        held = np.zeros(mesh.stations, bool)
        for wrap in state.wraps:
            held[wrap.stations] = True
        places = (mesh.rest + state.slides).mean(axis=1)
        stiffness, push = np.zeros((2, mesh.stations))
        for guide in self.guides:
            near = np.clip(1.0 - np.abs(places[:, 0] - guide.x) / mesh.chord, 0.0, 1.0)
            near[held | ((places[:, 2] > 0.0) != (guide.span == "upper"))] = 0.0
            beyond = guide.side * places[:, 1] - guide.gap
            stiff = guide.stiffness * near * (beyond > 0.0)
            stiffness += stiff
            push -= stiff * guide.side * beyond
        k = np.flatnonzero(stiffness)
        springs.stiffness[k, :, 1] = stiffness[k, None] * (mesh.line_stiffness / mesh.line_stiffness.sum())
        springs.rest[k, :, 1] = state.slides[k, :, 1] + (push[k] / stiffness[k])[:, None]


@dataclass(frozen=True)
class PushLoads:
    """Stations within one chord of a place take its load, by a share that falls linearly with the distance."""

    pushes: tuple[Push, ...]
    mesh: Mesh

    def forces(self, state: RunState, springs: Springs) -> np.ndarray:
        """Forces over the lines as the belt's stiffness is, couples as forces along the belt that grow with y."""
        mesh, forces = self.mesh, np.zeros_like(state.slides)
        middle = (mesh.rest + state.slides).mean(axis=1)
        line = mesh.line_stiffness / mesh.line_stiffness.sum()
        arm = line * mesh.line_y / max(float(line @ mesh.line_y**2), 1e-12)
        ahead = np.roll(middle, -1, axis=0) - np.roll(middle, 1, axis=0)
        ahead *= np.sign(ahead[:, :1]) / np.linalg.norm(ahead, axis=1)[:, None]
        for push in self.pushes:
            near = np.clip(1.0 - np.abs(middle[:, 0] - push.x) / mesh.chord, 0.0, 1.0)
            near[(middle[:, 2] > 0.0) != (push.span == "upper")] = 0.0
            near *= state.share / near.sum()
            forces[..., 1] += near[:, None] * (push.across * line)
            forces += near[:, None, None] * (push.along * line - push.couple * arm)[:, None] * ahead[:, None]
        return forces


@dataclass(frozen=True)
class DistributedLoads:
    """across [m/s2]: pull of the weight towards +y, on all nodes, of which the pulleys hold those that lie on them;
    roll [N]: couple per metre about +x on what is above the axes."""

    across: float
    roll: float
    mesh: Mesh

    def forces(self, state: RunState, springs: Springs) -> np.ndarray:
        """The couple as vertical forces on the outer lines."""
        mesh, forces = self.mesh, np.zeros_like(state.slides)
        forces[..., 1] = state.share * self.across * mesh.mass
        if self.roll:
            upper = (mesh.rest + state.slides)[..., 2].mean(axis=1) > 0.0
            lift = state.share * self.roll * mesh.chord / float(mesh.line_y[0] - mesh.line_y[-1])
            forces[upper, 0, 2] += lift
            forces[upper, -1, 2] -= lift
        return forces
