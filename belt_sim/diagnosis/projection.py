"""Likelihood by projections: what columns and readings weigh at given noise levels, without a covariance matrix.

In the eigenvectors of a signal's wander kernel white noise and wander are both diagonal, so that columns and readings
are turned into them once; for given noise levels only sums of products are formed. Nuisances with a prior (settings,
zero and gain of each run, stiffness shared by all) are integrated out of these sums (Woodbury's identity).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from belt_sim.diagnosis.noise import FLOOR, Levels, wander_modes
from belt_sim.diagnosis.samples import Samples

FAINT = 1e-2  # a column this small, in sigma, cannot be seen in these readings
DEPENDENT = 1e-12  # of the largest eigenvalue of columns of unit length: those below are sums of the others


@dataclass(frozen=True)
class Sums:
    """Columns and readings on the scale of the noise, nuisances integrated out.

    gram (U, P, P): products of columns at each of U noise levels; of (B,): which of them belongs to each of B sets of
    readings; moments (B, P): products of columns and readings; families: name -> positions of its columns.
    """

    gram: np.ndarray
    of: np.ndarray
    moments: np.ndarray
    families: Mapping[str, np.ndarray]

    def beside(self, name: str) -> "Sums":
        """The same with the columns of one family fitted to everything (rows and products become those of what is
        left)."""
        c = self.families[name]
        if not len(c):
            return self
        onto = _inverse(self.gram[:, c[:, None], c])[0] @ self.gram[:, c]
        gram = self.gram - self.gram[:, :, c] @ onto
        moments = self.moments - np.einsum("bc,bcp->bp", self.moments[:, c], onto[self.of])
        return Sums(gram, self.of, moments, self.families)

    def gains(self, name: str, choice: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """chi2 (B,) that fitting a family, or a choice of its columns, takes away, and how many of them can be told
        apart (U,).
        """
        c = self.families[name] if choice is None else self.families[name][choice]
        if not len(c):
            return np.zeros(len(self.moments)), np.zeros(len(self.gram), dtype=int)
        inverse, rank = _inverse(self.gram[:, c[:, None], c])
        b = self.moments[:, c]
        return np.einsum("bi,bij,bj->b", b, inverse[self.of], b), rank


def _inverse(gram: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Inverses (U, k, k) over the columns that can be seen and told apart, and how many those are (U,)."""
    size = np.sqrt(np.maximum(np.diagonal(gram, axis1=1, axis2=2), 0.0))
    scale = np.where(size > FAINT, 1.0 / np.maximum(size, FAINT), 0.0)
    values, vectors = np.linalg.eigh(gram * scale[:, :, None] * scale[:, None, :])
    kept = values > DEPENDENT * np.maximum(values[:, -1:], 1e-300)
    half = scale[:, :, None] * vectors * np.sqrt(np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0))[:, None, :]
    return half @ half.swapaxes(-1, -2), kept.sum(axis=1)


