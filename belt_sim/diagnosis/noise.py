"""What the instruments may do by themselves: white noise, wander, and errors shared by a run.

The covariance of one run and signal is white^2 I + wander^2 exp(-|ds|/length); zero, gain and setting errors are
shared by a whole run and are carried as nuisances with a prior (metric.py). The stated levels may be off; where runs
were repeated, two factors (white, wander) are read off the differences of repeats, on a fixed grid of values,
never from the residual of a fit.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from belt_sim.campaign import Run, SignalSheet
from belt_sim.diagnosis.samples import Samples

#: stated levels may be off by this much either way (one sigma of their logarithm); data sheets are no better
LEVEL_SPREAD = 0.35
FACTORS = np.exp(np.linspace(np.log(0.4), np.log(2.5), 21))
FLOOR = 1e-9  # [m or rad], so that a signal stated as perfect still has a covariance


@dataclass(frozen=True, kw_only=True)
class Levels:
    """Factors on the stated white noise, wander and wander length, one for all signals or one each; how many repeats
    they came from (0: as stated).
    """

    white: float | tuple[float, ...] = 1.0
    wander: float | tuple[float, ...] = 1.0
    length: float | tuple[float, ...] = 1.0
    repeats: int = 0

    def of(self, s: int) -> tuple[float, float, float]:
        """(white, wander, length) of signal ``s``."""
        white, wander, length = (x[s] if isinstance(x, tuple) else x for x in (self.white, self.wander, self.length))
        return float(white), float(wander), float(length)


def covariance(signal: SignalSheet, travel: np.ndarray, per_bin: float, levels: Levels, s: int = 0) -> np.ndarray:
    """Covariance (n, n) of one run's samples of one signal, the ``s``-th, without what a run shares."""
    white, wander, length = levels.of(s)
    noise = (white * max(signal.white, FLOOR)) ** 2 / per_bin
    return wander**2 * _wander(signal, travel, length) + noise * np.eye(len(travel))


def _wander(signal: SignalSheet, travel: np.ndarray, length: float) -> np.ndarray:
    """Covariance (n, n) of the wander as stated, of ``length`` times the stated length."""
    apart = np.abs(travel[:, None] - travel[None, :])
    return signal.wander_sd**2 * np.exp(-apart / (length * max(signal.wander_length, 1e-6)))


def whitener(cov: np.ndarray) -> np.ndarray:
    """Inverse of the lower Cholesky factor: it turns noise of covariance ``cov`` into unit white noise."""
    lower = cholesky(cov, lower=True)
    return solve_triangular(lower, np.eye(len(cov)), lower=True)


@lru_cache(maxsize=256)
def _wander_modes(signal: SignalSheet, travel: bytes, length: float) -> tuple[np.ndarray, np.ndarray]:
    values, vectors = np.linalg.eigh(_wander(signal, np.frombuffer(travel), length))
    return np.maximum(values, 0.0), vectors


