"""Readings of campaigns in which nothing is missing, and how much more than expected chance gains of them.

Readings are simulated with nuisances, and with noise at levels that the readings leave possible; they are judged at
those believed in, as the readings themselves are. So how far off belief may be is in the draws.
"""

import numpy as np

from belt_sim.diagnosis.fits.linearisation import Linearisation
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.linear_algebra import inverse_roots
from belt_sim.diagnosis.noise.covariance import SMOOTH

BATCH = 100  # campaigns drawn at a time: 250 of a long record take 0.8 GB more
SINGLE = np.float32  # of what is drawn: rounded, it is another draw a hair's breadth aside


def chance_inflation(bench: Workbench, linearisation: Linearisation, count: int, seed: int) -> float:
    """Mean chi2 that candidates gain by chance, over their degrees of freedom; at least 1, more where noise levels are
    uncertain.

    linearisation: about the fit with nothing missing; count: of simulated campaigns.
    """
    source = NoiseSource(bench, bench.samples.y - linearisation.fit.values, np.random.default_rng(seed))
    columns = [bench.metric.whiten(linearisation.shapes_of(bench, c.id)) for c in bench.forward.classes]
    halves, ranks = zip(*(inverse_roots((c @ c.T)[None]) for c in columns), strict=True) if columns else ((), ())
    total = np.zeros(len(columns))
    for start in range(0, count, BATCH):
        white = bench.metric.whiten(source.draw(min(BATCH, count - start)))
        total += [np.sum((white @ c.T @ half[0]) ** 2) for c, half in zip(columns, halves, strict=True)]
    found = [gain / count / rank[0] for gain, rank in zip(total, ranks, strict=True) if rank[0]]
    return max(1.0, float(np.mean(found))) if found else 1.0


class NoiseSource:
    """Draws of everything that may differ when nothing is missing, as readings (count, R, S, n)."""

    def __init__(self, bench: Workbench, errors: np.ndarray, rng: np.random.Generator) -> None:
        """errors (R, S, n): what the current model leaves of the readings."""
        self.bench, self.errors, self.rng = bench, errors, rng

    def draw(self, count: int) -> np.ndarray:
        """Errors at levels that the readings leave possible, in single precision."""
        bench, rng = self.bench, self.rng
        samples = bench.samples
        levels, smooth = bench.finder.draw(self.errors, count, rng)
        white = np.array([s.white for s in samples.signals]) / np.sqrt(samples.per_bin)[:, None]
        errors = rng.standard_normal((count, *samples.y.shape), SINGLE)
        errors *= (white * levels[:, None, :, 0]).astype(SINGLE)[..., None]
        errors += self._wander(levels[..., 1], levels[..., 2], smooth)
        errors += self._nuisances(count)
        return errors

    def _nuisances(self, count: int) -> np.ndarray:
        """What nuisances of every run, and those that all runs share, make of readings (count, R, S, n)."""
        bench, rng = self.bench, self.rng
        shape, own = bench.samples.y.shape, bench.shapes.astype(SINGLE).swapaxes(0, 1)
        runs = rng.standard_normal((len(own), count, own.shape[1]), SINGLE) @ own.reshape(*own.shape[:2], -1)
        shared = bench.shared.astype(SINGLE).reshape(len(bench.shared), -1)
        found = rng.standard_normal((count, len(shared)), SINGLE) @ shared
        return found.reshape(count, *shape) + runs.swapaxes(0, 1).reshape(count, *shape)

    def _wander(self, size: np.ndarray, length: np.ndarray, smooth: np.ndarray) -> np.ndarray:
        """Wander (count, R, S, n) at factors (count, S) on its size and length, by recursion along the travel; smooth
        (count,): of which kind it is.
        """
        samples = self.bench.samples
        stated = np.array([max(s.wander_length, 1e-6) for s in samples.signals])
        apart, of = np.unique(np.diff(samples.travel, axis=1), axis=0, return_inverse=True)
        steps, of = (apart.T[:, :, None, None] / (length * stated).T).astype(SINGLE), of.reshape(-1)
        sd = (size * np.array([s.wander_sd for s in samples.signals])).astype(SINGLE)
        if not smooth.any():
            return rough_wander(steps, of, sd.T, self.rng).transpose(3, 1, 2, 0)
        found = np.empty((len(size), *samples.y.shape), SINGLE)
        if not smooth.all():
            found[~smooth] = rough_wander(steps[..., ~smooth], of, sd[~smooth].T, self.rng).transpose(3, 1, 2, 0)
        sloped = smooth_wander(steps[..., smooth][:, of].transpose(3, 1, 2, 0), self.rng)
        found[smooth] = sd[smooth][:, None, :, None] * sloped
        return found


def rough_wander(steps: np.ndarray, of: np.ndarray, size: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Wander (n, R, S, B) of ``size`` (S, B) and exponential correlation at ``steps`` (n - 1, U, S, B) in units of its
    length; of (R,): which of the U every run has. What is worked on together lies together.
    """
    keep = np.exp(-steps)
    fresh = np.sqrt(1.0 - keep**2)
    if steps.shape[1] > 1:
        keep, fresh = keep[:, of], fresh[:, of]
    n, _, signals, count = steps.shape
    drawn = rng.standard_normal((count, len(of), signals, n + 1), steps.dtype)
    found = np.ascontiguousarray(drawn.transpose(3, 1, 2, 0))
    for k in range(n):
        found[k + 1] *= fresh[k]
        found[k + 1] += keep[k] * found[k]
    found *= size
    return found


def smooth_wander(steps: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Smooth wander (..., n) of unit size at ``steps`` (..., n - 1) in units of its length, by recursion of its value
    and its slope, which at one place are independent.
    """
    x = SMOOTH * steps
    fade = np.exp(-x)
    value = np.stack([fade * (1.0 + x), fade * x])  # of both before, the value's share of what comes
    slope = np.stack([-fade * x, fade * (1.0 - x)])
    own = np.sqrt(np.maximum(1.0 - np.sum(value**2, axis=0), 0.0))
    common = -np.sum(value * slope, axis=0) / np.where(own > 0.0, own, np.inf)
    rest = np.sqrt(np.maximum(1.0 - np.sum(slope**2, axis=0) - common**2, 0.0))
    now = rng.standard_normal((2, *steps.shape[:-1]), steps.dtype)
    found = [now[0]]
    for k in range(steps.shape[-1]):
        fresh = rng.standard_normal(now.shape, steps.dtype)
        now = np.stack(
            [
                np.sum(value[..., k] * now, axis=0) + own[..., k] * fresh[0],
                np.sum(slope[..., k] * now, axis=0) + common[..., k] * fresh[0] + rest[..., k] * fresh[1],
            ]
        )
        found.append(now[0])
    return np.stack(found, axis=-1)
