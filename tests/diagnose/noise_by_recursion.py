"""Errors of readings drawn by another route than the diagnosis' own: wander as a first-order recursion in travel."""

import numpy as np

from belt_sim.diagnosis.noise import Levels
from belt_sim.diagnosis.workbench import Workbench


def errors(
    bench: Workbench, count: int, rng, *, white: float = 1.0, wander: float = 1.0, levels: Levels | None = None
) -> np.ndarray:
    """Draws (count, R, S, n) at factors on the stated noise, or at ``levels``, with every nuisance at its prior."""
    samples = bench.samples
    y = np.zeros((count, *samples.y.shape))
    levels = levels or Levels(white=white, wander=wander)
    for s, signal in enumerate(samples.signals):
        white, wander, (length, _) = levels.of_signal(s)
        for r, travel in enumerate(samples.travel):
            y[:, r, s] = (
                wander * signal.wander_sd * _recursion(np.diff(travel) / (length * signal.wander_length), count, rng)
            )
            y[:, r, s] += white * signal.white * rng.standard_normal((count, len(travel)))
    runs = rng.standard_normal((count, *bench.shapes.shape[:2]))
    y += np.einsum("ckr,krsn->crsn", runs, bench.shapes)
    return y + np.einsum("cm,mrsn->crsn", rng.standard_normal((count, len(bench.shared))), bench.shared)


def _recursion(steps: np.ndarray, count: int, rng) -> np.ndarray:
    """A stationary process of unit variance with correlation exp(-step), (count, n)."""
    x = np.empty((count, len(steps) + 1))
    x[:, 0] = rng.standard_normal(count)
    for k, step in enumerate(steps):
        keep = np.exp(-step)
        x[:, k + 1] = keep * x[:, k] + np.sqrt(1.0 - keep**2) * rng.standard_normal(count)
    return x
