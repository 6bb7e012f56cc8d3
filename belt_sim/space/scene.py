"""A case as a scene: its belt laid round the pulleys as n stations of m nodes, what ties the nodes, and its MJCF.

The loaded belt at rest comes first: stations at equal chords round two pulleys and along two hanging spans.

Each node is a small body on three slides. Three belts: a chain of particles (rope), a grid of particles tied by bonds
(paper Fig. 19), a membrane of flex triangles. Grid and membrane are as wide as bends like the real strip:
studies/notes/three_dimensions.md derives how. The head pulley is driven, the tail pulley is free on its slide and its
axis, both are yawed as commanded.
"""

import itertools
import math
from dataclasses import dataclass, replace
from functools import lru_cache
from types import ModuleType

import jax.numpy as jnp
import mujoco
import numpy as np

from belt_sim.case import Belt, Case
from belt_sim.case import Numbers as Array
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.io import MODEL_FOLDER
from belt_sim.scene_parts import SceneParts
from belt_sim.space.mujoco_interface import STRETCH_ONLY, set_solver
from belt_sim.space.options import RESIDUAL_TORSION, TAIL_MASS, Options
from belt_sim.units import N_PER_MM2

_TANGENT_SWEEPS = 16  # each shrinks the error of the tangent points by (pulley radius) x (curvature of the span)


@dataclass(frozen=True)
class Catenary:
    """z' = sinh(middle + curvature (x - x of the middle)): a belt of uniform weight whose horizontal pull is uniform.

    start, shape (2,): x and z of its left end [m]; run [m]: horizontal distance of its ends; half: curvature run / 2,
    curvature [1/m] = weight per length over horizontal pull, 0 = straight.
    """

    start: np.ndarray
    run: float
    middle: float
    half: float

    @staticmethod
    def from_points(start: np.ndarray, end: np.ndarray, curvature: float) -> "Catenary":
        """From one point to another, x and z [m], to the right of it."""
        run, rise = float(end[0] - start[0]), float(end[1] - start[1])
        half = 0.5 * curvature * run
        return Catenary(start, run, math.asinh(rise / (run * float(_sinhc(half)))), half)

    @property
    def slopes(self) -> tuple[float, float]:
        """Angles of the span above the horizontal at its left and its right end [rad]."""
        return math.atan(math.sinh(self.middle - self.half)), math.atan(math.sinh(self.middle + self.half))

    @property
    def length(self) -> float:
        return self.run * math.cosh(self.middle) * float(_sinhc(self.half))

    def divide(self, links: int) -> np.ndarray:
        """Points that divide the span into so many equal lengths, without its ends, shape (links - 1, 2) [m]."""
        share = np.arange(1, links) / links
        if self.half:
            first, last = math.sinh(self.middle - self.half), math.sinh(self.middle + self.half)
            share = (np.arcsinh(first + share * (last - first)) - self.middle + self.half) / (2.0 * self.half)
        up = share * _sinhc(self.half * share) * np.sinh(self.middle + self.half * (share - 1.0))
        return self.start + self.run * np.stack([share, up], axis=1)


def _sinhc(u) -> np.ndarray:
    u = np.asarray(u, float)
    return np.where(np.abs(u) < 1e-8, 1.0, np.sinh(u) / np.where(u == 0.0, 1.0, u))


def sink_chords(chord: float, radius: float) -> int:
    """Chords, four at most, along which a station sinks; with two more at either end of half a wrap some stay on the
    circle."""
    return min(max(int(0.5 * math.pi * radius / chord) - 3, 1), 4)


def lift(depth: Array, chord: Array, radius: Array, along: Array | None = None) -> Array:
    """Height above the circle [m] of stations that lie ``depth`` [m] behind the place where the belt meets the pulley:
    straight up to half a chord, then over ``sink_chords`` a cubic to 0 with the slope of either side."""
    xp = library_of(depth)
    along = sink_chords(chord, radius) if along is None else along
    straight = radius / xp.cos(xp.minimum(depth, 0.5 * chord) / radius) - radius
    t = xp.clip((depth / chord - 0.5) / along, 0.0, 1.0)
    return straight * (1.0 - smoothstep(t)) + (0.5 * chord**2 / radius * along) * t * (1.0 - t) ** 2