class Projection:
    """Named families of columns against readings of one campaign, at any noise levels."""

    def __init__(
        self, samples: Samples, shapes: np.ndarray, shared: np.ndarray, families: Mapping[str, np.ndarray]
    ) -> None:
        """shapes (K, R, S, n): nuisances of every run; shared (m, R, S, n): those of all; families: (k, R, S, n)."""
        self.samples = samples
        columns = np.concatenate([shared, *families.values()])
        self.shared = len(shared)
        ends = np.cumsum([0, *(len(f) for f in families.values())])
        self.families = {n: np.arange(a, b) for n, (a, b) in zip(families, pairwise(ends), strict=True)}
        runs, signals = samples.y.shape[:2]
        self.keep = np.isfinite(samples.y)
        white = np.where(self.keep, columns[:, :], 0.0)
        self.touched = [np.flatnonzero(np.any(white[:, r], axis=(1, 2))) for r in range(runs)]
        self.local = len(shapes)
        self.columns = np.concatenate([np.where(self.keep, shapes, 0.0), white])
        self.modes = [_Modes(samples, s) for s in range(signals)]
        self._turned: dict[tuple[int, float], np.ndarray] = {}
        self._products: dict[tuple, list[np.ndarray]] = {}

    def sums(self, errors: np.ndarray, levels: list[Levels]) -> Sums:
        """Sums for readings (B, R, S, n), each judged at its own noise levels (B,)."""
        unique = sorted({_key(lv, len(self.modes)) for lv in levels})
        place = {key: k for k, key in enumerate(unique)}
        of = np.array([place[_key(lv, len(self.modes))] for lv in levels])
        raw = self._raw_moments(errors, unique, of)
        count = self.columns.shape[0] - self.local
        gram, moments = np.zeros((len(unique), count, count)), np.zeros((len(errors), count))
        for r, a in enumerate(self.touched):
            products = self._raw_gram(r, unique)
            k, rows = self.local, self.local + np.arange(len(a))
            within = products[:, :k, :k] + np.eye(k)
            onto = np.linalg.solve(within, products[:, :k, k:])
            gram[:, a[:, None], a] += products[:, rows[:, None], rows] - products[:, k:, :k] @ onto
            b = raw[r]
            moments[:, a] += b[:, k:] - np.einsum("bk,bkp->bp", b[:, :k], onto[of])
        m = self.shared  # nuisances that all runs share, prior one sigma
        share = np.linalg.solve(gram[:, :m, :m] + np.eye(m), gram[:, :m])
        moments = moments - np.einsum("bm,bmp->bp", moments[:, :m], share[of])
        gram = gram - gram[:, :, :m] @ share
        return Sums(gram[:, m:, m:], of, moments[:, m:], self.families)

    def _turned_columns(self, s: int, length: float) -> np.ndarray:
        if (s, length) not in self._turned:
            self._turned[s, length] = self.modes[s].turn(self.columns[:, :, s], length)
        return self._turned[s, length]

    def _rows(self, r: int) -> np.ndarray:
        """Positions of the columns that matter in a run: its nuisances, then what touches it."""
        return np.concatenate([np.arange(self.local), self.local + self.touched[r]])

    def _raw_gram(self, r: int, unique) -> np.ndarray:
        """Products (U, k, k) of the columns of a run at every level, nuisances still in."""
        parts = [[self._product(r, s, key[s]) for key in unique] for s in range(len(self.modes))]
        return np.sum(parts, axis=0)

    def _product(self, r: int, s: int, level) -> np.ndarray:
        """Products of the columns of a run and signal; only the ratio of both noises has to be worked out anew."""
        white, wander, length = level
        key = (s, round(wander / white, 12), length)
        if key not in self._products:
            weight = self.modes[s].weight(1.0, wander / white, length)
            turned = self._turned_columns(s, length)
            found = []
            for run in range(len(self.touched)):
                z = turned[self._rows(run), run] * np.sqrt(weight[run])
                found.append(z @ z.T)
            self._products[key] = found
        return self._products[key][r] / white**2

    def _raw_moments(self, errors, unique, of) -> list[np.ndarray]:
        """Products (B, k) of readings and the columns of each run, nuisances still in."""
        total = [np.zeros((len(errors), self.local + len(a))) for a in self.touched]
        filled = np.where(self.keep, errors, 0.0)
        for s in range(len(self.modes)):
            lengths = np.array([key[s][2] for key in unique])[of]
            for length in np.unique(lengths):
                of_length = np.flatnonzero(lengths == length)
                turned = self.modes[s].turn(filled[of_length][:, :, s], length)
                columns = self._turned_columns(s, length)
                levels = [unique[k][s] for k in of[of_length]]
                for level in set(levels):
                    here = np.array([k for k, lv in enumerate(levels) if lv == level])
                    weight = self.modes[s].weight(*level)
                    for r in range(len(total)):
                        z = columns[self._rows(r), r] * weight[r]
                        total[r][of_length[here]] += turned[here, r] @ z.T
        return total


class _Modes:
    """The eigenvectors of one signal's wander kernel in every run, for any wander length."""

    def __init__(self, samples: Samples, s: int) -> None:
        self.samples, self.s, self.signal = samples, s, samples.signals[s]
        self._known: dict[float, tuple[list[np.ndarray], list[np.ndarray], np.ndarray]] = {}

    def at(self, length: float):
        """Per run: which samples, vectors (n, n); and wander variances (R, n)."""
        if length not in self._known:
            runs, _, n = self.samples.y.shape
            keeps, vectors, variances = [], [], np.full((runs, n), np.inf)
            for r in range(runs):
                keep = np.flatnonzero(np.isfinite(self.samples.y[r, self.s]))
                values, turned = wander_modes(self.signal, self.samples.travel[r, keep], length)
                keeps.append(keep)
                vectors.append(turned)
                variances[r, : len(keep)] = values
            self._known[length] = keeps, vectors, variances
        return self._known[length]

    def turn(self, x: np.ndarray, length: float) -> np.ndarray:
        """Rows (..., R, n) in the eigenvectors; places beyond the last mode are 0."""
        keeps, vectors, _ = self.at(length)
        found = np.zeros_like(x)
        for r, (keep, turned) in enumerate(zip(keeps, vectors, strict=True)):
            found[..., r, : len(keep)] = x[..., r, keep] @ turned
        return found

    def weight(self, white: float, wander: float, length: float) -> np.ndarray:
        """1 / variance (R, n) of every mode."""
        own = max(self.signal.white, FLOOR) ** 2 / self.samples.per_bin[:, None]
        return 1.0 / (white**2 * own + wander**2 * self.at(length)[2])


def _key(levels: Levels, signals: int) -> tuple:
    """(white, wander, length) of every signal."""
    return tuple(levels.of(s) for s in range(signals))
