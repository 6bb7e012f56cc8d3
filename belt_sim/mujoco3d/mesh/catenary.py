"""A span hanging under its weight, as a catenary between two points or touching two circles."""

import math
from dataclasses import dataclass

import numpy as np

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
    def through(start: np.ndarray, end: np.ndarray, curvature: float) -> "Catenary":
        """From one point to another, x and z [m], to the right of it."""
        run, rise = float(end[0] - start[0]), float(end[1] - start[1])
        half = 0.5 * curvature * run
        return Catenary(start, run, math.asinh(rise / (run * float(_sinhc(half)))), half)

    @staticmethod
    def touching(a: float, head: float, tail: float, curvature: float) -> "Catenary":
        """Touches circles of these radii [m] at 0 and ``a`` from above; from below for negative radii."""
        span = Catenary.through(np.array([0.0, head]), np.array([a, tail]), curvature)
        for _ in range(_TANGENT_SWEEPS):
            ends = [r * np.array([-math.sin(s), math.cos(s)]) for r, s in zip((head, tail), span.slopes, strict=True)]
            span = Catenary.through(ends[0], ends[1] + [a, 0.0], curvature)
        return span

    @property
    def slopes(self) -> tuple[float, float]:
        """Angles of the span above the horizontal at its left and its right end [rad]."""
        return math.atan(math.sinh(self.middle - self.half)), math.atan(math.sinh(self.middle + self.half))

    @property
    def length(self) -> float:
        """[m] along the span."""
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
