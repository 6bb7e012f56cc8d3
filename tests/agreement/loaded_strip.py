"""A hanging strip between clamped ends by finite elements, from its energy: a route that shares nothing with the laws.

Energy 1/2 EI (y'' + Z phi)^2 + 1/2 F y'^2 + 1/2 T phi'^2, Hermite cubics for y and for phi; loads enter by their work
alone. The external moment that holds the run-up is EI kappa there, that of the run-off -EI kappa.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

GAUSS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True)
class LoadedStrip:
    """length [m], force [N], bending, torsion [N m2], sag_curvature [1/m]; an even number of elements."""

    length: float
    force: float
    bending: float
    torsion: float
    sag_curvature: float
    elements: int = 40

    @staticmethod
    def of(span) -> "LoadedStrip":
        return LoadedStrip(
            *(float(v) for v in (span.length, span.force, span.bending, span.torsion, span.sag_curvature))
        )

    def shapes(self, x: float, order: int) -> np.ndarray:
        """Derivative of that order of the Hermite functions at x, shape (2 (elements + 1),)."""
        h = self.length / self.elements
        k = min(int(x / h), self.elements - 1)
        cubics = [(1, 0, -3, 2), (0, h, -2 * h, h), (0, 0, 3, -2), (0, 0, -h, h)]
        row = np.zeros(2 * (self.elements + 1))
        for j, c in enumerate(cubics):
            row[2 * k + j] = np.polynomial.Polynomial(c).deriv(order)(x / h - k) / h**order
        return row

    @cached_property
    def matrix(self) -> np.ndarray:
        """Second derivative of the energy by the nodes' y, y' (first half), phi, phi' (second half)."""
        n, h = 2 * (self.elements + 1), self.length / self.elements
        total = np.zeros((2 * n, 2 * n))
        for k in range(self.elements):
            for at, weight in zip(*GAUSS, strict=True):
                x = (k + 0.5 + 0.5 * at) * h
                value, slope, curved = (self.shapes(x, order) for order in (0, 1, 2))
                none = np.zeros(n)
                bent = np.concatenate([curved, self.sag_curvature * value])
                for stiffness, row in (
                    (self.bending, bent),
                    (self.force, np.concatenate([slope, none])),
                    (self.torsion, np.concatenate([none, slope])),
                ):
                    total += stiffness * 0.5 * h * weight * np.outer(row, row)
        return total

    def point_work(self, x: float, *, force: float = 0.0, couple: float = 0.0) -> np.ndarray:
        """Work of a force towards +y and a couple (x towards y) at x, per unit of every nodal value."""
        work = force * self.shapes(x, 0) + couple * self.shapes(x, 1)
        return np.concatenate([work, np.zeros_like(work)])

    def spread_work(self, *, force: float = 0.0, roll: float = 0.0) -> np.ndarray:
        """Work of what is spread along the span: force [N/m] on y, rolling couple [N m/m] on phi."""
        h, work = self.length / self.elements, 0.0
        for k in range(self.elements):
            for at, weight in zip(*GAUSS, strict=True):
                value = self.shapes((k + 0.5 + 0.5 * at) * h, 0)
                work = work + 0.5 * h * weight * np.concatenate([force * value, roll * value])
        return work

    def held(self, work: np.ndarray) -> tuple[float, float, float]:
        """Curvature at the run-up and the run-off [1/m] and roll of mid-span [rad] between straight clamped ends."""
        n = 2 * (self.elements + 1)
        fixed = [0, 1, n - 2, n - 1, n, 2 * n - 2]  # y, y' and phi at both ends
        free = np.setdiff1d(np.arange(2 * n), fixed)
        values = np.zeros(2 * n)
        values[free] = np.linalg.solve(self.matrix[np.ix_(free, free)], work[free])
        outside = self.matrix @ values - work
        middle = np.concatenate([np.zeros(n), self.shapes(self.length / 2, 0)])
        return outside[n - 1] / self.bending, -outside[1] / self.bending, float(middle @ values)
