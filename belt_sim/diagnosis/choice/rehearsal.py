"""The whole procedure rehearsed on campaigns in which nothing is missing: how often would it raise a false alarm?

Noise, nuisances and noise levels are drawn; every replicate goes through the search of decide.py with its hold-out and
plausibility rules, in the linear range, and where that names nothing through the open set.
"""

from dataclasses import dataclass

import numpy as np

from belt_sim.diagnosis.choice.decide import decide
from belt_sim.diagnosis.choice.projected import Projected, Range
from belt_sim.diagnosis.fits.around import Around
from belt_sim.diagnosis.fits.heldout import conditions
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.left_over.null import NoiseSource, NullGains
from belt_sim.diagnosis.left_over.openset import OpenTests

BATCH = 250


@dataclass(frozen=True)
class Rehearsal:
    """In ``count`` replicates, how often a set was named, and how often none was but the open set failed."""

    named: int
    unknown: int
    count: int

    @property
    def rate(self) -> float:
        """Share of replicates that raised a false alarm."""
        return (self.named + self.unknown) / max(self.count, 1)


def rehearse(
    bench: Workbench, near: Around, null: NullGains, critical: float, tests: OpenTests, *, count: int, seed: int
) -> Rehearsal:
    """Decide ``count`` replicates about the fit that ``near`` is around, with thresholds at log p ``critical``."""
    products = _Products(bench, near)
    moments, raw, fails = products.draw(count, tests, np.random.default_rng(seed))
    names = list(products.places)
    shared = Range(
        forward=bench.forward,
        places=products.places,
        positions=products.positions,
        gram=products.gram,
        raw=products.raw,
        out=products.out,
        noise={n: (s := raw[:, o].sum(axis=1)).T @ s / count for n, o in products.out.items()},
        thresholds={n: null.threshold(n, critical) for n in names},
    )
    total, hopeful = moments.sum(axis=1), np.zeros(count, dtype=bool)
    for name in names:
        rows = products.places[name]
        inverse = np.linalg.pinv(shared.whole[np.ix_(rows, rows)], rcond=1e-10, hermitian=True)
        hopeful |= np.einsum("bk,kl,bl->b", total[:, rows], inverse, total[:, rows]) > shared.thresholds[name]
    named = np.zeros(count, dtype=bool)
    for b in np.flatnonzero(hopeful):
        named[b] = bool(decide(Projected(shared, moments[b], raw[b])).ids)
    return Rehearsal(int(named.sum()), int((fails & ~named).sum()), count)


class _Products:
    """Columns of all candidates about a fit, run by run: whitened, and in metres about the mean of each record."""

    def __init__(self, bench: Workbench, near: Around) -> None:
        self.bench = bench
        runs = len(bench.samples.runs)
        self.positions = np.array(sorted(near.slopes), dtype=int)
        shapes = np.stack([near.slopes[k] for k in self.positions])
        where = {int(p): k for k, p in enumerate(self.positions)}
        self.places = {c.id: [where[k] for k in bench.forward.index(c.id)] for c in bench.forward.classes}
        self.white = bench.metric.whiten(shapes).reshape(len(shapes), runs, -1)
        self.lateral = self._centred(shapes)
        self.gram = np.einsum("krm,lrm->rkl", self.white, self.white)
        self.raw = np.einsum("krm,lrm->rkl", self.lateral, self.lateral)
        self.out = conditions(bench)
        self.left = bench.samples.y - near.fit.values

    def draw(self, count: int, tests: OpenTests, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """moments and raw_moments (count, R, K) of readings by chance; which of these fail the open set (count,)."""
        noise, moments, raw, fails = NoiseSource(self.bench, self.left, rng), [], [], []
        runs = len(self.bench.samples.runs)
        for start in range(0, count, BATCH):
            errors = noise.draw(min(BATCH, count - start))
            errors[:, ~np.isfinite(self.bench.fitted.y)] = 0.0
            white = self.bench.metric.whiten(errors)
            fails.append(tests.fails(white))
            white = white.reshape(len(errors), runs, -1)
            moments.append(np.matmul(white.swapaxes(0, 1), self.white.transpose(1, 2, 0)).swapaxes(0, 1))
            bare = self._centred(errors)
            raw.append(np.matmul(bare.swapaxes(0, 1), self.lateral.transpose(1, 2, 0)).swapaxes(0, 1))
        return np.concatenate(moments), np.concatenate(raw), np.concatenate(fails)

    def _centred(self, x: np.ndarray) -> np.ndarray:
        """Lateral readings (B, R, m) of x (B, R, S, n) about the mean of each record."""
        lateral = np.array([s.kind == "lateral" for s in self.bench.samples.signals])
        there = np.isfinite(self.bench.samples.y) & lateral[None, :, None]
        filled = np.where(there, x, 0.0)
        mean = filled.sum(axis=-1, keepdims=True) / np.maximum(there.sum(axis=-1, keepdims=True), 1)
        return np.where(there, filled - mean, 0.0).reshape(*x.shape[:2], -1)
