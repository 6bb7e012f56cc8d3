"""How a belt that resists bending out of its plane leaves a pulley: fibre by fibre, each along a layer of its own.

A fibre under the stress sigma straightens over l = sqrt(D/(sigma h)), D its plate stiffness. So its straight part
passes l^2/2R outside the circle, and has l^3/12R^2 less belt between it and the pulley than a thread would have; where
it comes at a steeper angle than the others, by psi, it is drawn in by (l^2/2R) psi less. Stations 25 mm apart do not
resolve a layer of 7-16 mm. It is a condition, therefore: each line of nodes comes and goes displaced by these two
lengths, counted from their mean over the width, with sigma and psi those of its own links beside the pulley in this
instant. How much the belt tilts there, which span does and what comes of it is left to the scene.
"""

import math
from dataclasses import dataclass

import numpy as np

from belt_sim.case import Case
from belt_sim.mujoco3d.constants import LAYER_TIME, RUNUP_LINKS, SLACKEST_FIBRE
from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.mesh.path import fading, sinking
from belt_sim.mujoco3d.state import Pose, State, Wrap, cylinder_coordinates
from belt_sim.mujoco3d.wrap.touchdown import FIRST, LAST, depth, tangent_angle


@dataclass(frozen=True)
class Layer:
    """The layer of one belt.

    plate [N m]: D of a fibre, per width; thickness [m]; modulus [Pa]; own [1]: share of the torsional stiffness that
    is the fibres' tension, the rest resists that they lift off apart; dt [s]: of a step.
    """

    mesh: Mesh
    plate: float
    thickness: float
    modulus: float
    own: float
    dt: float

    @staticmethod
    def of(case: Case, mesh: Mesh, strength: float, dt: float) -> "Layer":
        """Of a belt of two or more lines; strength [1] multiplies l^2 and l^3."""
        belt = case.belt
        tense = float(case.tension_force) * float(belt.width) ** 2 / 12.0
        still = float(belt.shear_modulus) * float(belt.width) * float(belt.thickness) ** 3 / 3.0
        return Layer(
            mesh=mesh,
            plate=float(belt.plate_stiffness),
            thickness=float(belt.thickness),
            modulus=float(belt.youngs_modulus),
            own=strength * tense / (tense + still),
            dt=dt,
        )

    def follow(self, state: State) -> None:
        """After a step: move the displacements of both pulleys' ends on to what the fibres beside them say."""
        for wrap, pose in zip(state.wraps, state.poses, strict=True):
            for i, end in enumerate((FIRST, LAST)):
                wanted = state.share * self.displacements(state.slides, wrap, pose, end)
                wrap.layer[i] += (wanted - wrap.layer[i]) * min(self.dt / LAYER_TIME, 1.0)

    def displacements(self, slides: np.ndarray, wrap: Wrap, pose: Pose, end: int) -> np.ndarray:
        """How far the lines are outside the circle, and drawn into the pulley, beyond their mean [m], shape (m, 2)."""
        mesh, radius = self.mesh, wrap.surface.radius
        begin = wrap.first - 1 - RUNUP_LINKS if end == FIRST else wrap.last + 1
        stations = np.arange(begin, begin + RUNUP_LINKS + 1) % mesh.stations
        links = np.diff(mesh.at(slides, stations), axis=0)
        strain = (np.linalg.norm(links, axis=2) / mesh.lengths[stations[:-1]]).mean(axis=0) - 1.0
        stress = self.modulus * np.maximum(strain, SLACKEST_FIBRE * max(strain.mean(), 1e-12))
        along = links.sum(axis=0)
        meets = wrap.tangent[(end + 1) // 2]
        steeper = np.array([end * math.remainder(tangent_angle(pose, line) - meets, math.tau) for line in along])
        layer = np.sqrt(self.plate / (stress * self.thickness))
        out = layer**2 / (2.0 * radius)
        drawn = layer**3 / (12.0 * radius**2) - out.mean() * (steeper - steeper.mean())
        both = np.stack([out, drawn], axis=1)
        return self.own * (both - both.mean(axis=0))


def displaced(wrap: Wrap, pose: Pose, mesh: Mesh) -> np.ndarray:
    """By how much the layer displaces the held nodes [m], shape (held, m, 3)."""
    moved = np.zeros((len(wrap.stations), mesh.across, 3))
    zone = min(sinking(mesh.chord, wrap.surface.radius) + 2, len(moved))
    for end in (FIRST, LAST):
        k = np.arange(zone) if end == FIRST else len(moved) - 1 - np.arange(zone)
        moved[k] += displacement(
            wrap, pose, end, depth(wrap, pose, wrap.angle[wrap.stations[k]].mean(axis=1), end), mesh
        )
    return moved


def displacement(wrap: Wrap, pose: Pose, end: int, inside: np.ndarray, mesh: Mesh) -> np.ndarray:
    """By how much the layer at ``end`` displaces stations ``inside`` [m] behind the tangent point, shape (k,), there.

    [m], shape (k, m, 3). Sections that are drawn in unequally turn, and with them the line that they stand on; wholly
    on the straight part of the path, less along the stations that sink onto the circle.
    """
    out, drawn = wrap.layer[(end + 1) // 2].T
    turned = float(drawn @ mesh.line_y) / float(mesh.line_y @ mesh.line_y)
    at = wrap.tangent[(end + 1) // 2]
    local = np.empty((len(inside), len(out), 3))
    local[..., 0] = out * np.sin(at) - end * drawn * np.cos(at)
    local[..., 1] = -turned * inside[:, None]
    local[..., 2] = out * np.cos(at) + end * drawn * np.sin(at)
    return (fading(inside, mesh.chord, wrap.surface.radius)[:, None, None] * local) @ pose.axes.T


def thread_places(wrap: Wrap, pose: Pose, end: int, mesh: Mesh, slides: np.ndarray) -> np.ndarray:
    """Where the station next to ``end`` and the outermost held one would be without the layer [m], shape (2, m, 3)."""
    outer = wrap.first if end == FIRST else wrap.last
    nodes = mesh.at(slides, np.array([outer + end, outer]) % mesh.stations)
    if not wrap.layer.any():
        return nodes
    angle = cylinder_coordinates(nodes, pose)[2].mean(axis=1)
    return nodes - displacement(wrap, pose, end, depth(wrap, pose, angle, end), mesh)
