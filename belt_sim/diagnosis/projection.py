"""Likelihood by projections: what columns and readings weigh at given noise levels, without a covariance matrix.

In the eigenvectors of a signal's wander kernel white noise and wander are both diagonal, so that columns and readings
are turned into them once; for given noise levels only sums of products are formed, and of those only the ones between
columns that are fitted together. Nuisances with a prior (settings, zero and gain of each run, stiffness shared by all)
are integrated out of these sums (Woodbury's identity), and what is fitted to everything is projected out in the same
way.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from belt_sim.diagnosis.noise import FLOOR, Levels, Reach, wander_modes
from belt_sim.diagnosis.samples import Samples

FAINT = 1e-2  # a column this small, in sigma, cannot be seen in these readings
DEPENDENT = 1e-12  # of the largest eigenvalue of columns of unit length: those below are sums of the others


@dataclass(frozen=True)
class Together:
    """Columns (k,) that are fitted together, and where their products (k, k) stand among those of all pairs."""

    columns: np.ndarray
    pairs: np.ndarray


@dataclass(frozen=True)
class Sums:
    """Columns and readings on the scale of the noise, nuisances integrated out.

    products (U, N): of pairs of columns at each of U noise levels; of (B,): which of them belongs to each of B sets of
    readings; moments (B, P): products of columns and readings; sets: name -> the columns that are fitted together.
    """

    products: np.ndarray
    of: np.ndarray
    moments: np.ndarray
    sets: Mapping[str, Sequence[Together]]

    def gram(self, name: str, which: int = 0) -> np.ndarray:
        """Products (U, k, k) of the columns of a set."""
        return self.products[:, self.sets[name][which].pairs]

    def gains(self, name: str, which: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """chi2 (B,) that fitting a set takes away, and how many of its columns can be told apart (U,)."""
        c = self.sets[name][which].columns
        if not len(c):
            return np.zeros(len(self.moments)), np.zeros(len(self.products), dtype=int)
        inverses, rank = inverse(self.gram(name, which))
        b = self.moments[:, c]
        return np.einsum("bi,bij,bj->b", b, inverses[self.of], b), rank


def inverse(gram: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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
        self,
        samples: Samples,
        shapes: np.ndarray,
        shared: np.ndarray,
        families: Mapping[str, np.ndarray],
        *,
        beside: str | None = None,
        choices: Mapping[str, Sequence[np.ndarray]] | None = None,
    ) -> None:
        """shapes (K, R, S, n): nuisances of every run; shared (m, R, S, n): those of all; families: (k, R, S, n).

        beside: a family that is fitted to everything; choices: which columns of a family are fitted together, one set
        after the other; all of them where nothing is said.
        """
        self.samples = samples
        ends = np.cumsum([0, *(len(f) for f in families.values())])
        places = {n: np.arange(a, b) for n, (a, b) in zip(families, pairwise(ends), strict=True)}
        self.keep = np.isfinite(samples.y)
        self.columns = np.where(self.keep, np.concatenate([shapes, shared, *families.values()]), 0.0)
        self.local, self.fitted = len(shapes), places[beside] if beside else np.arange(0)
        self.shared = len(shared)
        first = self.local + self.shared
        self.top = np.concatenate([np.arange(first), first + self.fitted])
        together = {n: [places[n][c] for c in (choices or {}).get(n, [np.arange(len(places[n]))])] for n in families}
        self._pair(together, first)
        self.modes = [_Modes(samples, s) for s in range(samples.y.shape[1])]
        self._turned: dict[tuple[int, Reach], np.ndarray] = {}
        self._known: dict[tuple, np.ndarray] = {}

    def _pair(self, together: Mapping[str, Sequence[np.ndarray]], first: int) -> None:
        """Number the pairs of columns whose products are asked for: those of ``top`` with all, and those of sets."""
        place: dict[tuple[int, int], int] = {}
        self.sets = {}
        for name, sets in together.items():
            rows = [[[place.setdefault((min(i, j), max(i, j)), len(place)) for j in c] for i in c] for c in sets]
            self.sets[name] = [
                Together(c, np.array(r, dtype=int).reshape(len(c), len(c))) for c, r in zip(sets, rows, strict=True)
            ]
        self.pairs = np.array(list(place), dtype=int).reshape(-1, 2).T + first
        self.one = np.concatenate([np.repeat(self.top, len(self.columns)), self.pairs[0]])
        self.other = np.concatenate([np.tile(np.arange(len(self.columns)), len(self.top)), self.pairs[1]])

    def sums(self, errors: np.ndarray, levels: list[Levels]) -> Sums:
        """Sums for readings (B, R, S, n), each judged at its own noise levels (B,)."""
        unique = sorted({_key(lv, len(self.modes)) for lv in levels})
        place = {key: k for k, key in enumerate(unique)}
        of = np.array([place[_key(lv, len(self.modes))] for lv in levels])
        raw, tables = self._raw_moments(errors, unique, of), self._tables(unique)
        k, m, (i, j) = self.local, self.shared, self.pairs - self.local
        moments = np.zeros((len(errors), len(self.columns) - k))
        top = np.zeros((len(unique), len(self.top) - k, len(self.columns) - k))
        products = np.zeros((len(unique), self.pairs.shape[1]))
        for r, b in enumerate(raw):
            rows, own = self._products(tables, r)
            onto = np.linalg.solve(rows[:, :k, self.top[:k]] + np.eye(k), rows[:, :k, k:])
            top += rows[:, k:, k:] - rows[:, :k, self.top[k:]].swapaxes(1, 2) @ onto
            products += own - np.sum(rows[:, :k, self.pairs[0]] * onto[:, :, j], axis=1)
            moments += b[:, k:] - np.einsum("bk,bkp->bp", b[:, :k], onto[of])
        share = np.linalg.solve(top[:, :m, :m] + np.eye(m), top[:, :m])  # nuisances of all runs, prior one sigma
        moments -= np.einsum("bm,bmp->bp", moments[:, :m], share[of])
        products -= np.sum(share[:, :, i] * top[:, :m, j], axis=1)
        if len(self.fitted):
            fitted = m + self.fitted
            rest = top[:, m:] - share[:, :, fitted].swapaxes(1, 2) @ top[:, :m]
            onto = inverse(rest[:, :, fitted])[0] @ rest
            products -= np.sum(rest[:, :, i] * onto[:, :, j], axis=1)
            moments = moments - np.einsum("bc,bcp->bp", moments[:, fitted], onto[of])
        return Sums(products, of, moments[:, m:], self.sets)

    def _turned_columns(self, s: int, reach: Reach) -> np.ndarray:
        if (s, reach) not in self._turned:
            self._turned[s, reach] = self.modes[s].turn(self.columns[:, :, s], reach)
        return self._turned[s, reach]

    def _products(self, tables, r: int) -> tuple[np.ndarray, np.ndarray]:
        """Products in run r at every level, nuisances still in: top (U, t, P), and of all other pairs (U, N)."""
        found = sum(table[of, r] / white for table, of, white in tables)
        end = len(self.top) * len(self.columns)
        return found[:, :end].reshape(len(found), len(self.top), -1), found[:, end:]

    def _tables(self, unique) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """For each signal products (V, R, N) of all pairs at white noise as stated, which of them belongs to each level
        (U,), and by what to divide them (U, 1); only the ratio of both noises has to be worked out anew."""
        tables = []
        for s in range(len(self.modes)):
            keys = [(round(key[s][1] / key[s][0], 12), key[s][2]) for key in unique]
            apart = {key: k for k, key in enumerate(dict.fromkeys(keys))}
            self._work_out(s, [key for key in apart if (s, key) not in self._known])
            table = np.stack([self._known[s, key] for key in apart])
            white = np.array([key[s][0] ** 2 for key in unique])[:, None]
            tables.append((table, np.array([apart[key] for key in keys]), white))
        return tables

    def _work_out(self, s: int, keys) -> None:
        """Products (R, N) of all pairs of columns for ratios of the noises of a signal, and the reach of its wander."""
        for reach in {reach for _, reach in keys}:
            mine = [key for key in keys if key[1] == reach]
            weights = np.stack([self.modes[s].weight(1.0, ratio, reach) for ratio, _ in mine])
            turned = self._turned_columns(s, reach)
            runs = turned.shape[1]
            found = np.stack([weights[:, r] @ (turned[self.one, r] * turned[self.other, r]).T for r in range(runs)], 1)
            self._known |= {(s, key): rows for key, rows in zip(mine, found, strict=True)}

    def _raw_moments(self, errors, unique, of) -> list[np.ndarray]:
        """Products (B, P) of readings and the columns of each run, nuisances still in."""
        filled = np.where(self.keep, errors, 0.0)
        total = [np.zeros((len(errors), len(self.columns))) for _ in range(filled.shape[1])]
        for s, modes in enumerate(self.modes):
            for reach in sorted({key[s][2] for key in unique}):
                here = np.flatnonzero(np.array([key[s][2] == reach for key in unique])[of])
                weights = {k: modes.weight(*unique[k][s]) for k in set(of[here])}
                turned = modes.turn(filled[here][:, :, s], reach)
                turned *= np.stack([weights[k] for k in of[here]])
                columns = self._turned_columns(s, reach)
                for r, rows in enumerate(total):
                    rows[here] += turned[:, r] @ columns[:, r].T
        return total


class _Modes:
    """The eigenvectors of one signal's wander kernel in every run, for wander of any reach."""

    def __init__(self, samples: Samples, s: int) -> None:
        self.samples, self.s, self.signal = samples, s, samples.signals[s]
        self._known: dict[Reach, tuple[list[np.ndarray], list[np.ndarray], np.ndarray]] = {}

    def at(self, reach: Reach):
        """Per run: which samples, vectors (n, n); and wander variances (R, n)."""
        if reach not in self._known:
            runs, _, n = self.samples.y.shape
            keeps, vectors, variances = [], [], np.full((runs, n), np.inf)
            for r in range(runs):
                keep = np.flatnonzero(np.isfinite(self.samples.y[r, self.s]))
                values, turned = wander_modes(self.signal, self.samples.travel[r, keep], reach)
                keeps.append(keep)
                vectors.append(turned)
                variances[r, : len(keep)] = values
            self._known[reach] = keeps, vectors, variances
        return self._known[reach]

    def turn(self, x: np.ndarray, reach: Reach) -> np.ndarray:
        """Rows (..., R, n) in the eigenvectors; places beyond the last mode are 0."""
        keeps, vectors, _ = self.at(reach)
        found = np.zeros_like(x)
        for r, (keep, turned) in enumerate(zip(keeps, vectors, strict=True)):
            found[..., r, : len(keep)] = x[..., r, keep] @ turned
        return found

    def weight(self, white: float, wander: float, reach: Reach) -> np.ndarray:
        """1 / variance (R, n) of every mode."""
        own = max(self.signal.white, FLOOR) ** 2 / self.samples.per_bin[:, None]
        return 1.0 / (white**2 * own + wander**2 * self.at(reach)[2])


def _key(levels: Levels, signals: int) -> tuple:
    """White noise, wander and its reach, of every signal."""
    return tuple(levels.of(s) for s in range(signals))
