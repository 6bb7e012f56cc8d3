"""A belt as MuJoCo sees it: n stations of m nodes, each node a small body on three slides."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.mujoco3d.mesh.loop import Loop
from belt_sim.mujoco3d.options import Options

_NODE_RADIUS = 2e-3  # [m], only seen


@dataclass(frozen=True)
class Mesh:
    """The nodes of a belt and what its lines carry.

    rest [m], shape (n, m, 3): stress-free places (body positions), of which only the distances count; laid [m], same
    shape: places under tension; line_stiffness [N], shape (m,): EA of each line of nodes; line_y [m], shape (m,);
    mass [kg], shape (m,), a node; chord [m]: rest distance of neighbouring stations of the straight belt; closed: an
    endless belt.
    """

    rest: np.ndarray
    laid: np.ndarray
    line_stiffness: np.ndarray
    line_y: np.ndarray
    mass: np.ndarray
    chord: float
    closed: bool = True

    @property
    def stations(self) -> int:
        return self.rest.shape[0]

    @property
    def links(self) -> int:
        """Pairs of neighbouring stations."""
        return self.stations if self.closed else self.stations - 1

    @cached_property
    def lengths(self) -> np.ndarray:
        """Stress-free lengths of the lines between station i and the next [m], shape (links, m)."""
        there = np.roll(self.rest, -1, axis=0)
        return np.linalg.norm(there - self.rest, axis=2)[: self.links]

    @property
    def across(self) -> int:
        return self.rest.shape[1]

    def at(self, slides: np.ndarray, stations) -> np.ndarray:
        """Positions [m] of the nodes of stations when all have slid by ``slides`` [m], shape (n, m, 3)."""
        return self.rest[stations] + slides[stations]


class BeltModel(Protocol):
    """Builds one kind of belt."""

    def mesh(self, case: Case, loop: Loop, options: Options) -> Mesh:
        """Where the nodes are."""

    def tie(self, spec: mujoco.MjSpec, mesh: Mesh, case: Case, options: Options) -> None:
        """Add what holds the nodes together."""


def lines(width: float, across: int) -> tuple[np.ndarray, np.ndarray]:
    """Lateral positions [m] of the node lines, from +width/2 to -width/2, and each line's share of the section."""
    if across == 1:
        return np.zeros(1), np.ones(1)
    share = np.full(across, 1.0 / (across - 1))
    share[[0, -1]] *= 0.5
    return width * (0.5 - np.arange(across) / (across - 1)), share


def rest_chord(case: Case, loop: Loop) -> float:
    """Stress-free distance of neighbouring stations [m]."""
    return loop.chord / (1.0 + float(case.settings.tension) / float(case.belt.youngs_modulus))


def lay(case: Case, loop: Loop, width: float, across: int) -> Mesh:
    """Nodes of a belt of model width ``width`` [m]; the stress-free loop is the laid one shrunk by the strain."""
    y, share = lines(width, across)
    strain = float(case.settings.tension) / float(case.belt.youngs_modulus)
    laid = np.empty((len(loop.x), across, 3))
    laid[:, :, 0], laid[:, :, 2] = loop.x[:, None], loop.z[:, None]
    laid[:, :, 1] = y * (1.0 - float(case.belt.poisson_ratio) * strain)
    rest = laid / (1.0 + strain)
    rest[:, :, 1] = y
    chord = loop.chord / (1.0 + strain)
    stiffness = float(case.belt.youngs_modulus) * float(case.belt.area) * share
    mass = float(case.belt.mass_per_length) * chord * share
    return Mesh(rest=rest, laid=laid, line_stiffness=stiffness, line_y=y, mass=mass, chord=chord)


def node_name(i: int, j: int) -> str:
    return f"node-{i}-{j}"


def drag(mesh: Mesh, along: float, across: float) -> np.ndarray:
    """Damping of the nodes' slides [N s/m], flat, for drags [1/s] per unit of mass along x and across (y, z)."""
    return (mesh.mass[:, None] * np.array([along, across, across]) * np.ones((mesh.stations, 1, 1))).ravel()


def add_nodes(spec: mujoco.MjSpec, mesh: Mesh, *, sites: bool) -> None:
    """One body per node on slides along x, y, z; sites: add a site per node, for bonds."""
    for i in range(mesh.stations):
        for j in range(mesh.across):
            body = spec.worldbody.add_body(name=node_name(i, j), pos=mesh.rest[i, j])
            body.mass, body.inertia, body.explicitinertial = mesh.mass[j], [1e-9] * 3, True
            body.ipos = [0.0, 0.0, 0.0]  # without it the inertia is not written into the MJCF
            for axis in np.eye(3):
                body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
            if sites:
                body.add_site(name=node_name(i, j), size=[_NODE_RADIUS] * 3)
