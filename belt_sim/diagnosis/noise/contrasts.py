"""Contrasts: sums over runs, and over samples of them, in which nothing but noise is left.

Long records are averaged in bins for what is slow, and the scatter within short windows is kept for what is fast.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from belt_sim.campaign import SignalSheet
from belt_sim.diagnosis.noise.metric import FLOOR, Reach, wander_kernel
from belt_sim.diagnosis.readings.samples import Samples

LEAST = 12  # readings of a contrast
BINS = 64  # of a run, at most
WINDOW = 8  # samples, within which what is fast is looked for beside a parabola
KNOWN = 1.0  # length, in units of the stated noise, of sums of known columns that are given up
SHARE = 3  # at most one direction of so many is given up to known columns
_FAST = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, WINDOW), 3), mode="complete")[0][:, 3:]


@dataclass(frozen=True)
class Contrast:
    """One signal over some runs, each with a weight; the squares of the weights add up to one.

    keep (n,): which samples; travel (n,): where they are [m]; per_bin: white variance is divided by it; free (b, m):
    directions over the bins that nothing known can reach.
    """

    runs: tuple[int, ...]
    weights: tuple[float, ...]
    signal: int
    sheet: SignalSheet
    keep: np.ndarray
    travel: np.ndarray
    per_bin: float
    free: np.ndarray

    @property
    def bin_size(self) -> int:
        """Samples that are averaged."""
        return _bin_size(len(self.keep))

    def project(self, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Readings (R, S, n) -> slow (m,) and fast (windows, f), with the stated white noise of unit size."""
        sums = np.array(self.weights) @ errors[list(self.runs), self.signal][:, self.keep]
        sums = sums * (np.sqrt(self.per_bin) / max(self.sheet.white, FLOOR))
        slow = np.sqrt(self.bin_size) * _bin_means(sums, self.bin_size) @ self.free
        return slow, sums[: self._windows * WINDOW].reshape(-1, WINDOW) @ _FAST

    @property
    def _windows(self) -> int:
        """Windows in which what is fast is looked for: none where no samples are averaged."""
        return 0 if self.bin_size == 1 else len(self.keep) // WINDOW

    def modes(self, reach: Reach) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Modes slow (m, m) and fast (f, f) in which wander of this reach is independent, behind the variance of wander
        over that of white noise in every mode, as stated."""
        kernel, (ratios, fast) = _wander(self.sheet, self.travel.tobytes(), self.per_bin, self.bin_size, reach)
        own, slow = np.linalg.eigh(self.free.T @ kernel @ self.free)
        return np.maximum(np.concatenate([own, np.tile(ratios, self._windows)]), 0.0), slow, fast


@lru_cache(maxsize=256)
def _wander(sheet: SignalSheet, travel: bytes, per_bin: float, q: int, reach: Reach):
    """Covariance (b, b) of a wander's bins over the stated white noise, and variances and modes of what is fast in it:
    the same wherever predictions are taken.
    """
    at = np.frombuffer(travel)
    kernel = per_bin / max(sheet.white, FLOOR) ** 2 * wander_kernel(sheet, at, reach)
    return q * _bin_covariance(kernel, q), _fast_modes(sheet, float(np.median(np.diff(at))), per_bin, reach)


def _fast_modes(sheet: SignalSheet, spacing: float, per_bin: float, reach: Reach) -> tuple[np.ndarray, np.ndarray]:
    """Variance of wander over that of white noise in every fast mode (f,), and the modes (f, f), as stated."""
    near = per_bin / max(sheet.white, FLOOR) ** 2 * wander_kernel(sheet, spacing * np.arange(WINDOW), reach)
    ratios, modes = np.linalg.eigh(_FAST.T @ near @ _FAST)
    return np.maximum(ratios, 0.0), modes


@dataclass(frozen=True)
class Scatter:
    """What is fast in sums of runs of one signal that were read alike: beside a parabola in every WINDOW of samples.

    A belt hardly moves within so few samples, but a short wave does: it is noise, or more than that. weights (k, R):
    of k sums over runs, squares adding up to one.
    """

    weights: np.ndarray
    signal: int
    sheet: SignalSheet
    keep: np.ndarray
    spacing: float
    per_bin: float

    def project(self, errors: np.ndarray) -> np.ndarray:
        """Readings (R, S, n) -> (windows, f), with the stated white noise of unit size."""
        here = errors[:, self.signal][:, self.keep[: len(self.keep) // WINDOW * WINDOW]]
        there = np.where(np.isfinite(here), here, 0.0)  # what runs of no weight here have not measured
        rows = self.weights @ there * (np.sqrt(self.per_bin) / max(self.sheet.white, FLOOR))
        return rows.reshape(-1, WINDOW) @ _FAST

    def modes(self, reach: Reach) -> tuple[np.ndarray, np.ndarray]:
        """Variance of wander over that of white noise in every mode (f,), and the modes (f, f), as stated."""
        return _fast_modes(self.sheet, self.spacing, self.per_bin, reach)


def scatter(samples: Samples, groups: Sequence[tuple[int, ...]], s: int) -> list[Scatter]:
    """The fast part of every run of the ``s``-th signal, of repeats that of their mean: the rest is in contrasts."""
    repeated = {r for group in groups for r in group}
    there = np.isfinite(samples.y[:, s])
    found: dict[tuple, tuple[np.ndarray, list[np.ndarray]]] = {}
    for runs in (*groups, *((r,) for r in range(len(there)) if r not in repeated)):
        keep = there[list(runs)].all(axis=0)
        key = (keep.tobytes(), samples.travel[runs[0]].tobytes(), float(samples.per_bin[runs[0]]))
        alike = np.zeros(len(there))
        alike[list(runs)] = len(runs) ** -0.5
        found.setdefault(key, (keep, []))[1].append(alike)
    scatters = []
    for (_, travel, per_bin), (keep, weights) in found.items():
        places = np.flatnonzero(keep)
        if len(places) >= WINDOW:
            spacing = float(np.median(np.diff(np.frombuffer(travel)[places])))
            scatters.append(Scatter(np.stack(weights), s, samples.signals[s], places, spacing, per_bin))
    return scatters


def contrast(
    samples: Samples, columns: np.ndarray, runs: Sequence[int], weights: Sequence[float], s: int
) -> Contrast | None:
    """The contrast of signal ``s`` over ``runs``, all set alike, beside a constant and ``columns`` (k, R, S, n), in
    sizes that may occur, each run by itself; None where there is too little of it.
    """
    keep = np.flatnonzero(np.isfinite(samples.y[list(runs), s]).all(axis=0))
    if len(keep) < LEAST:
        return None
    q = _bin_size(len(keep))
    per_bin = float(1.0 / np.sum(np.square(weights) / samples.per_bin[list(runs)]))
    sheet, travel = samples.signals[s], samples.travel[runs[0], keep]
    noise = _bin_covariance(wander_kernel(sheet, travel, Reach()), q)
    noise += np.eye(len(noise)) * max(sheet.white, FLOOR) ** 2 / (per_bin * q)
    known = np.einsum("r,krn->rkn", weights, columns[:, list(runs), s][..., keep]).reshape(-1, len(keep))
    return Contrast(
        runs=tuple(runs),
        weights=tuple(weights),
        signal=s,
        sheet=sheet,
        keep=keep,
        travel=travel,
        per_bin=per_bin,
        free=_free_directions(_bin_means(known, q), noise),
    )


def _bin_size(count: int) -> int:
    return -(-count // BINS)


def _bin_means(rows: np.ndarray, q: int) -> np.ndarray:
    """Means of every ``q`` samples of rows (..., n)."""
    whole = rows.shape[-1] // q * q
    return rows[..., :whole].reshape(*rows.shape[:-1], -1, q).mean(axis=-1)


def _bin_covariance(kernel: np.ndarray, q: int) -> np.ndarray:
    """Covariance of the means of every ``q`` samples."""
    whole = len(kernel) // q * q
    return kernel[:whole, :whole].reshape(whole // q, q, whole // q, q).mean(axis=(1, 3))


def _free_directions(rows: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Orthonormal directions (b, m) beside a constant and all that rows (k, b) can do to a noise of covariance (b, b)
    that could be seen.
    """
    lower = np.linalg.cholesky(noise)
    first = np.ones((rows.shape[1], 1))
    seen = np.linalg.solve(lower, np.concatenate([first, rows.T], axis=1))
    start = seen[:, :1] / np.linalg.norm(seen[:, 0])
    rest = seen[:, 1:] - start @ (start.T @ seen[:, 1:])
    values, vectors = np.linalg.eigh(rest @ rest.T)
    strong = vectors[:, values > KNOWN**2][:, -(rows.shape[1] // SHARE) :]
    known = np.concatenate([first, lower @ strong], axis=1)
    return np.linalg.qr(known / np.linalg.norm(known, axis=0), mode="complete")[0][:, known.shape[1] :]
