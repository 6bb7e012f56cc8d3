"""Noise of a campaign: the metric that whitens residuals, contrasts of runs, and the levels read off these."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from belt_sim.campaign import Campaign, SignalSheet
from belt_sim.diagnosis.samples import Samples, zero_is_read

# The scale on which a residual is judged: readings whitened by noise, with nuisances integrated out.
#
# x -> (I + N N^T)^(-1/2) L^(-1) x has unit covariance when nothing is missing: L the Cholesky factor of the noise's
# covariance, N the whitened nuisance shapes in units of their prior sigma (zero, gain, tension and yaw setting of every
# run, and where the yaw was applied; stiffness and length of the belt, shared by all).
#
# The covariance of one run and signal is white^2 I + wander^2 exp(-|ds|/length), or where the wander is smooth, with a
# slope everywhere as a slow drift of temperature has it, (1 + r) exp(-r) with r = sqrt(3) |ds|/length (Matern 3/2).
# Zero, gain and setting errors are shared by a whole run and are nuisances with a prior. The stated levels may be off:
# LevelFinder reads them off the campaign, as factors on what is stated.


MATERN_ROOT = float(np.sqrt(3.0))  # over the length of a smooth wander: one over that of its exponential
FREE_ZERO = 0.02  # [m], one sigma of a zero that is read off a record: more than any sensor was set off by
LEAST_NOISE = 1e-9  # [m or rad], so that a signal stated as perfect still has a covariance


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


def wander_kernel(signal: SignalSheet, travel: np.ndarray, reach: Reach) -> np.ndarray:
    """Covariance (n, n) of the wander, of the stated size."""
    apart = np.abs(travel[:, None] - travel[None, :]) / (reach.length * max(signal.wander_length, 1e-6))
    if not reach.smooth:
        return signal.wander_sd**2 * np.exp(-apart)
    return signal.wander_sd**2 * (1.0 + MATERN_ROOT * apart) * np.exp(-MATERN_ROOT * apart)


WHITENED_AT_ONCE = 64  # sets of readings that are worked on together: more do not stay within a processor's reach


@dataclass(frozen=True)
class Metric:
    """Whitening of arrays (..., R, S, n) into vectors (..., N), in the precision that they have: single is enough for
    what is drawn by chance, as it is then a draw a hair's breadth aside.
    """

    samples: Samples
    levels: Levels
    roots: np.ndarray  # (U, n, n), each once; zero rows where nothing was measured
    which: np.ndarray  # (R, S): of the roots, that of a record
    local: tuple[np.ndarray, np.ndarray]  # a run's nuisances: directions (R, k, S*n), shrinkage (R, k)
    shared: tuple[np.ndarray, np.ndarray]  # those of all runs together: (m, N), (m,)

    def noise_white(self, x: np.ndarray) -> np.ndarray:
        """L^-1 x, shape (..., R, S*n): white noise, nuisances still in it."""
        filled = x if np.isfinite(x).all() else np.where(np.isfinite(x), x, x.dtype.type(0.0))
        many, (runs, signals, n) = int(np.prod(x.shape[:-3])), x.shape[-3:]
        each, white = filled.reshape(many, runs, signals, n), np.empty((runs, signals, many, n), x.dtype)
        for k, root in enumerate((self._single if x.dtype == np.float32 else self).roots):
            alike = self.which == k  # all of a record by one matrix product
            white[alike] = np.matmul(each.transpose(1, 2, 0, 3)[alike], root.T)
        return white.transpose(2, 0, 1, 3).reshape(*x.shape[:-2], signals * n)

    def whiten(self, x: np.ndarray) -> np.ndarray:
        """Unit-covariance vector (..., N) of readings or shapes (..., R, S, n)."""
        many = int(np.prod(x.shape[:-3]))
        each, found = x.reshape(many, *x.shape[-3:]), np.empty((many, int(np.prod(x.shape[-3:]))), x.dtype)
        own = self._single if x.dtype == np.float32 else self
        for start in range(0, many, WHITENED_AT_ONCE):
            white = own.noise_white(each[start : start + WHITENED_AT_ONCE])
            alone, (directions, share) = _shrink_runs(white, *own.local), own.shared
            found[start : start + WHITENED_AT_ONCE] = alone - ((alone @ directions.T) * share) @ directions
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


def nuisance_shapes(
    campaign: Campaign, samples: Samples, values, slopes, starts: Sequence[np.ndarray] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Shapes in units of one prior sigma: of every run (K, R, S, n), and of what all runs share (m, R, S, n).

    All runs share the stiffness, the place of the yaw where a logger may tell it too late in all runs alike, and the
    length of the belt: what comes once a turn drifts out of step with the stated length, the more the longer a record.

    values (R, S, n): predictions; slopes (6, R, S, n): along forward.NUISANCES; starts: as ``workbench.start_shapes``.
    """
    n = values.shape[-1]
    shapes = [campaign.settings.tension_rel * slopes[1], campaign.settings.yaw_u * slopes[2]]
    modulus, width = campaign.belt.youngs_modulus, campaign.belt.width
    stiffness = float(np.hypot(modulus.u / modulus.value, 2.0 * width.u / width.value))  # E and 1/b^2, beside tension's
    for s, signal in enumerate(samples.signals):
        for shape in (np.repeat(zero_sigmas(samples, signal)[:, None], n, axis=1), signal.gain * values[:, s]):
            if np.any(shape):
                row = np.zeros_like(values)
                row[:, s] = shape
                shapes.append(row)
    late, start = (np.array([getattr(run, n) for run in samples.runs]) for n in ("yaw_at_u", "start_u"))
    if start.any():
        shapes.append(start[:, None, None] * slopes[5])
    shapes += list(starts)
    shared = [stiffness * slopes[0]]
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


