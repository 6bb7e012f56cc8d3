"""A belt as MuJoCo sees it: n stations of m nodes, each node a small body on three slides, and what ties the nodes.

Three belts: a chain of particles (rope), a grid of particles tied by bonds (paper Fig. 19), a membrane of flex
triangles. Grid and membrane are as wide as bends like the real strip (calibration.py).
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.errors import InputError
from belt_sim.space.calibration import calibrate, matching_width, zigzag
from belt_sim.space.loop import LaidLoop
from belt_sim.space.mujoco_interface import STRETCH_ONLY
from belt_sim.space.options import Options

_NODE_RADIUS = 2e-3  # [m], only seen


@dataclass(frozen=True)
class Mesh:
    """The nodes of a belt and what its lines carry.

    rest [m], shape (n, m, 3): stress-free places (body positions), of which only the distances count; laid [m], same
    shape: places under tension; line_stiffness [N], shape (m,): EA of each line of nodes; line_y [m], shape (m,);
    mass [kg], shape (m,), a node; chord [m]: rest distance of neighbouring stations of the straight belt; closed: an
    endless belt; residual [1]: amplitude of the residual stress over E; curvature [1/m], shape (links,): natural, in
    the belt's plane (camber), None = straight. Neither changes ``rest``: see ``tie_lengths``.
    """

    rest: np.ndarray
    laid: np.ndarray
    line_stiffness: np.ndarray
    line_y: np.ndarray
    mass: np.ndarray
    chord: float
    closed: bool = True
    residual: float = 0.0
    curvature: np.ndarray | None = None

    @property
    def stations(self) -> int:
        return self.rest.shape[0]

    @property
    def links(self) -> int:
        """Pairs of neighbouring stations."""
        return self.stations if self.closed else self.stations - 1

    @property
    def lines(self) -> int:
        return self.rest.shape[1]

    @property
    def residual_strain(self) -> np.ndarray:
        """Residual stress of the lines over E, shape (m,): mean of residual (1 - 12 y^2/b^2) over what a line carries.

        It has no resultant; of two lines it is 0.
        """
        ends = np.clip((np.arange(self.lines + 1) - 0.5) / max(self.lines - 1, 1), 0.0, 1.0) - 0.5
        return self.residual * (1.0 - 4.0 * np.diff(ends**3) / np.diff(ends))

    def nodes(self, slides: np.ndarray) -> np.ndarray:
        """Places of the nodes [m], shape (m, 3, n), that have slid by ``slides`` [m], shape (n, m, 3)."""
        return np.moveaxis(self.rest + slides, 0, -1)


def tie_lengths(mesh: Mesh, tied: np.ndarray, share: float) -> np.ndarray:
    """Stress-free lengths [m], (k,), of ties between nodes ``tied`` (i m + j), (k, 2), as ``share`` of the camber acts.

    Between two stations a curved belt is a trapezoid: the line at y has the length c (1 - kappa_c y), so that a belt
    with a shorter line at +y bends towards +y (kappa = y'' > 0), and the diagonals are those of a trapezoid with equal
    legs, d^2 = w^2 + l_1 l_2. Residual stress shortens each line by its own strain.
    """
    station, line = np.divmod(tied, mesh.lines)
    y, apart = mesh.line_y[line], np.diff(station, axis=1)[:, 0]
    along = mesh.chord * (1.0 - mesh.residual_strain[line])
    if mesh.curvature is not None:
        link = np.where(apart % mesh.stations == 1, station[:, 0], station[:, 1]) % mesh.links
        along = along * (1.0 - share * mesh.curvature[link][:, None] * y)
    return np.hypot(np.where(apart == 0, 0.0, np.sqrt(along.prod(axis=1))), np.diff(y, axis=1)[:, 0])


def node_lines(width: float, across: int) -> tuple[np.ndarray, np.ndarray]:
    """Lateral positions [m] of the node lines, from +width/2 to -width/2, and each line's share of the section."""
    if across == 1:
        return np.zeros(1), np.ones(1)
    share = np.full(across, 1.0 / (across - 1))
    share[[0, -1]] *= 0.5
    return width * (0.5 - np.arange(across) / (across - 1)), share


def _stretch_stiffness(case: Case) -> float:
    """EA [N]."""
    return float(case.belt.youngs_modulus) * float(case.belt.area)


def rest_chord(case: Case, loop: LaidLoop) -> float:
    """Stress-free distance of neighbouring stations [m]."""
    return loop.chord / (1.0 + float(case.settings.tension) / float(case.belt.youngs_modulus))


def lay_mesh(case: Case, loop: LaidLoop, width: float, across: int, poisson_ratio: float, stiffness: float) -> Mesh:
    """Nodes of a belt of model width ``width`` [m]; the stress-free loop is the laid one shrunk by the strain.

    poisson_ratio: by which the width shrinks; stiffness [N]: EA of all lines.
    """
    y, share = node_lines(width, across)
    strain = float(case.settings.tension) / float(case.belt.youngs_modulus)
    laid = np.empty((len(loop.x), across, 3))
    laid[:, :, 0], laid[:, :, 2] = loop.x[:, None], loop.z[:, None]
    laid[:, :, 1] = y * (1.0 - poisson_ratio * strain)
    rest = laid / (1.0 + strain)
    rest[:, :, 1] = y
    chord = loop.chord / (1.0 + strain)
    mass = float(case.belt.mass_per_length) * chord * share
    return Mesh(rest=rest, laid=laid, line_stiffness=stiffness * share, line_y=y, mass=mass, chord=chord)


def node_name(i: int, j: int) -> str:
    return f"node-{i}-{j}"