def smoothstep(u: Array) -> Array:
    """From 0 at u = 0 to 1 at 1 and beyond, 3 u^2 - 2 u^3."""
    u = library_of(u).minimum(u, 1.0)
    return u * u * (3.0 - 2.0 * u)


def library_of(values: Array) -> ModuleType:
    """NumPy for its arrays and for plain numbers, jax.numpy for JAX's arrays and tracers."""
    return np if isinstance(values, (np.ndarray, np.generic, float)) else jnp


def chord_angle(square: Array, r1: Array, r2: Array) -> Array:
    """Angle [rad] between places at radii r1, r2 [m]; square [m2]: of their distance in the plane of the pulley."""
    xp = library_of(r1)
    return 2.0 * xp.arcsin(xp.sqrt((square - (r1 - r2) ** 2) / (4.0 * r1 * r2)))


#: sweeps after which, to rounding, the chord, the places near the spans, and the tail pulley's first station are right
_CHORD_SWEEPS, _PATH_SWEEPS, _TURN_SWEEPS = 12, 8, 12


@dataclass(frozen=True)
class LaidLoop:
    """Stations in the order in which the upper span runs from head to tail, where they will run.

    x, z [m], shape (n,); on_head, on_tail: which of them lie on the pulleys, shape (n,); chord [m] between
    neighbours, loaded; radius_head, radius_tail [m]: circles of the stations on the pulleys, wider than the pulleys
    so that a chord stands for its arc.
    """

    x: np.ndarray
    z: np.ndarray
    on_head: np.ndarray
    on_tail: np.ndarray
    chord: float
    radius_head: float
    radius_tail: float


@dataclass(frozen=True)
class HangingBelt:
    """The smooth belt on the pulleys: its spans, the arcs on head and tail and its length, loaded [m]."""

    upper: Catenary
    lower: Catenary
    head: float
    tail: float
    length: float

    @staticmethod
    def from_case(case: Case) -> "HangingBelt":
        """At the case's tension and gravity, on the pulleys themselves."""
        a, curvature = float(case.rig.centre_distance), float(case.sag_curvature)
        head, tail = float(case.rig.head_radius), float(case.rig.tail_radius)
        spans = []
        for radii in ((head, tail), (-head, -tail)):  # each touches both pulleys
            span = Catenary.from_points(np.array([0.0, radii[0]]), np.array([a, radii[1]]), curvature)
            for _ in range(_TANGENT_SWEEPS):
                left, right = (
                    r * np.array([-math.sin(s), math.cos(s)]) for r, s in zip(radii, span.slopes, strict=True)
                )
                span = Catenary.from_points(left, right + np.array([a, 0.0]), curvature)
            spans.append(span)
        upper, lower = spans
        on_head = head * (math.pi + lower.slopes[0] - upper.slopes[0])
        on_tail = tail * (math.pi - lower.slopes[1] + upper.slopes[1])
        return HangingBelt(upper, lower, on_head, on_tail, upper.length + lower.length + on_head + on_tail)


def stations_of(case: Case, dx: float) -> int:
    """Number of stations about ``dx`` [m] apart, an even one."""
    return 2 * round(float(case.rig.belt_length) / dx / 2.0)


