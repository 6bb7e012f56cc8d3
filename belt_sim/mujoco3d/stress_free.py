"""The stress-free shape of a belt that is curved in its own plane (camber), and its rest lengths during a run.

Between two stations such a belt is a trapezoid: the line at y has the length c (1 - kappa_c y), so that a belt with a
shorter line at +y bends towards +y (kappa = y'' > 0), and the diagonals are those of a trapezoid with equal legs,
d^2 = w^2 + l_1 l_2. MuJoCo takes rest lengths from places, and a loop of such cells closes in space: the belt may fold
along its sections at no cost. The places are found by Newton's method on the distances, from a coil of straight belt.
"""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.errors import SimulationError
from belt_sim.mujoco3d.mesh import Mesh
from belt_sim.mujoco3d.mujoco_interface import Solver

_NEWTON_STEPS = 60
_CLOSE = 1e-9  # of the chord; a belt at 7 N/mm2 is strained by 3e-5
_FOLDING = 1e-16  # weight of the step itself against the distances: folds, which change none, stay small
_STATIONS_A_TURN = 7  # of the coil that the search begins with; with 40 a weld of 2 mrad is too much


def cell_distances(mesh: Mesh, curvature: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numbers (k,) of one and of the other node, and stress-free distances (k,) [m], of all neighbouring nodes.

    Along, across and diagonally; curvature [1/m], shape (links,).
    """
    node = np.arange(mesh.stations * mesh.lines).reshape(mesh.stations, mesh.lines)
    here, there = node[: mesh.links], np.roll(node, -1, axis=0)[: mesh.links]
    along = mesh.chord * (1.0 - curvature[:, None] * mesh.line_y)
    width = -np.diff(mesh.line_y)
    diagonal = np.sqrt(width**2 + along[:, 1:] * along[:, :-1])
    pairs = (
        (here, there, along),
        (node[:, :-1], node[:, 1:], np.broadcast_to(width, node[:, 1:].shape)),
        (here[:, :-1], there[:, 1:], diagonal),
        (here[:, 1:], there[:, :-1], diagonal),
    )
    one, other, length = (np.concatenate([p[k].ravel() for p in pairs]) for k in range(3))
    return one, other, length


def with_curvature(mesh: Mesh, curvature: np.ndarray) -> Mesh:
    """The mesh with natural in-plane curvatures [1/m], shape (links,): only its stress-free places change.

    Raises SimulationError when no such places are found, which takes a camber beyond that of any belt.
    """
    from scipy.sparse import bmat, coo_matrix, identity  # slow to import, and only cambered belts need it
    from scipy.sparse.linalg import spsolve

    (one, other, wanted), places = cell_distances(mesh, curvature), _coil(mesh).reshape(-1, 3)
    row = np.arange(len(wanted))[:, None]
    rows = np.broadcast_to(row, (len(row), 6)).ravel()
    columns = np.concatenate([3 * other[:, None] + np.arange(3), 3 * one[:, None] + np.arange(3)], axis=1)
    for _ in range(_NEWTON_STEPS):
        apart = places[other] - places[one]
        length = np.linalg.norm(apart, axis=1)
        excess = length - wanted
        if np.abs(excess).max() < _CLOSE * mesh.chord:
            return replace(mesh, rest=places.reshape(mesh.rest.shape))
        unit = apart / length[:, None]
        slopes = np.concatenate([unit, -unit], axis=1).ravel()
        slope = coo_matrix((slopes, (rows, columns.ravel())), (len(row), places.size))
        square = bmat([[_FOLDING * identity(places.size), slope.T], [slope, -identity(len(row))]], format="csc")
        step = spsolve(square, np.concatenate([np.zeros(places.size), excess]))
        places -= step[: places.size].reshape(-1, 3)
    raise SimulationError("no stress-free shape of the cambered belt was found: make the camber weaker, or longer")


def _coil(mesh: Mesh) -> np.ndarray:
    """Stress-free places of the straight belt wound up [m]: tight turns give way to camber with the least tilt."""
    if not mesh.closed:
        return mesh.rest.copy()
    turn = 2.0 * np.pi * max(1, round(mesh.stations / _STATIONS_A_TURN)) / mesh.stations
    turned, radius = turn * np.arange(mesh.stations), 0.5 * mesh.chord / np.sin(0.5 * turn)
    places = np.empty_like(mesh.rest)
    places[..., 0], places[..., 2] = radius * np.sin(turned)[:, None], radius * np.cos(turned)[:, None]
    places[..., 1] = mesh.line_y
    return places


@dataclass(frozen=True)
class RestLengths:
    """straight, natural [m], shape (k,): the belt's rest lengths without and with camber, residual stress in both."""

    straight: np.ndarray
    natural: np.ndarray

    @staticmethod
    def from_mesh(mesh: Mesh, solver: Solver) -> "RestLengths":
        """Of a model that was compiled with its camber."""
        stations, line = np.divmod(solver.tied_nodes(), mesh.lines)
        along = mesh.chord * (stations[:, 0] != stations[:, 1])
        across = np.diff(mesh.line_y[line], axis=1)[:, 0]
        straight, curved = np.hypot(along, across), solver.rest_lengths
        if not mesh.residual:
            return RestLengths(straight, curved)
        stretch = 1.0 - mesh.residual_strain[line]
        stressed = np.hypot(along * np.sqrt(stretch.prod(axis=1)), across)
        return RestLengths(stressed, curved + (stressed - straight))

    def lengths(self, share: float) -> np.ndarray:
        """Rest lengths [m] when ``share`` (0..1) of the camber acts, shape (k,)."""
        return self.straight + share * (self.natural - self.straight)