def length_sigma(campaign: Campaign, length: float) -> float:
    """Relative uncertainty of the belt's length [m]: of the centre distance and of both radii."""
    machine = campaign.machine
    radii = np.hypot(machine.head_radius.u, machine.tail_radius.u)
    return float(np.hypot(2.0 * machine.centre_distance.u, np.pi * radii) / length)


def metric_of(samples: Samples, levels: Levels, shapes: np.ndarray, shared: np.ndarray) -> Metric:
    """The metric at given noise levels; shapes and shared from ``nuisance_shapes``."""
    runs, signals, n = samples.y.shape
    which, roots, seen = np.empty((runs, signals), dtype=int), list[np.ndarray](), dict[tuple, int]()
    for r in range(runs):
        for s, signal in enumerate(samples.signals):
            keep = np.flatnonzero(np.isfinite(samples.y[r, s]))
            travel, level, per_bin = samples.travel[r, keep], levels.of_signal(s), float(samples.per_bin[r])
            stated = signal.white, signal.wander_sd, signal.wander_length
            key = keep.tobytes(), travel.tobytes(), per_bin, level, stated
            if key not in seen:  # of one run's samples of one signal, without what a run shares
                white, wander, reach = level
                noise = (white * max(signal.white, LEAST_NOISE)) ** 2 / per_bin * np.eye(len(travel))
                lower = cholesky(wander**2 * wander_kernel(signal, travel, reach) + noise, lower=True)
                seen[key] = len(roots)
                roots.append(np.zeros((n, n)))
                roots[-1][np.ix_(keep, keep)] = solve_triangular(lower, np.eye(len(lower)), lower=True)
            which[r, s] = seen[key]
    none = np.zeros((0, 1)), np.zeros(0)
    bare = Metric(samples, levels, np.stack(roots), which, none, none)
    local = _shrinkage(bare.noise_white(shapes).swapaxes(0, 1))
    return replace(bare, local=local, shared=_shrinkage(_shrink_runs(bare.noise_white(shared), *local)))


