"""Bond stiffnesses and mesh widths at which particles in a lattice, or linear triangles, are as stiff as the strip.

Lattice. A cell is ``chord`` long and w wide, with a longitudinal bond on either side, a transverse bond and both
diagonals (length l, cos = chord / l, sin = w / l). For a lengthwise strain e and a lateral strain t of the cell the
diagonals stretch by e cos^2 + t sin^2, for a shear g by +- g sin cos. With EA of a bond written K:

- shear: a row of n cells carries 2 n K_d sin^2 cos g, set equal to 5/6 G b h g;
- free lateral strain: t = -nu' e, nu' = 2 K_d l sin^2 cos^2 / (K_t w + 2 K_d l sin^4);
- stretch: EA = K + n D, D = 2 K_d cos (cos^2 - nu' sin^2), K the sum over the lines;
- bending: EI = b'^2 / 12 (K (1 + 2 / n^2) + n D (1 - 1 / n^2)), b' = n w the width of the lattice.

Two lines (n = 1): the diagonals do not stretch in pure bending, and K b'^2 / 4 = EI.

Membrane. Triangles of constant strain are too stiff in bending, by how much depends on their shape. Two neighbouring
cells of the zigzag mesh repeat along the belt. Bent to a curvature kappa their nodes move by u_x = -kappa x y,
u_y = kappa x^2 / 2 and by what else repeats with them and makes the energy least; that energy over P kappa^2 / 2 is
the stiffness.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from belt_sim.case import Belt

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
    """The lattice with these bonds that stands for ``belt``; bonds that are left out carry nothing.

    chord [m]: distance of stations; across: nodes over the width, 2 or more. Without diagonals EA and EI (for
    sections that stay square) still hold, and there is no shear stiffness.
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


def matching_width(width: float, chord: float, across: int, poisson_ratio: float) -> float:
    """Width [m] of a mesh with stations ``chord`` [m] apart that bends like a strip of ``width`` [m].

    At equal section b h, EI of the mesh is that of a strip of its own width times ``stiffening``.
    """
    found = width
    for _ in range(_WIDTH_SWEEPS):
        before, found = found, width / stiffness_ratio(round(chord / found, 15), across, poisson_ratio) ** 0.5
        if abs(found - before) < _CLOSE * width:
            break
    return found


@lru_cache(maxsize=512)
def stiffness_ratio(slenderness: float, across: int, poisson_ratio: float) -> float:
    """EI of the mesh over that of a strip as wide; slenderness: distance of stations over the width."""
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