def lay_loop(case: Case, dx: float, *, path=lift) -> LaidLoop:
    """The loop at the case's tension and gravity with stations about dx [m] apart; raises InputError when a pulley
    would carry too few; path(depth, chord, radius): height [m] above the circle at which they come and go."""
    rig = case.rig
    longest = min(float(rig.head_radius), float(rig.tail_radius)) / (4.0 if path is lift else 3.0)
    if dx > longest:
        raise InputError("model.dx", dx, "m", f"a pulley carries too few stations: give at most {longest:.3f}")
    n, hanging = stations_of(case, dx), HangingBelt.from_case(case)
    chord = hanging.length / n
    # one station lies where the upper span touches the head; one less than half a chord away from a pulley lies on it:
    # its links press it down
    upper = round(hanging.upper.length / chord)
    on_head = round(hanging.head / chord)
    on_tail = round((hanging.tail - upper * chord + hanging.upper.length) / chord)
    lower = n - on_head - upper - on_tail
    a, curvature = float(rig.centre_distance), float(case.sag_curvature)
    last, first = (-slope for slope in hanging.upper.slopes)
    at_head = (last - hanging.head / float(rig.head_radius), last)
    at_tail = (first, first + hanging.tail / float(rig.tail_radius))
    for _ in range(_CHORD_SWEEPS):
        # stations with this chord everywhere but in the lower span, whose length says how far off it is
        head, tail = (0.5 * chord / math.sin(0.5 * chord / float(r)) for r in (rig.head_radius, rig.tail_radius))
        turn = last + chord / float(rig.head_radius) * np.arange(-on_head, 1)
        behind = _wrap_stations(float(rig.head_radius), turn, 0.0, chord, at_head, path)
        turn = at_tail[0] + chord / float(rig.tail_radius) * np.arange(on_tail + 1)
        bow = 1.0 + (curvature * chord) ** 2 / 24.0  # length of a link's arc over its chord
        for _ in range(_TURN_SWEEPS):
            ahead = _wrap_stations(float(rig.tail_radius), turn, a, chord, at_tail, path)
            over = Catenary.from_points(behind[-1], ahead[0], curvature)
            earlier, turn = turn, turn + (upper * chord * bow - over.length) / tail
            if np.array_equal(turn, earlier):
                break
        under = Catenary.from_points(behind[0], ahead[-1], curvature)
        parts = (behind[-1:], over.divide(upper), ahead, under.divide(lower)[::-1], behind[:-1])
        where = np.repeat([0, 1, 2, 1, 0], [len(p) for p in parts])
        x, z = np.concatenate(parts).T
        loop = LaidLoop(x, z, where == 0, where == 2, chord, radius_head=head, radius_tail=tail)
        before, chord = chord, chord + (under.length / bow - lower * chord) / n
        if chord == before:
            break
    return loop


def _wrap_stations(
    radius: float, turn: np.ndarray, x: float, chord: float, meets: tuple[float, float], path
) -> np.ndarray:
    """Stations on a pulley, shape (k, 2) [m]; turn [rad]: their angles if they all lay on one circle; meets [rad]:
    where the belt comes and goes; the middle station keeps its angle."""
    middle, circle = len(turn) // 2, 0.5 * chord / math.sin(0.5 * chord / radius)
    angle = turn.copy()
    for _ in range(_PATH_SWEEPS):
        r = circle + sum(path(radius * depth, chord, radius) for depth in (angle - meets[0], meets[1] - angle))
        steps = np.concatenate([[0.0], np.cumsum(chord_angle(chord**2, r[1:], r[:-1]))])
        before, angle = angle, turn[middle] + steps - steps[middle]
        if np.array_equal(angle, before):
            break
    return np.stack([x + r * np.sin(angle), r * np.cos(angle)], axis=1)


# The mesh: what its nodes and ties are.

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
    """The energy of a rectangle of two triangles by its squared lengths [N/m3], (2, 6, 6): i + j even and odd."""
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
_CLOSE, _WIDTH_SWEEPS = 1e-12, 60  # of the width


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