def drag_coefficients(mesh: Mesh, along: float, across: float) -> np.ndarray:
    """Damping of the nodes' slides [N s/m], flat, for drags [1/s] per unit of mass along x and across (y, z)."""
    return (mesh.mass[:, None] * np.array([along, across, across]) * np.ones((mesh.stations, 1, 1))).ravel()


def add_nodes(spec: mujoco.MjSpec, mesh: Mesh, *, sites: bool) -> None:
    """One body per node on slides along x, y, z; sites: add a site per node, for bonds."""
    for i in range(mesh.stations):
        for j in range(mesh.lines):
            body = spec.worldbody.add_body(name=node_name(i, j), pos=mesh.rest[i, j])
            body.mass, body.inertia, body.explicitinertial = mesh.mass[j], [1e-9] * 3, True
            body.ipos = [0.0, 0.0, 0.0]  # without it the inertia is not written into the MJCF
            for name, axis in zip("xyz", np.eye(3), strict=True):
                body.add_joint(name=f"{body.name}-{name}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
            if sites:
                body.add_site(name=node_name(i, j), size=[_NODE_RADIUS] * 3)


class Chain:
    """One line of particles; every link is a spatial tendon of stiffness EA / length."""

    def mesh(self, case: Case, loop: LaidLoop, options: Options) -> Mesh:
        belt = case.belt
        return lay_mesh(case, loop, float(belt.width), 1, float(belt.poisson_ratio), _stretch_stiffness(case))

    def tie(self, spec: mujoco.MjSpec, mesh: Mesh, case: Case, options: Options) -> None:
        add_nodes(spec, mesh, sites=True)
        n = mesh.stations
        for i in range(mesh.links):
            add_bond(spec, mesh, (i, 0), ((i + 1) % n, 0), float(mesh.line_stiffness[0]) / mesh.chord)


def add_bond(spec: mujoco.MjSpec, mesh: Mesh, one: tuple[int, int], other: tuple[int, int], stiffness: float) -> None:
    """Tie two nodes by a spring [N/m] that is slack at their stress-free distance."""
    tendon = spec.add_tendon(name=f"bond-{one[0]}-{one[1]}-{other[0]}-{other[1]}")
    tendon.wrap_site(node_name(*one))
    tendon.wrap_site(node_name(*other))
    tendon.stiffness[0] = stiffness
    length = float(np.linalg.norm(mesh.rest[one] - mesh.rest[other]))
    tendon.springlength = [length, length]
    tendon.width, tendon.rgba = 1e-3, [0.75, 0.78, 0.82, 1.0]


class Grid:
    """Every bond is a spatial tendon, a spring along the line between two nodes."""

    def mesh(self, case: Case, loop: LaidLoop, options: Options) -> Mesh:
        m = options.across
        if m < 2:
            raise InputError("model.across", m, "nodes", "a grid needs 2 or more")
        lattice = calibrate(case.belt, rest_chord(case, loop), m, options.bonds)
        return lay_mesh(case, loop, lattice.width, m, lattice.poisson_ratio, lattice.lines)

    def tie(self, spec: mujoco.MjSpec, mesh: Mesh, case: Case, options: Options) -> None:
        add_nodes(spec, mesh, sites=True)
        lattice = calibrate(case.belt, mesh.chord, mesh.lines, options.bonds)
        w = lattice.width / (mesh.lines - 1)
        diagonal = lattice.diagonal / float(np.hypot(mesh.chord, w))
        n, m = mesh.stations, mesh.lines
        for i in range(n):
            on, last = (i + 1) % n, i >= mesh.links
            for j in range(m):
                if not last:
                    add_bond(spec, mesh, (i, j), (on, j), float(mesh.line_stiffness[j]) / mesh.chord)
                if j + 1 == m:
                    continue
                if lattice.transverse:
                    add_bond(spec, mesh, (i, j), (i, j + 1), lattice.transverse / w)
                if lattice.diagonal and not last:
                    add_bond(spec, mesh, (i, j), (on, j + 1), diagonal)
                    add_bond(spec, mesh, (i, j + 1), (on, j), diagonal)


class Membrane:
    """Flex triangles between the stations, diagonals alternating so that the mesh has no preferred side."""

    def mesh(self, case: Case, loop: LaidLoop, options: Options) -> Mesh:
        if options.across < 2:
            raise InputError("model.across", options.across, "nodes", "a membrane needs 2 or more")
        poisson, across = float(case.belt.poisson_ratio), options.across
        width = matching_width(float(case.belt.width), rest_chord(case, loop), across, poisson)
        return lay_mesh(case, loop, width, across, poisson, _stretch_stiffness(case))

    def tie(self, spec: mujoco.MjSpec, mesh: Mesh, case: Case, options: Options) -> None:
        add_nodes(spec, mesh, sites=False)
        flex = spec.add_flex(name="belt", dim=2)
        n, m = mesh.stations, mesh.lines
        flex.vertbody = [node_name(i, j) for i in range(n) for j in range(m)]
        flex.vert = [0.0] * (3 * n * m)
        corners = (v for i in range(mesh.links) for j in range(m - 1) for t in zigzag(i, j) for v in t)
        flex.elem = [station % n * m + line for station, line in corners]
        width = float(mesh.line_y[0] - mesh.line_y[-1])
        flex.young = float(case.belt.youngs_modulus)
        flex.poisson = float(case.belt.poisson_ratio)
        flex.thickness = float(case.belt.area) / width
        flex.elastic2d = STRETCH_ONLY
        flex.contype = flex.conaffinity = 0
        flex.radius = 1e-3
        flex.rgba = [0.75, 0.78, 0.82, 1.0]


#: kind of belt -> where its nodes are (``mesh``), and what holds them together (``tie``)
BELT_MODELS: dict[str, Chain | Grid | Membrane] = {"rope": Chain(), "grid": Grid(), "flex": Membrane()}
