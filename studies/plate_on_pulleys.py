"""Where the tilt at the tangent point comes from, by mechanics: python -m studies.plate_on_pulleys, a span at rest.

One belt of triangles between two cylinders, with a short piece of it on either and stations so close that they resolve
the layer. It resists stretching (Green's strain, constant in a triangle) and bending along its fibres out of its plane
(D, by second differences of each line of nodes), and lies on the cylinders without friction. Nothing is said about how
it leaves them. One end is held; at the other the belt's force pulls, and a small moment in its plane. Newton's method
finds the rest. Told are the height of the straight part over the cylinders' common tangent and its tilt where it ends,
both over what the closed form says, l^2/2R and (l^2/2R) M/T, T that of the lines of nodes (there is no other here).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse as sparse
from rich.console import Console
from rich.table import Table
from scipy.sparse.linalg import splu

from belt_sim.case import Case
from belt_sim.jax_setup import jit_float64, prepare
from belt_sim.si import MM, N_PER_MM2
from belt_sim.space.mesh import matching_width, node_lines, zigzag
from studies.paper.case import paper_case

RUNS = ((7.0, 1, 2), (10.0, 4, 2), (10.0, 2, 2), (10.0, 2, 5), (20.0, 2, 2), (40.0, 1, 2))  # N/mm2, mm, nodes across
SPAN, WRAPPED = 1.0, 0.08  # [m], between the axes, and what lies on either cylinder
MOMENT = 0.01  # [F b], small: the law is that of small moments
_SURFACE = 1e12  # [N/m3], pressure per depth in the cylinders
_SWEEPS, _SETTLED = 100, 1e-10  # [m]
_CLEAR = (0.06, 0.3)  # [m] before the tail's axis: where the belt is straight


@dataclass(frozen=True)
class Plate:
    """A belt lying flat: flat [m], shape (n, m, 3), stress-free with x from -WRAPPED; share (m,), of the section;
    chord [m]; case: with its belt and tension."""

    case: Case
    flat: np.ndarray
    share: np.ndarray
    chord: float

    @staticmethod
    def from_case(case: Case, chord: float, across: int) -> "Plate":
        """Stations ``chord`` [m] apart with so many nodes."""
        belt, n = case.belt, round((SPAN + 2 * WRAPPED) / chord) + 1
        y, share = node_lines(matching_width(float(belt.width), chord, across, float(belt.poisson_ratio)), across)
        flat = np.zeros((n, across, 3))
        flat[..., 0], flat[..., 1] = (np.arange(n) * chord - WRAPPED)[:, None], y
        return Plate(case, flat, share, chord)

    @property
    def y(self) -> np.ndarray:
        return self.flat[0, :, 1]

    def initial_places(self) -> np.ndarray:
        """On the cylinders and along their common tangent z = 0, under tension [m], shape (n, m, 3)."""
        strain, radius = float(self.case.settings.tension / self.case.belt.youngs_modulus), self._radius
        places, x = self.flat.copy(), self.flat[..., 0] * (1.0 + strain)
        behind = np.where(x < 0.0, x, np.where(x > SPAN, x - SPAN, 0.0)) / radius
        places[..., 0] = x - behind * radius + radius * np.sin(behind)
        places[..., 2] = radius * (np.cos(behind) - 1.0)
        places[..., 1] *= 1.0 - float(self.case.belt.poisson_ratio) * strain
        return places

    @property
    def _radius(self) -> float:
        return float(self.case.rig.tail_radius)

    def pulls(self, moment: float) -> np.ndarray:
        """Forces [N] on the last station along the tail's circle, with a moment in the belt's plane, shape (m, 3)."""
        end = self.flat[-1, 0, 0] - SPAN
        along = np.array([np.cos(end / self._radius), 0.0, -np.sin(end / self._radius)])
        uneven = 1.0 - moment * self.y / float(self.case.tension_force * (self.share @ self.y**2))
        return (float(self.case.tension_force) * self.share * uneven)[:, None] * along


def rest(plate: Plate, moment: float) -> np.ndarray:
    """Places [m] at which the belt is in equilibrium under its force and a moment [N m], shape (n, m, 3)."""
    places, pulls = plate.initial_places(), plate.pulls(moment)
    parts = [_triangles(plate), _bending(plate), _cylinders(plate)]
    free = np.arange(places[0].size, places.size)

    def energy(x: np.ndarray) -> float:
        return sum(part.energy(x) for part in parts) - float((pulls * x[-1]).sum())

    level = energy(places)
    for _ in range(_SWEEPS):
        g, h = np.zeros(places.size), sparse.csc_matrix((places.size, places.size))
        for part in parts:
            part.add_slope(g, places)
            h = h + part.curvature(places)
        g[-pulls.size :] -= pulls.ravel()
        step = np.zeros(places.size)
        step[free] = -splu(h[free][:, free].tocsc()).solve(g[free])
        share, before, move = 1.0, level, step.reshape(places.shape)
        while share > 1e-4 and (level := energy(places + share * move)) > before + 1e-13 * abs(before):
            share *= 0.5
        places = places + share * move
        if np.abs(move).max() < _SETTLED:
            break
    return places


@dataclass(frozen=True)
class Part:
    """Sum of one energy [J] over pieces of the belt: each of the nodes ``nodes``, shape (k, p), with its own data."""

    of_one: Callable
    nodes: np.ndarray
    data: tuple

    def _pieces(self, places: np.ndarray) -> np.ndarray:
        return places.reshape(-1, 3)[self.nodes]

    @cached_property
    def _all(self) -> tuple[Callable, Callable, Callable]:
        ways = (self.of_one, jax.grad(self.of_one), jax.hessian(self.of_one))
        energy, slope, curvature = (jit_float64(jax.vmap(way)) for way in ways)
        return energy, slope, curvature

    def energy(self, places: np.ndarray) -> float:
        return float(np.asarray(self._all[0](self._pieces(places), *self.data)).sum())

    def add_slope(self, g: np.ndarray, places: np.ndarray) -> None:
        """Add the derivative by the places to ``g``, flat."""
        slopes = np.asarray(self._all[1](self._pieces(places), *self.data))
        np.add.at(g, self._rows().ravel(), slopes.ravel())

    def curvature(self, places: np.ndarray) -> sparse.csc_matrix:
        """Second derivatives by the places."""
        rows = self._rows()
        size = rows.shape[1]
        blocks = np.asarray(self._all[2](self._pieces(places), *self.data))
        i, j = np.repeat(rows, size, axis=1).ravel(), np.tile(rows, (1, size)).ravel()
        return sparse.csc_matrix((blocks.ravel(), (i, j)), shape=(places.size, places.size))

    def _rows(self) -> np.ndarray:
        return (3 * self.nodes[..., None] + np.arange(3)).reshape(len(self.nodes), -1)


def _triangles(plate: Plate) -> Part:
    """Membrane energy: thickness such that all lines together have the belt's section."""
    belt, (n, m, _) = plate.case.belt, plate.flat.shape
    corners = [t for i in range(n - 1) for j in range(m - 1) for t in zigzag(i, j)]
    nodes = np.array([[station * m + line for station, line in t] for t in corners])
    flat = plate.flat.reshape(-1, 3)[nodes][..., :2]
    edges = np.swapaxes(flat[:, 1:] - flat[:, :1], 1, 2)
    nu, thickness = float(belt.poisson_ratio), float(belt.area / (plate.y[0] - plate.y[-1]))
    stiffness = float(belt.youngs_modulus) / (1.0 - nu**2)

    def of_one(x, inverse, volume):
        f = (x[1:] - x[:1]).T @ inverse
        strain = 0.5 * (f.T @ f - jnp.eye(2))
        return 0.5 * volume * stiffness * (nu * jnp.trace(strain) ** 2 + (1.0 - nu) * jnp.sum(strain**2))

    return Part(of_one, nodes, (np.linalg.inv(edges), 0.5 * thickness * np.abs(np.linalg.det(edges))))


