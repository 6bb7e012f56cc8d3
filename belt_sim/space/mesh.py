"""A belt as MuJoCo sees it: n stations of m nodes, each node a small body on three slides, and what ties the nodes.

Three belts: a chain of particles (rope), a grid of particles tied by bonds (paper Fig. 19), a membrane of flex
triangles. Grid and membrane are as wide as bends like the real strip: studies/notes/three_dimensions.md derives how.
"""

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np

from belt_sim.case import Belt, Case
from belt_sim.errors import InputError
from belt_sim.space.loop import LaidLoop
from belt_sim.space.mujoco_interface import STRETCH_ONLY
from belt_sim.space.options import Options

_SHEAR_FACTOR = 5.0 / 6.0  # of a rectangular section
_SWEEPS = 40  # the width changes by less than rounding after a dozen


@dataclass(frozen=True)
class Lattice:
    """width b' [m]; lines K, transverse K_t (a bond), diagonal K_d (a bond) [N]: EA; poisson_ratio nu' [1]."""

    width: float
    lines: float
    transverse: float
    diagonal: float
    poisson_ratio: float


def calibrate(belt: Belt, chord: float, across: int, bonds: tuple[str, ...]) -> Lattice:
    """The lattice with these bonds that is as stiff as ``belt``; bonds that are left out carry nothing.

    chord [m]: distance of stations; across: nodes over the width, 2 or more. A row of n = across - 1 cells carries a
    shear g by 2 n K_d sin^2 cos g = 5/6 G b h g; EA = K + n D with D = 2 K_d cos (cos^2 - nu' sin^2), K the sum over
    the lines; EI = b'^2 / 12 (K (1 + 2 / n^2) + n D (1 - 1 / n^2)). Without diagonals there is no shear stiffness.
    """
    n = across - 1
    stretch, bend = float(belt.youngs_modulus) * float(belt.area), float(belt.bending_stiffness)
    shear = _SHEAR_FACTOR * float(belt.shear_modulus) * float(belt.area) if "diagonal" in bonds else 0.0
    tie = float(belt.youngs_modulus) * float(belt.thickness) * chord if "transverse" in bonds else 0.0
    width, lines, diagonal, poisson = float(belt.width), stretch, 0.0, 0.0
    for _ in range(_SWEEPS):
        w = width / n
        length = math.hypot(chord, w)
        cos, sin = chord / length, w / length
        diagonal = shear / (2.0 * n * sin**2 * cos)
        if diagonal:
            poisson = 2.0 * diagonal * length * (sin * cos) ** 2 / (tie * w + 2.0 * diagonal * length * sin**4)
        share = 2.0 * diagonal * cos * (cos**2 - poisson * sin**2)
        lines = stretch - n * share
        width = math.sqrt(12.0 * bend / (lines * (1.0 + 2.0 / n**2) + n * share * (1.0 - 1.0 / n**2)))
    return Lattice(width=width, lines=lines, transverse=tie, diagonal=diagonal, poisson_ratio=poisson)


#: corners a, b, c, d = 0 .. 3 at the ends of the six edges of a quadrilateral: a, b of a station, c, d of the next
EDGES = ((0, 1), (1, 3), (0, 3), (1, 2), (2, 3), (0, 2))
#: by which the corners enter an edge, shape (6, 4)
SIGNS = np.array([[float(k == end) - float(k == start) for k in range(4)] for start, end in EDGES])


def zigzag(i: int, j: int) -> list[list[tuple[int, int]]]:
    """The two triangles of the cell between stations i, i + 1 and lines j, j + 1: (station, line) of their corners."""
    a, b, c, d = (i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1)
    return [[a, b, c], [b, d, c]] if (i + j) % 2 else [[a, b, d], [a, d, c]]


def membrane_law(chord: float, width: float, thickness: float, modulus: float, poisson_ratio: float) -> np.ndarray:
    """The energy of a rectangle of two triangles by its squared lengths [N/m3], shape (2, 6, 6): i + j even and odd.

    chord, width [m]: its sides; thickness [m]; modulus [Pa].
    """
    places = np.array([[0.0, width], [0.0, 0.0], [chord, width], [chord, 0.0]])
    plane = np.array([[1.0, poisson_ratio, 0.0], [poisson_ratio, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - poisson_ratio)]])
    plane *= modulus / (1.0 - poisson_ratio**2)
    found = np.zeros((2, 6, 6))
    for odd in (0, 1):
        for triangle in zigzag(odd, 0):
            corners = [2 * (station - odd) + line for station, line in triangle]
            pairs = [tuple(sorted((corners[i], corners[(i + 1) % 3]))) for i in range(3)]
            edges = [EDGES.index(p) for p in pairs]
            d = np.array([places[b] - places[a] for a, b in pairs])
            strain = np.linalg.inv(2.0 * np.stack([d[:, 0] ** 2, d[:, 1] ** 2, d[:, 0] * d[:, 1]], axis=1))
            found[odd][np.ix_(edges, edges)] += 0.5 * chord * width * thickness * strain.T @ plane @ strain
    return found


