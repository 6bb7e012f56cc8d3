"""The scale on which a residual is judged: readings whitened by noise, with nuisances integrated out.

x -> (I + N N^T)^(-1/2) L^(-1) x has unit covariance when nothing is missing: L the Cholesky factor of the
noise's covariance, N the whitened nuisance shapes in units of their prior sigma (zero, gain, tension and yaw setting of
every run, and where the yaw was applied; stiffness and length of the belt, shared by all).

The covariance of one run and signal is white^2 I + wander^2 exp(-|ds|/length), or where the wander is smooth, with a
slope everywhere as a slow drift of temperature has it, (1 + r) exp(-r) with r = sqrt(3) |ds|/length (Matern 3/2). Zero,
gain and setting errors are shared by a whole run and are nuisances with a prior. The stated levels may be off;
levels.py reads them off the campaign, as factors on what is stated.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from belt_sim.campaign import Campaign, SignalSheet
from belt_sim.diagnosis.readings.samples import Samples, zero_is_read

SMOOTH = float(np.sqrt(3.0))  # over the length of a smooth wander: one over that of its exponential
FREE_ZERO = 0.02  # [m], one sigma of a zero that is read off a record: more than any sensor was set off by
FLOOR = 1e-9  # [m or rad], so that a signal stated as perfect still has a covariance


class Reach(NamedTuple):
    """How far a wander reaches, as a factor on the stated length; whether it is smooth."""

    length: float = 1.0
    smooth: bool = False


@dataclass(frozen=True, kw_only=True)
class Levels:
    """Factors on the stated white noise, wander and wander length, one for all signals or one each; smooth: whether
    the wander is, in all of them.

    read: whether they were read off the campaign, and from how many repeats (0: from what single runs leave beside all
    candidates); trusted: False where they are so far from what is stated that something unknown may be in them.
    """

    white: float | tuple[float, ...] = 1.0
    wander: float | tuple[float, ...] = 1.0
    length: float | tuple[float, ...] = 1.0
    smooth: bool = False
    repeats: int = 0
    read: bool = False
    trusted: bool = True

    @property
    def sentence(self) -> str:
        """Where the levels come from, and what that costs."""
        if self.repeats:
            return "Noise levels were read off repeated runs."
        if not self.read:
            return "Noise levels are as stated in the campaign; nothing in it can confirm them."
        if self.trusted:
            return (
                "Without repeated runs, noise levels were read off what single runs leave; they agree with the stated."
            )
        return (
            "Single runs scatter far more or less than the campaign states, and no run was repeated: noise cannot be "
            "told from what the model lacks. Repeat two runs."
        )

    def of_signal(self, s: int) -> tuple[float, float, Reach]:
        """White noise, wander and its reach of signal ``s``; one beyond those that were read is like the first."""
        each = (x if isinstance(x, tuple) else (x,) for x in (self.white, self.wander, self.length))
        white, wander, length = (float(x[s if s < len(x) else 0]) for x in each)
        return white, wander, Reach(length, self.smooth)


def covariance(signal: SignalSheet, travel: np.ndarray, per_bin: float, levels: Levels, s: int = 0) -> np.ndarray:
    """Covariance (n, n) of one run's samples of one signal, the ``s``-th, without what a run shares."""
    white, wander, reach = levels.of_signal(s)
    noise = (white * max(signal.white, FLOOR)) ** 2 / per_bin
    return wander**2 * wander_kernel(signal, travel, reach) + noise * np.eye(len(travel))


def wander_kernel(signal: SignalSheet, travel: np.ndarray, reach: Reach) -> np.ndarray:
    """Covariance (n, n) of the wander, of the stated size."""
    apart = np.abs(travel[:, None] - travel[None, :]) / (reach.length * max(signal.wander_length, 1e-6))
    if not reach.smooth:
        return signal.wander_sd**2 * np.exp(-apart)
    return signal.wander_sd**2 * (1.0 + SMOOTH * apart) * np.exp(-SMOOTH * apart)


AT_ONCE = 64  # sets of readings that are worked on together: more do not stay within a processor's reach


@dataclass(frozen=True)
class Metric:
    """Whitening of arrays (..., R, S, n) into vectors (..., N), in the precision that they have: single is enough for
    what is drawn by chance, as it is then a draw a hair's breadth aside.
    """

    samples: Samples
    levels: Levels
    roots: np.ndarray  # (R, S, n, n); zero rows where nothing was measured
    local: tuple[np.ndarray, np.ndarray]  # a run's nuisances: directions (R, k, S*n), shrinkage (R, k)
    shared: tuple[np.ndarray, np.ndarray]  # those of all runs together: (m, N), (m,)

    def noise_white(self, x: np.ndarray) -> np.ndarray:
        """L^-1 x, shape (..., R, S*n): white noise, nuisances still in it."""
        filled = x if np.isfinite(x).all() else np.where(np.isfinite(x), x, x.dtype.type(0.0))
        many, (runs, signals, n) = int(np.prod(x.shape[:-3])), x.shape[-3:]
        each = filled.reshape(many, runs, signals, n).transpose(1, 2, 0, 3)
        # all of them by one matrix product a record
        roots = (self._single if x.dtype == np.float32 else self).roots
        white = np.matmul(each, roots.swapaxes(-1, -2)).transpose(2, 0, 1, 3)
        return white.reshape(*x.shape[:-2], signals * n)

    def whiten(self, x: np.ndarray) -> np.ndarray:
        """Unit-covariance vector (..., N) of readings or shapes (..., R, S, n)."""
        many = int(np.prod(x.shape[:-3]))
        each, found = x.reshape(many, *x.shape[-3:]), np.empty((many, int(np.prod(x.shape[-3:]))), x.dtype)
        own = self._single if x.dtype == np.float32 else self
        for start in range(0, many, AT_ONCE):
            white = own.noise_white(each[start : start + AT_ONCE])
            alone, (directions, share) = _shrink_runs(white, *own.local), own.shared
            found[start : start + AT_ONCE] = alone - ((alone @ directions.T) * share) @ directions
        return found.reshape(*x.shape[:-3], found.shape[1])

    @cached_property
    def _single(self) -> "Metric":
        """The same in single precision."""
        if self.roots.dtype == np.float32:
            return self
        local, shared = ((a.astype(np.float32), b.astype(np.float32)) for a, b in (self.local, self.shared))
        return replace(self, roots=self.roots.astype(np.float32), local=local, shared=shared)

    def chi2(self, residual: np.ndarray) -> np.ndarray:
        """Squared length of whitened residuals (..., R, S, n) -> (...)."""
        return np.sum(self.whiten(residual) ** 2, axis=-1)