@dataclass(frozen=True)
class Mesh:
    """The nodes of a belt and what its lines carry.

    rest [m], (n, m, 3): stress-free places (body positions), of which only the distances count; laid [m]: places under
    tension; line_stiffness [N], line_y [m], (m,): EA and place of each line; mass [kg], (m,), a node; chord [m]: rest
    distance of neighbouring stations; closed: an endless belt; residual [1]: amplitude of the residual stress over E;
    curvature [1/m], a link: camber, None = straight. Neither changes ``rest``: see ``tie_lengths``.
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
    def lines(self) -> int:
        return self.rest.shape[1]

    @property
    def residual_strain(self) -> np.ndarray:
        """Residual stress of the lines over E, (m,): mean of residual (1 - 12 y^2/b^2) over what a line carries."""
        ends = np.clip((np.arange(self.lines + 1) - 0.5) / max(self.lines - 1, 1), 0.0, 1.0) - 0.5
        return self.residual * (1.0 - 4.0 * np.diff(ends**3) / np.diff(ends))


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
        link = np.where(apart % mesh.stations == 1, station[:, 0], station[:, 1]) % len(mesh.curvature)
        along = along * (1.0 - share * mesh.curvature[link][:, None] * y)
    return np.hypot(np.where(apart == 0, 0.0, np.sqrt(along.prod(axis=1))), np.diff(y, axis=1)[:, 0])


def lay_mesh(belt: str, case: Case, loop: LaidLoop, options: Options) -> Mesh:
    """The nodes of a rope, a grid or a membrane ("flex"); the stress-free loop is the laid one shrunk by the strain.
    Raises InputError for a grid or a membrane of one node across."""
    strip, across = case.belt, 1 if belt == "rope" else options.across
    strain = float(case.settings.tension) / float(strip.youngs_modulus)
    chord, whole = loop.chord / (1.0 + strain), float(strip.width)
    width, narrows, stiffness = whole, float(strip.poisson_ratio), float(strip.youngs_modulus) * float(strip.area)
    if belt != "rope" and across < 2:
        name = "grid" if belt == "grid" else "membrane"
        raise InputError("model.across", across, "nodes", f"a {name} needs 2 or more")
    if belt == "grid":
        lattice = calibrate(strip, chord, across, options.bonds)
        width, narrows, stiffness = lattice.width, lattice.poisson_ratio, lattice.lines
    elif belt == "flex":  # at equal section b h, EI of the mesh is that of a strip as wide times ``stiffness_ratio``
        for _ in range(_WIDTH_SWEEPS):
            before, width = width, whole / stiffness_ratio(round(chord / width, 15), across, narrows) ** 0.5
            if abs(width - before) < _CLOSE * whole:
                break

    y, share = np.zeros(1), np.ones(1)
    if across > 1:
        y, share = width * (0.5 - np.arange(across) / (across - 1)), np.full(across, 1.0 / (across - 1))
        share[[0, -1]] *= 0.5
    laid = np.empty((len(loop.x), across, 3))
    laid[:, :, 0], laid[:, :, 2] = loop.x[:, None], loop.z[:, None]
    laid[:, :, 1] = y * (1.0 - narrows * strain)
    rest = laid / (1.0 + strain)
    rest[:, :, 1] = y
    mass = float(strip.mass_per_length) * chord * share
    return Mesh(rest, laid, stiffness * share, line_y=y, mass=mass, chord=chord)


def node_name(i: int, j: int) -> str:
    return f"node-{i}-{j}"


_BELT_COLOUR = [0.75, 0.78, 0.82, 1.0]


def add_belt(spec: mujoco.MjSpec, belt: str, mesh: Mesh, case: Case, options: Options) -> None:
    """One body a node on slides along x, y, z, and what ties them: flex triangles between the stations, whose diagonals
    alternate so that the mesh has no preferred side; or bonds, springs along the line between two nodes (tendons)."""
    n, m, every = mesh.stations, mesh.lines, list(itertools.product(range(mesh.stations), range(mesh.lines)))
    links = n if mesh.closed else n - 1  # pairs of neighbouring stations
    for i, j in every:
        body = spec.worldbody.add_body(name=node_name(i, j), pos=mesh.rest[i, j])
        body.mass, body.inertia, body.explicitinertial = mesh.mass[j], [1e-9] * 3, True
        body.ipos = [0.0, 0.0, 0.0]  # without it the inertia is not written into the MJCF
        for name, axis in zip("xyz", np.eye(3), strict=True):
            body.add_joint(name=f"{body.name}-{name}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        if belt != "flex":
            body.add_site(name=node_name(i, j), size=[2e-3] * 3)

    if belt == "flex":
        flex = spec.add_flex(name="belt", dim=2)
        flex.vertbody, flex.vert = [node_name(i, j) for i, j in every], [0.0] * (3 * n * m)
        corners = (v for i in range(links) for j in range(m - 1) for t in zigzag(i, j) for v in t)
        flex.elem = [station % n * m + line for station, line in corners]
        flex.young, flex.poisson = float(case.belt.youngs_modulus), float(case.belt.poisson_ratio)
        flex.thickness, flex.elastic2d = float(case.belt.area) / float(mesh.line_y[0] - mesh.line_y[-1]), STRETCH_ONLY
        flex.contype, flex.conaffinity, flex.radius, flex.rgba = 0, 0, 1e-3, _BELT_COLOUR
        return

    transverse = diagonal = 0.0
    if m > 1:
        lattice = calibrate(case.belt, mesh.chord, m, options.bonds)
        w = lattice.width / (m - 1)
        transverse, diagonal = lattice.transverse / w, lattice.diagonal / float(np.hypot(mesh.chord, w))
    for i, j in every:
        on, linked, wide = (i + 1) % n, i < links, j + 1 < m
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
            bond.stiffness[0], bond.width, bond.rgba = stiffness, 1e-3, _BELT_COLOUR
            bond.springlength = [float(np.linalg.norm(mesh.rest[one] - mesh.rest[other]))] * 2


STATION, LOOKS = MODEL_FOLDER / "pulley_station.xml", MODEL_FOLDER / "scene_looks.xml"
#: the pulleys' joints in a scene; the nodes follow
HEAD_YAW, HEAD_SPIN, TAIL_SLIDE, TAIL_YAW, TAIL_SPIN = range(5)
STATION_JOINTS = 5
_STAGGER_MARGIN = 6.0  # 0.5 would be the limit of stability
_FACE_MARGIN = 1.5  # pulley face over belt width, only seen
_ROLLER = (0.02, 0.03)  # [m], radius and half height of an edge guide, only seen


@dataclass(frozen=True)
class SceneLayout:
    """What stands still in a run. case: with the gravity of its parts; kind: of belt, "rope", "grid" or "flex";
    early [m]: travel before travel 0."""

    case: Case
    kind: str
    options: Options
    parts: SceneParts
    mesh: Mesh
    loop: LaidLoop
    early: float


def lay_out(case: Case, belt: str, options: Options, parts: SceneParts, *, path=lift) -> SceneLayout:
    """The scene: the belt's nodes laid round the pulleys, which they come onto along ``path``."""
    case = replace(case, rig=replace(case.rig, gravity=parts.gravity))
    loop, early = lay_loop(case, options.dx, path=path), options.run_in
    mesh = lay_mesh(belt, case, loop, options)
    if parts.camber is not None:
        shift = float(np.sign(float(case.settings.direction))) * early  # each link lies where it does at travel 0
        middle = loop.chord * (np.arange(mesh.stations) + 0.5) + shift
        mesh = replace(mesh, curvature=parts.camber(middle % (loop.chord * mesh.stations)))
    if parts.residual:
        mesh = replace(mesh, residual=parts.residual / float(case.belt.youngs_modulus))
        # Strips of a membrane between three or more lines hold each other's width and shear, and twist 9-15 % too
        # easily. Steel edges carry pressure over some mm (studies/notes/shell.md), lines of nodes fold.
        tension, modulus = float(case.settings.tension), float(case.belt.youngs_modulus)
        what = f"effects = flatness: a residual stress of {mesh.residual * modulus / N_PER_MM2:.3g} N/mm2"
        if belt == "flex" and mesh.lines > 2:
            raise CannotRepresent(f"{what} needs model.across = 2 in a membrane; use that, or model=mujoco_grid")
        if RESIDUAL_TORSION * mesh.residual * modulus >= tension:
            shown = f"{tension / N_PER_MM2:g} N/mm2"
            raise CannotRepresent(f"{what} is too much for {shown}: the spans twist by themselves")
        if tension + modulus * mesh.residual_strain.min() <= 0.0:
            slack = f"makes a line of {mesh.lines} slack, which folds"
            raise CannotRepresent(f"{what} {slack}: give a smaller model.across")
    return SceneLayout(case, belt, options, parts, mesh, loop, early)