_CELLS = 2  # diagonals alternate from cell to cell
_CLOSE = 1e-12  # of the width
_WIDTH_SWEEPS = 60


@lru_cache(maxsize=512)
def stiffness_ratio(slenderness: float, across: int, poisson_ratio: float) -> float:
    """EI of the mesh over that of a strip as wide; slenderness: distance of stations over the width.

    Two neighbouring cells of the zigzag mesh repeat along the belt. Bent to kappa their nodes move by u_x = -kappa x y,
    u_y = kappa x^2 / 2 and by what else repeats with them and makes the energy least: that is P kappa^2 / 2 of it.
    """
    y = 0.5 - np.arange(across) / (across - 1)
    law = membrane_law(slenderness, 1.0 / (across - 1), 1.0, 1.0, poisson_ratio)
    unknowns = 2 * _CELLS * across + 1  # the repeating movement, and a stretch of the whole
    stiffness, load, energy = np.zeros((unknowns, unknowns)), np.zeros(unknowns), 0.0
    for i in range(_CELLS):
        for j in range(across - 1):
            corners = [(i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1)]
            x = np.array([[slenderness * s, y[line]] for s, line in corners])
            moves = np.zeros((4, 2, unknowns))  # of the corners, by the unknowns
            for k, (station, line) in enumerate(corners):
                node = 2 * (station % _CELLS * across + line)
                moves[k, 0, node] = moves[k, 1, node + 1] = 1.0
                moves[k, 0, -1] = x[k, 0]
            bent = np.stack([-x[:, 0] * x[:, 1], 0.5 * x[:, 0] ** 2], axis=1)
            edges = 2.0 * SIGNS @ x  # a squared length grows by this times what its ends move apart
            rows, given = np.einsum("kx,kp,pxu->ku", edges, SIGNS, moves), (edges * (SIGNS @ bent)).sum(axis=1)
            stiffness += rows.T @ law[(i + j) % 2] @ rows
            load += rows.T @ law[(i + j) % 2] @ given
            energy += float(given @ law[(i + j) % 2] @ given)
    least = energy - load @ np.linalg.lstsq(stiffness, load, rcond=1e-12)[0]
    return float(12.0 * least / (_CELLS * slenderness))


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


def _rest_chord(case: Case, loop: LaidLoop) -> float:
    """Stress-free distance of neighbouring stations [m]."""
    return loop.chord / (1.0 + float(case.settings.tension) / float(case.belt.youngs_modulus))


def lay_mesh(case: Case, loop: LaidLoop, width: float, across: int, poisson_ratio: float, lines: float = 0.0) -> Mesh:
    """Nodes of a belt of model width ``width`` [m]; the stress-free loop is the laid one shrunk by the strain.

    poisson_ratio: by which the width shrinks; lines [N]: EA of all lines, 0 = the belt's.
    """
    y, share = np.zeros(1), np.ones(1)
    if across > 1:
        y, share = width * (0.5 - np.arange(across) / (across - 1)), np.full(across, 1.0 / (across - 1))
        share[[0, -1]] *= 0.5
    belt, chord = case.belt, _rest_chord(case, loop)
    strain = float(case.settings.tension) / float(belt.youngs_modulus)
    laid = np.empty((len(loop.x), across, 3))
    laid[:, :, 0], laid[:, :, 2] = loop.x[:, None], loop.z[:, None]
    laid[:, :, 1] = y * (1.0 - poisson_ratio * strain)
    rest = laid / (1.0 + strain)
    rest[:, :, 1] = y
    stiffness = (lines or float(belt.youngs_modulus) * float(belt.area)) * share
    return Mesh(rest, laid, stiffness, line_y=y, mass=float(belt.mass_per_length) * chord * share, chord=chord)


