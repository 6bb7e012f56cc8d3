"""What happens when nothing is missing: a parametric bootstrap of the whole pipeline, noise estimation included.

Readings are simulated with the estimated noise and nuisances; levels are estimated from their repeats again; every
candidate is refitted in its linear range, at every point of its grid; a modifier without a grid, which has no such
range, counts as one more degree of freedom.
Thresholds come from these gains, not from a table.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy import stats

from belt_sim.diagnosis.alternatives import Alternatives
from belt_sim.diagnosis.projection import Projection
from belt_sim.diagnosis.workbench import Workbench

BATCH = 250
_CURRENT = "fitted already"  # family of what is fitted already


@dataclass(frozen=True)
class NullGains:
    """chi2 gains (B,) of every candidate when nothing is missing, and the degrees of freedom of each."""

    gains: Mapping[str, np.ndarray]
    dof: Mapping[str, int]
    _thresholds: dict[tuple[str, float], float] = field(default_factory=dict, init=False, repr=False, compare=False)

    def log_p(self, name: str, gain: float) -> float:
        """log of the probability of so large a gain, by a chi2 law scaled to the bootstrap's mean."""
        return float(stats.chi2.logsf(max(gain, 0.0) / self.inflation(name), max(self.dof[name], 1)))

    def inflation(self, name: str) -> float:
        """Mean bootstrap gain over its degrees of freedom; above 1 where noise levels are uncertain."""
        return max(float(np.mean(self.gains[name])) / max(self.dof[name], 1), 0.5)

    def critical(self, names, level: float) -> float:
        """log p that the smallest p of all ``names`` falls below with probability ``level``."""
        names = [n for n in names if self.dof[n] > 0]
        if not names:
            return -np.inf
        rows = [stats.chi2.logsf(np.maximum(self.gains[n], 0) / self.inflation(n), self.dof[n]) for n in names]
        return float(np.quantile(np.min(rows, axis=0), level))

    def threshold(self, name: str, log_p: float) -> float:
        """The gain of one candidate that has this log p."""
        if self.dof[name] == 0 or not np.isfinite(log_p):
            return float("inf")
        if (name, log_p) not in self._thresholds:
            beyond = float(stats.chi2.isf(np.exp(log_p), self.dof[name]))
            self._thresholds[name, log_p] = beyond * self.inflation(name)
        return self._thresholds[name, log_p]


def null_gains(
    bench: Workbench,
    shapes: Mapping[str, np.ndarray | Alternatives],
    current: np.ndarray,
    base: np.ndarray,
    *,
    count: int,
    seed: int,
    tick=lambda n: None,
) -> NullGains:
    """Bootstrap the gains of candidates on top of the current model.

    shapes: name -> predicted shapes (k, R, S, n) of each candidate in its linear range, or alternatives of which the
    best counts; current (c, R, S, n): shapes of what is fitted already; base (R, S, n): predictions;
    count: replicates; tick(n) is told of progress.
    """
    rng = np.random.default_rng(seed)
    families = {_CURRENT: current.reshape(-1, *base.shape)}
    families |= {n: s.columns if isinstance(s, Alternatives) else s for n, s in shapes.items()}
    choices = {n: s.choices for n, s in shapes.items() if isinstance(s, Alternatives)}
    projection = Projection(bench.fitted, bench.shapes, bench.shared, families, beside=_CURRENT, choices=choices)
    noise = NoiseSource(bench, bench.samples.y - base, rng)
    gains: dict[str, list[np.ndarray]] = {n: [] for n in shapes}
    dof = dict.fromkeys(shapes, 0)
    for start in range(0, count, BATCH):
        size = min(BATCH, count - start)
        errors = noise.draw(size)
        left = projection.sums(errors, bench.finder.many(errors))
        for name in shapes:
            sets = range(len(projection.sets[name]))
            taken, rank = (np.max(x, axis=0) for x in zip(*(left.gains(name, k) for k in sets), strict=True))
            free = bench.forward.modifiers(name) if rank.any() else 0
            dof[name] = max(dof[name], int(rank.max()) + free)
            gains[name].append(taken + (rng.chisquare(free, size) if free else 0.0))
        tick(size)
    return NullGains({n: np.concatenate(g) for n, g in gains.items()}, dof)


class NoiseSource:
    """Draws of everything that may differ when nothing is missing, as readings (count, R, S, n)."""

    def __init__(self, bench: Workbench, errors: np.ndarray, rng: np.random.Generator) -> None:
        """errors (R, S, n): what the current model leaves of the readings."""
        self.bench, self.errors, self.rng = bench, errors, rng

    def draw(self, count: int) -> np.ndarray:
        """Errors at levels that the readings leave possible."""
        bench, rng = self.bench, self.rng
        samples = bench.samples
        levels = bench.finder.draw(self.errors, count, rng)
        white = np.array([s.white for s in samples.signals]) / np.sqrt(samples.per_bin)[:, None]
        errors = white[..., None] * rng.standard_normal((count, *samples.y.shape))
        errors *= levels[:, None, :, 0, None]
        errors += self._wander(levels[..., 1], levels[..., 2])
        runs = rng.standard_normal((count, *bench.shapes.shape[:2]))
        errors += np.einsum("ckr,krsn->crsn", runs, bench.shapes)
        return errors + rng.standard_normal(count)[:, None, None, None] * bench.shared

    def _wander(self, size: np.ndarray, length: np.ndarray) -> np.ndarray:
        """Wander (count, R, S, n) at factors (count, S) on its size and length, by recursion along the travel."""
        samples = self.bench.samples
        stated = np.array([max(s.wander_length, 1e-6) for s in samples.signals])
        steps = np.diff(samples.travel, axis=1)[None, :, None] / (length * stated)[:, None, :, None]
        keep = np.exp(-np.abs(steps))
        fresh = np.sqrt(1.0 - keep**2)
        found = self.rng.standard_normal((len(size), *samples.y.shape))
        for k in range(keep.shape[-1]):
            found[..., k + 1] = keep[..., k] * found[..., k] + fresh[..., k] * found[..., k + 1]
        sd = size * np.array([s.wander_sd for s in samples.signals])
        return sd[:, None, :, None] * found