def _shrink_runs(x: np.ndarray, directions: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Rows (k, R, S*n) -> (k, R * S*n), every run by its own directions (R, k, S*n) and shares (R, k)."""
    runs = x.swapaxes(0, 1)
    found = runs - ((runs @ directions.swapaxes(1, 2)) * share[:, None]) @ directions
    return found.swapaxes(0, 1).reshape(len(x), x.shape[1] * x.shape[2])


def nuisance_shapes(campaign: Campaign, samples: Samples, values, slopes) -> tuple[np.ndarray, np.ndarray]:
    """Shapes in units of one prior sigma: of every run (K, R, S, n), and of what all runs share (m, R, S, n).

    All runs share the stiffness, the place of the yaw where a logger may tell it too late in all runs alike, and the
    length of the belt: what comes once a turn drifts out of step with the stated length, the more the longer a record.

    values (R, S, n): predictions; slopes (6, R, S, n): along forward.NUISANCES.
    """
    n = values.shape[-1]
    shapes = [campaign.settings.tension_rel * slopes[1], campaign.settings.yaw_u * slopes[2]]
    for s, signal in enumerate(samples.signals):
        for shape in (np.repeat(zero_sigmas(samples, signal)[:, None], n, axis=1), signal.gain * values[:, s]):
            if np.any(shape):
                row = np.zeros_like(values)
                row[:, s] = shape
                shapes.append(row)
    late, start = (np.array([getattr(run, n) for run in samples.runs]) for n in ("yaw_at_u", "start_u"))
    if start.any():
        shapes.append(start[:, None, None] * slopes[5])
    shared = [stiffness_sigma(campaign) * slopes[0]]
    if late.any():
        shapes.append(late[:, None, None] * slopes[3])
        shared.append(shapes[-1])
    if (longer := length_sigma(campaign, float(np.max(samples.cases.rig.belt_length)))) > 0:
        shared.append(longer * slopes[4])
    return np.stack(shapes), np.stack(shared)


def zero_sigmas(samples: Samples, signal: SignalSheet) -> np.ndarray:
    """One sigma of a signal's zero in every run (R,): as stated where its readings begin with the yaw.

    What a machine does before the yaw shows where zero is, wherever the sensor was set to zero: any is allowed there.
    """
    before = zero_is_read(samples, signal)
    return np.where(before, max(signal.zero, FREE_ZERO), signal.zero)


def stiffness_sigma(campaign: Campaign) -> float:
    """Relative uncertainty of F/EI beyond the tension's own: E, and the width (1/b^2)."""
    modulus, width = campaign.belt.youngs_modulus, campaign.belt.width
    return float(np.hypot(modulus.u / modulus.value, 2.0 * width.u / width.value))


def length_sigma(campaign: Campaign, length: float) -> float:
    """Relative uncertainty of the belt's length [m]: of the centre distance and of both radii."""
    machine = campaign.machine
    radii = np.hypot(machine.head_radius.u, machine.tail_radius.u)
    return float(np.hypot(2.0 * machine.centre_distance.u, np.pi * radii) / length)


def metric_of(samples: Samples, levels: Levels, shapes: np.ndarray, shared: np.ndarray) -> Metric:
    """The metric at given noise levels; shapes and shared from ``nuisance_shapes``."""
    runs, signals, n = samples.y.shape
    roots = np.zeros((runs, signals, n, n))
    seen: dict[bytes, np.ndarray] = {}
    for r in range(runs):
        for s, signal in enumerate(samples.signals):
            keep = np.flatnonzero(np.isfinite(samples.y[r, s]))
            travel = samples.travel[r, keep]
            key = travel.tobytes() + bytes([s]) + np.float64(samples.per_bin[r]).tobytes()
            if key not in seen:
                lower = cholesky(covariance(signal, travel, samples.per_bin[r], levels, s), lower=True)
                seen[key] = solve_triangular(lower, np.eye(len(lower)), lower=True)
            roots[r, s][np.ix_(keep, keep)] = seen[key]
    none = np.zeros((0, 1)), np.zeros(0)
    bare = Metric(samples, levels, roots, none, none)
    local = _shrinkage(bare.noise_white(shapes).swapaxes(0, 1))
    return Metric(samples, levels, roots, local, _shrinkage(_shrink_runs(bare.noise_white(shared), *local)))


def _shrinkage(columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (..., k, m) and shares (..., k) with (I + N N^T)^(-1/2) = I - sum share d d^T; columns (..., k, m):
    N^T.
    """
    _, size, directions = np.linalg.svd(columns, full_matrices=False)
    return directions, 1.0 - 1.0 / np.sqrt(1.0 + size**2)