def _bending(plate: Plate) -> Part:
    """Plate bending of each line: curvature in the plane of x and z by three neighbours."""
    n, m, _ = plate.flat.shape
    nodes = np.array([[(i + k) * m + j for k in (-1, 0, 1)] for i in range(1, n - 1) for j in range(m)])
    each = float(plate.case.belt.plate_stiffness * plate.case.belt.width) * plate.share * plate.chord

    def of_one(x, stiffness):
        curve = (x[0] - 2.0 * x[1] + x[2])[jnp.array([0, 2])] / plate.chord**2
        return 0.5 * stiffness * jnp.sum(curve**2)

    return Part(of_one, nodes, (np.tile(each, n - 2),))


def _cylinders(plate: Plate) -> Part:
    """Each node pressed into the cylinder on its side of the span."""
    n, m, _ = plate.flat.shape
    axis, radius = np.repeat(np.where(plate.flat[..., 0] < 0.5 * SPAN, 0.0, SPAN), 1, axis=0).ravel(), plate._radius
    area = np.tile(plate.share * float(plate.case.belt.width) * plate.chord, n)

    def of_one(x, at, stiffness):
        deep = jnp.maximum(radius - jnp.hypot(x[0, 0] - at, x[0, 2] + radius), 0.0)
        return 0.5 * stiffness * deep**2

    return Part(of_one, np.arange(n * m)[:, None], (axis, _SURFACE * area))


def compare(tension: float, chord: float, across: int) -> tuple[float, float, float, float]:
    """l^2/2R [m] and tilt [rad] at the tail by the closed form, and what the plate has of either [1]."""
    case = paper_case(tension * N_PER_MM2)
    plate = Plate.from_case(case, chord, across)
    belt, wide = case.belt, float(case.tension_force * case.belt.width) * MOMENT
    lift = float(belt.plate_stiffness / (case.settings.tension * belt.thickness) / (2.0 * case.rig.tail_radius))
    level, bent = rest(plate, 0.0), rest(plate, wide)
    flat = plate.flat[:, 0, 0]
    clear = (flat > SPAN - _CLEAR[1]) & (flat < SPAN - _CLEAR[0])
    tilts = (bent[clear, 0, 2] - bent[clear, -1, 2]) / (plate.y[0] - plate.y[-1])
    tilt = float(np.polyval(np.polyfit(flat[clear], tilts, 1), SPAN))
    wanted = lift * wide / float(case.tension_force * (plate.share @ plate.y**2))
    return lift, wanted, float(level[clear, :, 2].mean()) / lift, tilt / wanted


def main() -> None:
    table = Table("N/mm2", "stations mm", "nodes", "l^2/2R mm", "plate / it", "tilt mrad", "plate / it")
    for tension, chord, across in RUNS:
        lift, tilt, height_share, tilt_share = compare(tension, chord * MM, across)
        table.add_row(
            f"{tension:g}", f"{chord:g}", f"{across}", f"{lift / MM:.4f}", f"{height_share:.4f}", f"{tilt / MM:.4f}",
            f"{tilt_share:.4f}",
        )  # fmt: skip
    Console().print(table)


if __name__ == "__main__":
    prepare()
    main()
