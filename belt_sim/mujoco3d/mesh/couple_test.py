"""The in-plane bending stiffness of a strip of linear triangles, by a couple test of its repeating cells.

Triangles of constant strain are too stiff in bending, by how much depends on their shape. Two neighbouring cells of the
zigzag mesh repeat along the belt. Bent to a curvature kappa their nodes move by u_x = -kappa x y, u_y = kappa x^2 / 2
and by what else repeats with them and makes the energy least; that energy over P kappa^2 / 2 is the stiffness.
"""

from functools import lru_cache

import numpy as np

_CELLS = 2  # diagonals alternate from cell to cell
_CLOSE = 1e-12  # of the width
_SWEEPS = 60


def zigzag(i: int, j: int) -> list[list[tuple[int, int]]]:
    """The two triangles of the cell between stations i, i + 1 and lines j, j + 1: (station, line) of their corners."""
    a, b, c, d = (i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1)
    return [[a, b, c], [b, d, c]] if (i + j) % 2 else [[a, b, d], [a, d, c]]


def matching_width(width: float, chord: float, across: int, poisson_ratio: float) -> float:
    """Width [m] of a mesh with stations ``chord`` [m] apart that bends like a strip of ``width`` [m].

    At equal section b h, EI of the mesh is that of a strip of its own width times ``stiffening``.
    """
    found = width
    for _ in range(_SWEEPS):
        before, found = found, width / stiffening(round(chord / found, 15), across, poisson_ratio) ** 0.5
        if abs(found - before) < _CLOSE * width:
            break
    return found


@lru_cache(maxsize=512)
def stiffening(slenderness: float, across: int, poisson_ratio: float) -> float:
    """EI of the mesh over that of a strip as wide; slenderness: distance of stations over the width."""
    y = 0.5 - np.arange(across) / (across - 1)
    law = np.array([[1.0, poisson_ratio, 0.0], [poisson_ratio, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - poisson_ratio)]])
    law /= 1.0 - poisson_ratio**2
    unknowns = 2 * _CELLS * across + 1  # the repeating movement, and a stretch of the whole
    stiffness, load, energy = np.zeros((unknowns, unknowns)), np.zeros(unknowns), 0.0
    for i in range(_CELLS):
        for j in range(across - 1):
            for corners in zigzag(i, j):
                x = np.array([[slenderness * s, y[line]] for s, line in corners])
                strain, area = _strains(x)
                moves = np.zeros((6, unknowns))
                for k, (station, line) in enumerate(corners):
                    node = 2 * (station % _CELLS * across + line)
                    moves[2 * k, node] = moves[2 * k + 1, node + 1] = 1.0
                    moves[2 * k, -1] = x[k, 0]
                bent = np.stack([-x[:, 0] * x[:, 1], 0.5 * x[:, 0] ** 2], axis=1).ravel()
                rows, given = strain @ moves, strain @ bent
                stiffness += area * rows.T @ law @ rows
                load += area * rows.T @ law @ given
                energy += area * float(given @ law @ given)
    least = energy - load @ np.linalg.lstsq(stiffness, load, rcond=1e-12)[0]
    return float(12.0 * least / (_CELLS * slenderness))


def _strains(x: np.ndarray) -> tuple[np.ndarray, float]:
    """Strains (xx, yy, 2 xy) per unit of the corners' displacements, shape (3, 6), and the area; x (3, 2)."""
    (x1, y1), (x2, y2), (x3, y3) = x
    twice = (x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1)
    b, c = np.array([y2 - y3, y3 - y1, y1 - y2]) / twice, np.array([x3 - x2, x1 - x3, x2 - x1]) / twice
    rows = np.zeros((3, 6))
    rows[0, 0::2], rows[1, 1::2], rows[2, 0::2], rows[2, 1::2] = b, c, c, b
    return rows, 0.5 * abs(twice)