def wander_modes(signal: SignalSheet, travel: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Variances (n,) and modes (n, n), as columns, of a signal's wander of ``length`` times the stated length."""
    return _wander_modes(signal, np.ascontiguousarray(travel).tobytes(), length)


def wander_root(signal: SignalSheet, travel: np.ndarray) -> np.ndarray:
    """A matrix (n, n) that turns unit white noise into the stated wander of a signal."""
    values, vectors = wander_modes(signal, travel, 1.0)
    return vectors * np.sqrt(values)


def repeated_pairs(samples: Samples) -> list[tuple[int, int]]:
    """Indices of runs with the same settings, each later run paired with the first of its kind."""
    first: dict[tuple, int] = {}
    pairs = []
    for k, run in enumerate(samples.runs):
        key = _settings_of(run)
        if key in first:
            pairs.append((first[key], k))
        else:
            first[key] = k
    return pairs


def _settings_of(run: Run) -> tuple:
    return run.tension, run.yaw, run.yaw_head, run.speed, run.direction, run.yaw_at


class LevelFinder:
    """Likelihood of the two factors on the grid, from the differences of repeated runs."""

    def __init__(self, samples: Samples, shapes: np.ndarray) -> None:
        """shapes (K, R, S, n): what else may differ between repeats (settings), in units of one sigma."""
        self.pairs = repeated_pairs(samples)
        self._blocks = [b for pair in self.pairs for b in _blocks(samples, shapes, pair)]

    def __call__(self, y: np.ndarray) -> Levels:
        """Most likely levels for readings y (R, S, n), with the prior that the data sheet is about right."""
        return self.many(y[None])[0]

    def many(self, y: np.ndarray) -> list[Levels]:
        """The same for many sets of readings (B, R, S, n)."""
        if not self._blocks:
            return [Levels()] * len(y)
        best = np.argmin(self._cost(y).reshape(len(y), -1), axis=1)
        grid = [(float(a), float(b)) for a in FACTORS for b in FACTORS]
        return [Levels(white=grid[k][0], wander=grid[k][1], repeats=len(self.pairs)) for k in best]

    def draw(self, y: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
        """Factors (count, 2) on white noise and wander that the readings leave possible, by their probability."""
        if not self._blocks:
            return np.exp(LEVEL_SPREAD * rng.standard_normal((count, 2)).clip(-1.2, 1.2))
        cost = self._cost(y[None])[0]
        weight = np.exp(-0.5 * (cost - cost.min())).ravel()
        cells = rng.choice(weight.size, size=count, p=weight / weight.sum())
        step = np.log(FACTORS[1] / FACTORS[0])
        within = np.exp(step * (rng.random((count, 2)) - 0.5))
        return FACTORS[np.stack(np.unravel_index(cells, cost.shape), axis=1)] * within

    def _cost(self, y: np.ndarray) -> np.ndarray:
        """-2 log probability (B, white factors, wander factors)."""
        prior = np.log(FACTORS) ** 2 / LEVEL_SPREAD**2
        return prior[:, None] + prior[None, :] + sum(block.cost(y) for block in self._blocks)


@dataclass(frozen=True)
class _Block:
    """One signal of one pair: in the eigenvectors of the wander kernel both parts of the noise are diagonal."""

    pair: tuple[int, int]
    signal: int
    keep: np.ndarray
    onto: np.ndarray  # (m, n): rows span what zero, gain and settings cannot explain
    white: np.ndarray  # (m,) variances of the stated white noise in those directions
    wander: np.ndarray

    def cost(self, y: np.ndarray) -> np.ndarray:
        """-2 log likelihood on the grid (B, white factor, wander factor)."""
        a, b = self.pair
        d = (y[:, a, self.signal] - y[:, b, self.signal])[:, self.keep] @ self.onto.T
        f2 = FACTORS**2
        variance = f2[:, None, None] * self.white + f2[None, :, None] * self.wander
        found = d**2 @ (1.0 / variance).reshape(-1, len(self.white)).T
        return found.reshape(-1, len(f2), len(f2)) + np.sum(np.log(variance), axis=-1)


def _blocks(samples: Samples, shapes: np.ndarray, pair: tuple[int, int]) -> list[_Block]:
    """Blocks of a pair of runs sampled at the same travels; other pairs are left out."""
    a, b = pair
    blocks = []
    for s, signal in enumerate(samples.signals):
        keep = np.isfinite(samples.y[a, s]) & np.isfinite(samples.y[b, s])
        travel = samples.travel[a][keep]
        if keep.sum() < 12 or not np.allclose(travel, samples.travel[b][keep]):
            continue
        known = np.concatenate([np.ones((1, keep.sum())), shapes[:, a, s][:, keep]]).T
        rest = np.linalg.svd(known, full_matrices=True)
        free = rest[0][:, np.sum(rest[1] > 1e-12 * rest[1][0]) :]
        values, vectors = np.linalg.eigh(free.T @ _wander(signal, travel, 1.0) @ free)
        white = max(signal.white, FLOOR) ** 2 * (1 / samples.per_bin[a] + 1 / samples.per_bin[b])
        onto = (free @ vectors).T
        blocks.append(_Block(pair, s, keep, onto, np.full(len(values), white), 2 * np.maximum(values, 0.0)))
    return blocks