def _shrinkage(columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (..., k, m) and shares (..., k) with (I + N N^T)^(-1/2) = I - sum share d d^T; columns (..., k, m):
    N^T.
    """
    _, size, directions = np.linalg.svd(columns, full_matrices=False)
    return directions, 1.0 - 1.0 / np.sqrt(1.0 + size**2)


# Contrasts: sums over runs, and over samples of them, in which nothing but noise is left.
#
# Long records are averaged in bins for what is slow, and the scatter within short windows is kept for what is fast.


CONTRAST_READINGS = 12  # readings of a contrast
BINS = 64  # of a run, at most
WINDOW = 8  # samples, within which what is fast is looked for beside a parabola
GIVEN_UP_LENGTH = 1.0  # length, in units of the stated noise, of sums of known columns that are given up
LONGEST_KNOWN = 1e6  # entry of a known column, in the same units: a longer one hides others by rounding, and overflows
GIVEN_UP_SHARE = 3  # at most one direction of so many is given up to known columns
_FAST = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, WINDOW), 3), mode="complete")[0][:, 3:]


@dataclass(frozen=True)
class Contrast:
    """One signal over some runs, each with a weight; the squares of the weights add up to one.

    keep (n,): which samples; travel (n,): where they are [m]; per_bin: white variance is divided by it; bin_size:
    samples that are averaged; windows: how many there are in which what is fast is looked for; free (b, m): directions
    over the bins that nothing known can reach.
    """

    runs: tuple[int, ...]
    weights: tuple[float, ...]
    signal: int
    sheet: SignalSheet
    keep: np.ndarray
    travel: np.ndarray
    per_bin: float
    bin_size: int
    windows: int
    free: np.ndarray

    def project(self, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Readings (R, S, n) -> slow (m,) and fast (windows, f), with the stated white noise of unit size."""
        sums = np.array(self.weights) @ errors[list(self.runs), self.signal][:, self.keep]
        sums = sums * (np.sqrt(self.per_bin) / max(self.sheet.white, LEAST_NOISE))
        slow = np.sqrt(self.bin_size) * _bin_means(sums, self.bin_size) @ self.free
        return slow, sums[: self.windows * WINDOW].reshape(-1, WINDOW) @ _FAST

    def modes(self, reach: Reach) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Modes slow (m, m) and fast (f, f) in which wander of this reach is independent, behind the variance of wander
        over that of white noise in every mode, as stated."""
        kernel, (ratios, fast) = _wander(self.sheet, self.travel.tobytes(), self.per_bin, self.bin_size, reach)
        own, slow = np.linalg.eigh(self.free.T @ kernel @ self.free)
        return np.maximum(np.concatenate([own, np.tile(ratios, self.windows)]), 0.0), slow, fast


@lru_cache(maxsize=256)
def _wander(sheet: SignalSheet, travel: bytes, per_bin: float, q: int, reach: Reach):
    """Covariance (b, b) of a wander's bins over the stated white noise, and variances and modes of what is fast in it:
    the same wherever predictions are taken.
    """
    at = np.frombuffer(travel)
    kernel = per_bin / max(sheet.white, LEAST_NOISE) ** 2 * wander_kernel(sheet, at, reach)
    return q * _bin_covariance(kernel, q), _fast_modes(sheet, float(np.median(np.diff(at))), per_bin, reach)


def _fast_modes(sheet: SignalSheet, spacing: float, per_bin: float, reach: Reach) -> tuple[np.ndarray, np.ndarray]:
    """Variance of wander over that of white noise in every fast mode (f,), and the modes (f, f), as stated."""
    near = per_bin / max(sheet.white, LEAST_NOISE) ** 2 * wander_kernel(sheet, spacing * np.arange(WINDOW), reach)
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


def find_scatter(samples: Samples, groups: Sequence[tuple[int, ...]], s: int) -> list[Scatter]:
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
    if len(keep) < CONTRAST_READINGS:
        return None
    q = -(-len(keep) // BINS)
    per_bin = float(1.0 / np.sum(np.square(weights) / samples.per_bin[list(runs)]))
    sheet, travel = samples.signals[s], samples.travel[runs[0], keep]
    noise = _bin_covariance(wander_kernel(sheet, travel, Reach()), q)
    noise += np.eye(len(noise)) * max(sheet.white, LEAST_NOISE) ** 2 / (per_bin * q)
    known = np.einsum("r,krn->rkn", weights, columns[:, list(runs), s][..., keep]).reshape(-1, len(keep))
    # orthonormal directions (b, m) beside a constant and all that the known can do to the noise that could be seen
    rows, lower = _bin_means(known, q), np.linalg.cholesky(noise)
    first = np.ones((rows.shape[1], 1))
    seen = np.linalg.solve(lower, np.concatenate([first, rows.T], axis=1))
    start = seen[:, :1] / np.linalg.norm(seen[:, 0])
    rest = seen[:, 1:] - start @ (start.T @ seen[:, 1:])
    rest /= np.maximum(np.abs(rest).max(axis=0, initial=0.0) / LONGEST_KNOWN, 1.0)
    values, vectors = np.linalg.eigh(rest @ rest.T)
    strong = vectors[:, values > GIVEN_UP_LENGTH**2][:, -(rows.shape[1] // GIVEN_UP_SHARE) :]
    taken = np.concatenate([first, lower @ strong], axis=1)
    directions = np.linalg.qr(taken / np.linalg.norm(taken, axis=0), mode="complete")[0]
    return Contrast(
        runs=tuple(runs),
        weights=tuple(map(float, weights)),
        signal=s,
        sheet=sheet,
        keep=keep,
        travel=travel,
        per_bin=per_bin,
        bin_size=q,
        windows=0 if q == 1 else len(keep) // WINDOW,  # none where no samples are averaged
        free=directions[:, taken.shape[1] :],
    )


def _bin_means(rows: np.ndarray, q: int) -> np.ndarray:
    """Means of every ``q`` samples of rows (..., n)."""
    whole = rows.shape[-1] // q * q
    return rows[..., :whole].reshape(*rows.shape[:-1], -1, q).mean(axis=-1)


def _bin_covariance(kernel: np.ndarray, q: int) -> np.ndarray:
    """Covariance of the means of every ``q`` samples."""
    whole = len(kernel) // q * q
    return kernel[:whole, :whole].reshape(whole // q, q, whole // q, q).mean(axis=(1, 3))


# How large the noise is, signal by signal: white noise, wander, how far wander reaches, and whether it is smooth.
#
# What is known beforehand is the data sheet. What is read off are contrasts in which no model appears: differences of
# repeated runs. Without repeats it is what single runs leave beside everything that settings, sensors and all
# candidates could do to them; that may hold a stranger as well as noise, and is trusted only where it agrees with the
# sheet. A sensor of which nothing was read is as others are that are stated alike: instruments of one make are off
# together.
#
# A smooth wander has more of long waves and less of short ones than any rough one: taken for rough it leaves waves that
# look like something missing. Where readings do not tell, both are drawn, each as often as it is probable.


#: Times the stated noise, from which repeats tell of a change between runs and not of noise. Sheets are off by 40 %
#: (LEVEL_SPREAD), so that this is 2.6 sigma from the sheet, over a dozen and more independent modes.
DISAGREE, FEWEST_MODES = 2.5, 12


@dataclass(frozen=True)
class Disagreement:
    """Repeats that differ by more than noise: names of the runs, the signal, rms of the difference [m or rad], and how
    many times the stated noise it is, beside what settings and the place on the belt where a run starts can do.

    Of three repeats and more the last name is that of the run furthest from the median of the others, by rms."""

    runs: tuple[str, ...]
    signal: SignalSheet
    rms: float
    times: float


def words_of(apart: Sequence[Disagreement]) -> str:
    """What the signals of the same repeats say of a change between runs."""
    units = {"lateral": "mm", "tilt": "mrad"}
    sizes = [f"{1e3 * d.rms:.2g} {units[d.signal.kind]} (rms) in {d.signal.name}" for d in apart]
    *others, odd = apart[0].runs
    which = f"runs {' and '.join(apart[0].runs)} are repeats and differ by {' and '.join(sizes)}"
    if len(others) > 1:
        which = f"run {odd} lies furthest from the median of its repeats {', '.join(others)}: {' and '.join(sizes)}"
    return (
        f"{which}, up to {max(d.times for d in apart):.1f} times the stated noise: something changes between runs "
        "(temperature, tension, time of day); their difference is not taken for noise"
    )


def find_disagreements(
    samples: Samples, group: Sequence[int], contrasts: Sequence[Contrast]
) -> tuple[list[Contrast], list[Disagreement]]:
    """Contrasts of repeats (a group of runs, their indices) that are noise, and what the others say of a change between
    runs; of three repeats and more a signal each, of the run furthest off."""
    quiet, found = [], []
    for c in contrasts:
        slow, times = c.project(samples.y)[0], 0.0
        if len(slow) >= FEWEST_MODES:
            ratios, modes, _ = c.modes(Reach())
            times = float(np.sqrt(np.mean((slow @ modes) ** 2 / (1.0 + ratios[: len(slow)]))))
        if times < DISAGREE:
            quiet.append(c)
            continue
        weights = np.array(c.weights) / c.weights[-1]  # the last run less the mean of the others
        apart = weights @ samples.y[list(c.runs), c.signal][:, c.keep]
        size = float(np.sqrt(np.mean((apart - apart.mean()) ** 2)))
        found.append(Disagreement(tuple(samples.runs[r].name for r in c.runs), c.sheet, size, times))
    told = {d.runs for d in found}
    quiet = [c for c in quiet if tuple(samples.runs[r].name for r in c.runs) not in told]
    if len(group) < 3 or not found:
        return quiet, found
    off = {}  # signal -> how far each run is from the median of the others, one constant apart [m or rad], rms
    for s in (s for s, signal in enumerate(samples.signals) if any(d.signal.name == signal.name for d in found)):
        y = samples.y[list(group), s]
        y = y[:, np.isfinite(y).all(axis=0)]
        if y.shape[1] < FEWEST_MODES:
            return quiet, found
        apart = np.stack([y[k] - np.median(np.delete(y, k, axis=0), axis=0) for k in range(len(y))])
        off[samples.signals[s].name] = np.std(apart, axis=1)
    k = int(np.argmax(sum(x / x.max() for x in off.values())))
    names, signals = [samples.runs[r].name for r in group], {d.signal.name: d.signal for d in found}
    runs = (*names[:k], *names[k + 1 :], names[k])
    most = {n: max(d.times for d in found if d.signal.name == n) for n in signals}
    return quiet, [Disagreement(runs, signal, float(off[n][k]), most[n]) for n, signal in signals.items()]


# Levels of one signal.

#: stated levels may be off by this much either way (one sigma of their logarithm); data sheets are no better
LEVEL_SPREAD = 0.35
LEVEL_FACTORS = np.exp(np.linspace(np.log(0.2), np.log(5.0), 35))
TOGETHER = 0.6  # the same of both levels together, where something was read off
LENGTH_SPREAD = 0.8  # the same of the wander length, which few data sheets give at all
LENGTH_STEP = 1.5  # from one length of the grid to the next
GRID_LENGTHS = (0.7, 14.0)  # [m] that the grid covers, the stated length apart
UNREAD_SIGMAS = 1.2  # sigmas from the data sheet, of levels of which nothing is known
MODES = 24  # of a record, into which its Fourier modes are put together
# chi2 (a likelihood ratio of 100) against repeats, beyond which what runs show is not taken for noise
AGAINST_REPEATS = 9.2
TIE = 1e-6  # weight of the data sheet where noise says nothing of a level


NoiseLevel = tuple[float, float, float]


class SignalLevels:
    """How probable levels of one signal are on a grid of lengths, white factors and wander factors, with one kind of
    wander.
    """

    def __init__(
        self, signal: SignalSheet, contrasts: list[Contrast], fast: Sequence[Scatter] = (), *, smooth: bool = False
    ) -> None:
        """fast: what every run shows by itself, beside contrasts of repeats; smooth: the wander is."""
        steps = LENGTH_STEP ** np.arange(-8.0, 9.0)  # of the stated wander length
        inside = [GRID_LENGTHS[0] <= x <= GRID_LENGTHS[1] for x in steps * max(signal.wander_length, 1e-6)]
        self.lengths = steps[inside | (steps == 1.0)] if signal.wander_sd > 0 else np.ones(1)
        self.contrasts = contrasts
        self.fast = list(fast) if contrasts else []
        logs = np.log(LEVEL_FACTORS)
        both = np.linalg.inv(TOGETHER**2 + LEVEL_SPREAD**2 * np.eye(2))
        prior = both[0, 0] * (logs[:, None] ** 2 + logs**2) + 2.0 * both[0, 1] * logs[:, None] * logs
        by_length = np.log(self.lengths) ** 2 / LENGTH_SPREAD**2
        self.prior = by_length[:, None, None] + prior
        self.grids, self.fast_grids = [], []
        for k, reach in enumerate(Reach(float(x), smooth) for x in self.lengths):
            modes = [c.modes(reach) for c in contrasts]
            # ratios of wander to white noise in classes a quarter apart in logarithm
            quarters = 4.0 * np.log(np.maximum(np.concatenate([*(m[0] for m in modes), np.empty(0)]), 1e-8))
            names, of = np.unique(np.round(quarters), return_inverse=True)
            # variance (white factors, wander factors, k) of modes by these ratios (k,)
            of_white, of_wanders = LEVEL_FACTORS[:, None, None] ** 2, LEVEL_FACTORS[None, :, None] ** 2
            variance = of_white + of_wanders * np.exp(names / 4.0)
            self.prior[k] += np.log(variance) @ np.bincount(of, minlength=len(names))
            self.grids.append((modes, of, 1.0 / variance))
            fast_modes = (_fast_modes(f.sheet, f.spacing, f.per_bin, reach) for f in self.fast)
            self.fast_grids.append([(own, of_white + of_wanders * ratios) for ratios, own in fast_modes])
        if contrasts:
            # variance (G, K) of the Fourier modes of one record at every point of the grid, and of how many
            # modes each of the K stands for
            contrast = contrasts[0]
            count = len(contrast.travel)
            first = np.unique(np.geomspace(1, count, MODES).astype(int))
            last = np.append(first[1:], count + 1)
            turn = np.pi * 0.5 * (first + last - 1) / count  # of the phase from sample to sample
            spacing = float(np.median(np.diff(contrast.travel)))
            steps = spacing / (self.lengths * max(signal.wander_length, 1e-6))[:, None]
            wander = signal.wander_sd**2 * of_wander((MATERN_ROOT if smooth else 1.0) * steps, turn, smooth)
            white = max(signal.white, LEAST_NOISE) ** 2 / contrast.per_bin
            f2 = LEVEL_FACTORS**2
            spectra = f2[:, None, None] * white + f2[:, None] * wander[:, None, None, :]
            self.spectra, self.modes_of = spectra.reshape(-1, len(first)), (last - first).astype(float)

    def cost(self, errors: np.ndarray, least: float | None = None) -> np.ndarray:
        """-2 log probability (lengths, white factors, wander factors) after readings (R, S, n).

        A few repeats tell a level to a tenth, all runs to a hundredth; but runs may hold a short wave that no model
        has. So either what is fast in every run is noise, or by odds of exp(-AGAINST_REPEATS/2) it is not, and repeats
        are believed alone. least: of the cost of what is fast, were it noise; by default of this kind of wander.
        """
        every = self.cost_of_every_run(errors)
        least = float(every.min()) if least is None else least
        cost, read = self.prior.copy(), [c.project(errors) for c in self.contrasts]  # of these and the sheet alone
        for k, (modes, of, weights) in enumerate(self.grids):
            rows = [np.empty(0)]
            for (_, slow, fast), (z, windows) in zip(modes, read, strict=True):
                rows += [z @ slow, (windows @ fast).ravel()]
            squares = np.square(np.concatenate(rows))
            cost[k] += weights @ np.bincount(of, squares, minlength=weights.shape[2])
        return cost - 2.0 * np.logaddexp(-0.5 * (every - least), -0.5 * AGAINST_REPEATS)

    def cost_of_every_run(self, errors: np.ndarray) -> np.ndarray:
        """The same of what is fast in every run, were it noise."""
        cost = np.zeros_like(self.prior)
        products = []  # of all windows, with the stated white noise of unit size: there are few directions
        for part in self.fast:
            here = errors[:, part.signal][:, part.keep[: len(part.keep) // WINDOW * WINDOW]]
            there = np.where(np.isfinite(here), here, 0.0)  # what runs of no weight here have not measured
            rows = part.weights @ there * (np.sqrt(part.per_bin) / max(part.sheet.white, LEAST_NOISE))
            windows = rows.reshape(-1, WINDOW) @ _FAST
            products.append((len(windows), windows.T @ windows))
        for k, grids in enumerate(self.fast_grids):
            for (count, squared), (modes, variance) in zip(products, grids, strict=True):
                squares = np.sum((squared @ modes) * modes, axis=0)
                cost[k] += count * np.log(variance).sum(axis=2) + (1.0 / variance) @ squares
        return cost

    def draw(self, errors: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
        """Levels (count, 3) by their probability, spread over the cells of the grid."""
        if not self.contrasts:
            spread = np.array([LEVEL_SPREAD, LEVEL_SPREAD, LENGTH_SPREAD])
            return np.exp(spread * rng.standard_normal((count, 3)).clip(-UNREAD_SIGMAS, UNREAD_SIGMAS))
        cost = self.cost(errors)
        weight = np.exp(-0.5 * (cost - cost.min())).ravel()
        k, i, j = np.unravel_index(rng.choice(weight.size, size=count, p=weight / weight.sum()), cost.shape)
        steps = np.log([LEVEL_FACTORS[1] / LEVEL_FACTORS[0]] * 2 + [LENGTH_STEP])
        within = np.exp(steps * (rng.random((count, 3)) - 0.5))
        return np.stack([LEVEL_FACTORS[i], LEVEL_FACTORS[j], self.lengths[k]], axis=1) * within


def of_wander(steps: np.ndarray, turn: np.ndarray, smooth: bool) -> np.ndarray:
    """Variance (G, K) of modes that turn by so much (K,) a sample, of wander of unit size whose exponential falls by
    ``steps`` (G, 1) a sample; smooth: it is Matern's.
    """
    rise, apart = np.sinh(steps), np.cosh(steps) - np.cos(turn)
    return rise / apart - smooth * steps * (1.0 - np.cosh(steps) * np.cos(turn)) / apart**2


RARER = 6.0  # chi2 (a likelihood ratio of 20) that a smooth wander has to earn, in all signals together
UNTRUSTED = 2.0  # sigmas from the data sheet at which levels without repeats may be a stranger's


class LevelFinder:
    """Probability of noise levels on a grid, from contrasts of runs."""

    def __init__(
        self,
        samples: Samples,
        shapes: np.ndarray,
        columns: np.ndarray | None = None,
        coming_round: np.ndarray | None = None,
    ) -> None:
        """shapes (K, R, S, n): what else may differ between repeats (settings) where predictions are taken, in units of
        one sigma; columns (k, R, S, n): what all candidates could do to the readings; without them single runs tell
        nothing; coming_round (k, R, S, n): what differs between repeats that start elsewhere on the belt, if they do.
        """
        self.samples, self.shapes, self.columns, self.coming_round = samples, shapes, columns, coming_round
        # indices of runs with the same settings, group by group, where there are two or more
        found: dict[tuple, list[int]] = {}
        for k, run in enumerate(samples.runs):
            settings = run.tension, run.yaw, run.yaw_head, run.speed, run.direction, run.yaw_at
            found.setdefault(settings, []).append(k)
        self.groups = [tuple(runs) for runs in found.values() if len(runs) > 1]
        differing = shapes if coming_round is None else np.concatenate([shapes, coming_round])
        contrasts, self.disagreements = list[Contrast](), list[Disagreement]()
        for group in self.groups:
            # every run against the mean of those before it (Helmert), but those sampled at other travels than the first
            alike, made = [r for r in group if np.allclose(samples.travel[r], samples.travel[group[0]])], []
            for k, s in product(range(1, len(alike)), range(len(samples.signals))):
                weights = np.array([-1.0 / k] * k + [1.0]) / np.sqrt(1.0 + 1.0 / k)
                made.append(contrast(samples, differing, alike[: k + 1], weights, s))
            quiet, apart = find_disagreements(samples, group, [c for c in made if c is not None])
            contrasts, self.disagreements = contrasts + quiet, self.disagreements + apart
        self.repeats = len({c.runs for c in contrasts})
        if columns is not None and not contrasts:  # every run by itself, beside what all these could do to it
            known, records = np.concatenate([shapes, columns]), np.ndindex(samples.y.shape[:2])
            made = [contrast(samples, known, (r,), (1.0,), s) for r, s in records]
            contrasts = [c for c in made if c is not None]
        of_signal = [[c for c in contrasts if c.signal == s] for s in range(len(samples.signals))]
        fast = [find_scatter(samples, self.groups, s) if self.repeats else [] for s in range(len(samples.signals))]
        each = list(zip(samples.signals, of_signal, fast, strict=True))
        self.signals, self.smooth = ([SignalLevels(*one, smooth=kind) for one in each] for kind in (False, True))
        # for every signal of which nothing was read, those that were read and are stated alike; none for others
        stated = [(s.kind, s.white, s.wander_sd, s.wander_length) for s in samples.signals]
        read = [k for k, own in enumerate(of_signal) if own]
        self.signals_alike = [
            [] if own else [r for r in read if stated[r] == stated[k]] for k, own in enumerate(of_signal)
        ]

    def __call__(self, errors: np.ndarray) -> Levels:
        """Levels to be expected after what a model leaves of the readings (R, S, n)."""
        share = self.smooth_share(errors)
        read: list[NoiseLevel] = []
        for rough, smooth in zip(self.signals, self.smooth, strict=True):
            if not rough.contrasts:
                read.append((1.0, 1.0, 1.0))
                continue
            # the mean (K,) of the spectra of both kinds that the readings leave possible: white noise and a short
            # wander stand in for each other along a bent ridge, and levels averaged one by one lie inside the bend,
            # where noise is smaller than anywhere on the ridge
            means = []
            for kind in (rough, smooth):
                cost = kind.cost(errors).ravel()
                weight = np.exp(-0.5 * (cost - cost.min()))
                means.append(weight @ kind.spectra / weight.sum())
            mean, likelier = (1.0 - share) * means[0] + share * means[1], smooth if share > 0.5 else rough
            # of the likelier kind the levels whose spectrum stands best for it: that from which normal noise of the
            # mean one is hardest to tell (Kullback and Leibler)
            apart = (1.0 / likelier.spectra) @ (mean * likelier.modes_of) + np.log(likelier.spectra) @ likelier.modes_of
            k, i, j = np.unravel_index(np.argmin(apart + TIE * likelier.prior.ravel()), likelier.prior.shape)
            read.append((float(LEVEL_FACTORS[i]), float(LEVEL_FACTORS[j]), float(likelier.lengths[k])))
        best = [
            np.exp(np.mean(np.log([read[s] for s in alike]), axis=0)).tolist() if alike else read[k]
            for k, alike in enumerate(self.signals_alike)
        ]
        white, wander, length = zip(*best, strict=True)
        off = np.abs(np.log([*white, *wander])) > UNTRUSTED * LEVEL_SPREAD
        far = off.any() or (np.abs(np.log(length)) > UNTRUSTED * LENGTH_SPREAD).any()
        return Levels(
            white=white,
            wander=wander,
            length=length,
            smooth=share > 0.5,
            repeats=self.repeats,
            read=any(signal.contrasts for signal in self.signals),
            trusted=not (self.repeats == 0 and far),
        )

    def smooth_share(self, errors: np.ndarray) -> float:
        """Probability that the wander is smooth, after what a model leaves of readings (R, S, n)."""
        odds = -RARER  # twice their logarithm, all levels together
        for kinds in zip(self.smooth, self.signals, strict=True):
            # readings without any noise, as of a campaign that is planned, favour neither
            if any(np.any(part) for c in kinds[0].contrasts for part in c.project(errors)):
                least = min(float(kind.cost_of_every_run(errors).min()) for kind in kinds)
                first, second = (np.logaddexp.reduce(-0.5 * kind.cost(errors, least), axis=None) for kind in kinds)
                odds += 2.0 * float(first - second)
        return float(1.0 / (1.0 + np.exp(-0.5 * np.clip(odds, -100.0, 100.0))))

    def draw(self, errors: np.ndarray, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Levels (count, S, 3) that the readings (R, S, n) leave possible, by their probability, and whether the wander
        is smooth (count,).
        """
        smooth = rng.random(count) < self.smooth_share(errors)
        each = np.empty((count, len(self.signals), 3))
        for kind, signals in ((smooth, self.smooth), (~smooth, self.signals)):
            for k, signal in enumerate(signals if kind.any() else []):
                each[kind, k] = signal.draw(errors, int(kind.sum()), rng)
        for k, alike in enumerate(self.signals_alike):
            if alike:
                each[:, k] = each[np.arange(count), rng.choice(alike, size=count)]
        return each, smooth