def node_name(i: int, j: int) -> str:
    return f"node-{i}-{j}"


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


class Grid:
    """Every bond is a spatial tendon, a spring along the line between two nodes."""

    def mesh(self, case: Case, loop: LaidLoop, options: Options) -> Mesh:
        m = options.across
        if m < 2:
            raise InputError("model.across", m, "nodes", "a grid needs 2 or more")
        lattice = calibrate(case.belt, _rest_chord(case, loop), m, options.bonds)
        return lay_mesh(case, loop, lattice.width, m, lattice.poisson_ratio, lattice.lines)

    def tie(self, spec: mujoco.MjSpec, mesh: Mesh, case: Case, options: Options) -> None:
        add_nodes(spec, mesh, sites=True)
        n, m, transverse, diagonal = mesh.stations, mesh.lines, 0.0, 0.0
        if m > 1:
            lattice = calibrate(case.belt, mesh.chord, m, options.bonds)
            w = lattice.width / (m - 1)
            transverse, diagonal = lattice.transverse / w, lattice.diagonal / float(np.hypot(mesh.chord, w))
        for i, j in itertools.product(range(n), range(m)):
            on, linked, wide = (i + 1) % n, i < mesh.links, j + 1 < m
            for one, other, stiffness in (
                ((i, j), (on, j), linked * mesh.line_stiffness[j] / mesh.chord),
                ((i, j), (i, j + 1), wide * transverse),
                ((i, j), (on, j + 1), wide * linked * diagonal),
                ((i, j + 1), (on, j), wide * linked * diagonal),
            ):
                if not stiffness:
                    continue
                bond = spec.add_tendon(name=f"bond-{one[0]}-{one[1]}-{other[0]}-{other[1]}")
                bond.wrap_site(node_name(*one))
                bond.wrap_site(node_name(*other))
                bond.stiffness[0], bond.width, bond.rgba = stiffness, 1e-3, [0.75, 0.78, 0.82, 1.0]
                bond.springlength = [float(np.linalg.norm(mesh.rest[one] - mesh.rest[other]))] * 2


class Chain(Grid):
    """One line of particles; every link is a spatial tendon of stiffness EA / length."""

    def mesh(self, case: Case, loop: LaidLoop, options: Options) -> Mesh:
        return lay_mesh(case, loop, float(case.belt.width), 1, float(case.belt.poisson_ratio))


class Membrane:
    """Flex triangles between the stations, diagonals alternating so that the mesh has no preferred side."""

    def mesh(self, case: Case, loop: LaidLoop, options: Options) -> Mesh:
        if options.across < 2:
            raise InputError("model.across", options.across, "nodes", "a membrane needs 2 or more")
        poisson, across, whole = float(case.belt.poisson_ratio), options.across, float(case.belt.width)
        # At equal section b h, EI of the mesh is that of a strip of its own width times ``stiffness_ratio``.
        width = before = whole
        for _ in range(_WIDTH_SWEEPS):
            slenderness = round(_rest_chord(case, loop) / width, 15)
            before, width = width, whole / stiffness_ratio(slenderness, across, poisson) ** 0.5
            if abs(width - before) < _CLOSE * whole:
                break
        return lay_mesh(case, loop, width, across, poisson)

    def tie(self, spec: mujoco.MjSpec, mesh: Mesh, case: Case, options: Options) -> None:
        add_nodes(spec, mesh, sites=False)
        flex, n, m = spec.add_flex(name="belt", dim=2), mesh.stations, mesh.lines
        flex.vertbody = [node_name(i, j) for i in range(n) for j in range(m)]
        flex.vert = [0.0] * (3 * n * m)
        corners = (v for i in range(mesh.links) for j in range(m - 1) for t in zigzag(i, j) for v in t)
        flex.elem = [station % n * m + line for station, line in corners]
        flex.young, flex.poisson = float(case.belt.youngs_modulus), float(case.belt.poisson_ratio)
        flex.thickness, flex.elastic2d = float(case.belt.area) / float(mesh.line_y[0] - mesh.line_y[-1]), STRETCH_ONLY
        flex.contype, flex.conaffinity, flex.radius, flex.rgba = 0, 0, 1e-3, [0.75, 0.78, 0.82, 1.0]


#: kind of belt -> where its nodes are (``mesh``), and what holds them together (``tie``)
BELT_MODELS: dict[str, Grid | Membrane] = {"rope": Chain(), "grid": Grid(), "flex": Membrane()}
