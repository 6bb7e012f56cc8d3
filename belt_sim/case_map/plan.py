"""Where the cases of a map lie: on a grid, or spread evenly over its box; any stretch of them without the others."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from belt_sim.case_map.axes import Axis


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The cases of a map. axes: what varies; cases: how many of them, spread over the box of the axes by Sobol's
    sequence (scrambled by ``seed``), None for the grid of all values, the last axis running fastest."""

    axes: tuple[Axis, ...]
    cases: int | None = None
    seed: int = 0

    @property
    def shape(self) -> tuple[int, ...]:
        """Values of each axis of a grid."""
        return tuple(len(a.values) for a in self.axes)

    @property
    def count(self) -> int:
        """Cases in all."""
        return int(np.prod(self.shape, dtype=object)) if self.cases is None else self.cases

    def stretch(self, start: int, stop: int) -> np.ndarray:
        """Values of the axes, as people write them, of the cases from ``start`` up to ``stop``, shape (axes, n)."""
        if self.cases is None:
            where = np.unravel_index(np.arange(start, stop), self.shape)
            return np.stack([a.values[k] for a, k in zip(self.axes, where, strict=True)])
        return _placed(self.axes, _sobol(len(self.axes), self.seed, start, stop))


def _placed(axes: Sequence[Axis], shares: np.ndarray) -> np.ndarray:
    return np.stack([a.at(column) for a, column in zip(axes, shares.T, strict=True)])


def _sobol(dimensions: int, seed: int, start: int, stop: int) -> np.ndarray:
    """Points start .. stop of Sobol's sequence, shape (n, dimensions)."""
    from scipy.stats import qmc  # slow to import

    engine = qmc.Sobol(dimensions, seed=seed)
    if start:
        engine.fast_forward(start)
    with warnings.catch_warnings():  # of a count that is no power of two
        warnings.simplefilter("ignore", UserWarning)
        return engine.random(stop - start)