def build_scene(
    case: Case, belt: str, options: Options, parts: SceneParts, *, path=lift, lean: float | None = None
) -> tuple[mujoco.MjSpec, SceneLayout]:
    """The scene, and its specification, not yet compiled: the belt laid round both pulleys (key frame "laid"), rollers,
    light, and cameras that see the whole machine from the side (sag) and from above; nothing that holds the belt there.

    path: as of ``lay_out``; lean: as of ``set_solver``.
    """
    scene = lay_out(case, belt, options, parts, path=path)
    case, loop = scene.case, scene.loop
    spec = mujoco.MjSpec() if lean is None else mujoco.MjSpec.from_file(str(LOOKS))
    length, width, mass = float(case.rig.centre_distance), float(case.belt.width), station_mass(case, options)
    spec.modelname, spec.stat.extent, far = "belt on two pulleys", 2.0, length + 0.5
    if lean is None:
        spec.worldbody.add_light(pos=[0, -3, 4], dir=[0, 0.6, -0.8], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
        spec.worldbody.add_camera(name="side", pos=[length / 2, -far, 0.2], xyaxes=[1, 0, 0, 0, 0, 1])
        spec.worldbody.add_camera(name="above", pos=[length / 2, 0, far], xyaxes=[1, 0, 0, 0, 1, 0])

    for name, x, surface, radius in (
        ("head", 0.0, scene.parts.head, loop.radius_head), ("tail", length, scene.parts.tail, loop.radius_tail)
    ):  # fmt: skip
        station = mujoco.MjSpec.from_file(str(STATION))
        station.body("carriage").mass = mass
        station.joint("spin").armature = mass * radius**2
        station.geom("shell").size = [radius, 0.5 * _FACE_MARGIN * width, 0.0]
        mark = station.geom("mark")
        mark.size = [0.01, 0.501 * _FACE_MARGIN * width, 0.01]
        mark.pos = [0.0, 0.0, radius - 0.014]  # below the surface: it stops no ray that looks for an edge
        station.site("top").pos, station.site("bottom").pos = [0, 0, radius], [0, 0, -radius]
        half = 0.5 * surface.cant
        station.body("fork").quat = [1.0, 0.0, 0.0, 0.0]
        station.body("pulley").quat = [math.cos(half), math.sin(half), 0.0, 0.0]
        if name == "head":  # it does not slide
            station.delete(station.joint("slide"))
        spec.attach(station, frame=spec.worldbody.add_frame(pos=[x, 0.0, 0.0]), prefix=f"{name}-")

    add_belt(spec, belt, scene.mesh, case, options)
    spec.add_key(name="laid", qpos=laid_coordinates(scene))
    set_solver(spec, options.step, parts.gravity, lean, still="head-yaw" if lean is None else "")
    for k, guide in enumerate(scene.parts.edge_guides):  # only seen here: ``belt.guide_forces``, or contacts
        level = float(case.rig.tail_radius) * (1.0 if guide.span == "upper" else -1.0)
        y = guide.side * (0.5 * width + guide.gap + _ROLLER[0])
        geom = spec.worldbody.add_geom(name=f"guide-{k}", pos=[guide.x, y, level], size=[*_ROLLER, 0.0])
        geom.type, geom.rgba, geom.group = mujoco.mjtGeom.mjGEOM_CYLINDER, [0.9, 0.6, 0.1, 1.0], 1
        geom.contype = geom.conaffinity = 0
    return spec, scene


def laid_coordinates(scene: SceneLayout, head_spin: float = 0.0, tail_spin: float = 0.0) -> np.ndarray:
    """Coordinates of aligned pulleys of these spins [rad], shape (5,), and of the nodes laid round them."""
    joints = np.zeros(STATION_JOINTS)
    joints[HEAD_SPIN], joints[TAIL_SPIN] = head_spin, tail_spin
    return np.concatenate([joints, (scene.mesh.laid - scene.mesh.rest).ravel()])


def station_mass(case: Case, options: Options) -> float:
    """Inertia of the tail pulley [kg], TAIL_MASS or more: it feels the belt's pull one step late, which is stable for
    dt^2 k < 2 m, with k = 2 E b h / L of both spans."""
    stiffness = 2.0 * float(case.belt.youngs_modulus) * float(case.belt.area) / float(case.rig.span_length)
    return max(TAIL_MASS, _STAGGER_MARGIN * options.step**2 * stiffness)
