"""What happens when nothing is missing: a parametric bootstrap of the whole pipeline, noise estimation included.

Readings are simulated with the estimated noise and nuisances; levels are estimated from their repeats again; every
candidate is refitted in its linear range; a modifier, which has none, counts as one more degree of freedom.
Thresholds come from these gains, not from a table.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import stats

from belt_sim.diagnosis.noise import Levels, wander_root
from belt_sim.diagnosis.workbench import Workbench

BATCH = 250
FAINT = 1e-2  # a shape this small, in sigma, cannot be seen in these readings


@dataclass(frozen=True)
class NullGains:
    """chi2 gains (B,) of every candidate when nothing is missing, and the degrees of freedom of each."""

    gains: Mapping[str, np.ndarray]
    dof: Mapping[str, int]

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
        return float(stats.chi2.isf(np.exp(log_p), self.dof[name]) * self.inflation(name))


def null_gains(
    bench: Workbench,
    shapes: Mapping[str, np.ndarray],
    current: np.ndarray,
    base: np.ndarray,
    *,
    count: int,
    seed: int,
    tick=lambda n: None,
) -> NullGains:
    """Bootstrap the gains of candidates on top of the current model.

    shapes: name -> predicted shapes (k, R, S, n) of each candidate in its linear range; current (c, R, S, n): shapes
    of what is fitted already; base (R, S, n): predictions; count: replicates; tick(n) is told of progress.
    """
    rng = np.random.default_rng(seed)
    names = list(shapes)
    gains: dict[str, list[np.ndarray]] = {n: [] for n in names}
    cache: dict[tuple[float, float], list[np.ndarray]] = {}
    noise = NoiseSource(bench, rng)
    dof: dict[str, int] = {}
    for start in range(0, count, BATCH):
        size = min(BATCH, count - start)
        errors, found = noise.draw(size)
        if bench.levels.repeats:
            found = [bench.finder(base + e) for e in errors]
        rows = {n: np.empty(size) for n in names}
        flat = np.where(np.isfinite(bench.fitted.y), errors, 0.0).reshape(size, -1)
        for key in {(lv.white, lv.wander) for lv in found}:
            members = np.array([k for k, lv in enumerate(found) if (lv.white, lv.wander) == key])
            if key not in cache:
                cache[key] = _projectors(bench, key, shapes, current)
            for name, projector in zip(names, cache[key], strict=True):
                free = bench.forward.modifiers(name) if len(projector) else 0
                dof[name] = max(dof.get(name, 0), len(projector) + free)
                by_chance = rng.chisquare(free, len(members)) if free else 0.0
                rows[name][members] = np.sum((flat[members] @ projector.T) ** 2, axis=1) + by_chance
        for n in names:
            gains[n].append(rows[n])
        tick(size)
    return NullGains({n: np.concatenate(g) for n, g in gains.items()}, dof)


class NoiseSource:
    """Draws of everything that may differ when nothing is missing, as readings (count, R, S, n)."""

    def __init__(self, bench: Workbench, rng: np.random.Generator) -> None:
        self.bench, self.rng = bench, rng
        self.white, self.wander = {}, {}
        for r in range(len(bench.samples.runs)):
            for s, signal in enumerate(bench.samples.signals):
                travel = bench.samples.travel[r]
                per_bin = bench.samples.per_bin[r]
                self.white[r, s] = signal.white / np.sqrt(per_bin)
                self.wander[r, s] = wander_root(signal, travel)

    def draw(self, count: int) -> tuple[np.ndarray, list[Levels]]:
        """Errors at levels that the readings leave possible, and the levels that the pipeline believes in."""
        bench, rng = self.bench, self.rng
        shape = (count, *bench.samples.y.shape)
        errors = np.zeros(shape)
        off = bench.finder.draw(bench.samples.y, count, rng)
        for (r, s), root in self.wander.items():
            wander = rng.standard_normal((count, root.shape[1])) @ root.T
            white = self.white[r, s] * rng.standard_normal((count, shape[-1]))
            errors[:, r, s] = off[:, :1] * white + off[:, 1:] * wander
        runs = rng.standard_normal((count, *bench.shapes.shape[:2]))
        errors += np.einsum("ckr,krsn->crsn", runs, bench.shapes)
        errors += rng.standard_normal(count)[:, None, None, None] * bench.shared
        return errors, [bench.levels] * count


def _projectors(bench: Workbench, key: tuple[float, float], shapes, current) -> list[np.ndarray]:
    """Rows (k, R*S*n) whose squared products with raw errors sum to a candidate's gain."""
    metric = bench.metric
    if key != (bench.levels.white, bench.levels.wander):
        metric = bench.metric_at(Levels(white=key[0], wander=key[1], repeats=bench.levels.repeats))
    inside = _basis(metric.whiten(current)) if len(current) else np.empty((0, 1))
    rows = []
    for columns in shapes.values():
        white = metric.whiten(columns)
        if len(inside):
            white = white - (white @ inside.T) @ inside
        rows.append(metric.matrix_transpose(_basis(white)).reshape(-1, bench.samples.y.size))
    return rows


def _basis(rows: np.ndarray) -> np.ndarray:
    """Orthonormal rows spanning ``rows``, without directions too faint to matter."""
    if not len(rows):
        return rows
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    seen = size[:, 0] > FAINT
    scaled = rows[seen] / size[seen]
    if not len(scaled):
        return scaled
    _, strength, directions = np.linalg.svd(scaled, full_matrices=False)
    return directions[strength > 1e-6 * strength[0]]
