"""How large the noise is, signal by signal: white noise, wander, how far wander reaches, and whether it is smooth.

What is known beforehand is the data sheet. What is read off are contrasts in which no model appears: differences of
repeated runs. Without repeats it is what single runs leave beside everything that settings, sensors and all candidates
could do to them; that may hold a stranger as well as noise, and is trusted only where it agrees with the sheet. A
sensor of which nothing was read is as others are that are stated alike: instruments of one make are off together.

A smooth wander has more of long waves and less of short ones than any rough one: taken for rough it leaves waves that
look like something missing. Where readings do not tell, both are drawn, each as often as it is probable.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from belt_sim.campaign import SignalSheet
from belt_sim.diagnosis.noise.contrasts import Contrast, Scatter, contrast, scatter
from belt_sim.diagnosis.noise.metric import FLOOR, SMOOTH, Levels, Reach
from belt_sim.diagnosis.readings.samples import Samples


def repeated_groups(samples: Samples) -> list[tuple[int, ...]]:
    """Indices of runs with the same settings, group by group, where there are two or more."""
    found: dict[tuple, list[int]] = {}
    for k, run in enumerate(samples.runs):
        settings = run.tension, run.yaw, run.yaw_head, run.speed, run.direction, run.yaw_at
        found.setdefault(settings, []).append(k)
    return [tuple(runs) for runs in found.values() if len(runs) > 1]


def differences(samples: Samples, shapes: np.ndarray, group: tuple[int, ...]) -> list[Contrast]:
    """Every run of a group against the mean of those before it (Helmert), for every signal; runs sampled at other
    travels than the first are left out.
    """
    first = samples.travel[group[0]]
    alike = [r for r in group if np.allclose(samples.travel[r], first)]
    found = []
    for k in range(1, len(alike)):
        weights = np.array([-1.0 / k] * k + [1.0]) / np.sqrt(1.0 + 1.0 / k)
        runs = tuple(alike[: k + 1])
        made = [contrast(samples, shapes, runs, tuple(weights), s) for s in range(len(samples.signals))]
        found += [c for c in made if c is not None]
    return found


#: Times the stated noise, from which repeats tell of a change between runs and not of noise. Sheets are off by 40 %
#: (LEVEL_SPREAD), so that this is 2.6 sigma from the sheet, over a dozen and more independent modes.
DISAGREE, FEWEST_MODES = 2.5, 12


@dataclass(frozen=True)
class Disagreement:
    """Repeats that differ by more than noise: names of the runs, the signal, rms of the difference [m or rad], and how
    many times the stated noise it is, beside what settings and the place on the belt where a run starts can do."""

    runs: tuple[str, ...]
    signal: SignalSheet
    rms: float
    times: float


def words_of(apart: Sequence[Disagreement]) -> str:
    """What the signals of the same repeats say of a change between runs."""
    units = {"lateral": "mm", "tilt": "mrad"}
    sizes = [f"{1e3 * d.rms:.2g} {units[d.signal.kind]} (rms) in {d.signal.name}" for d in apart]
    return (
        f"runs {' and '.join(apart[0].runs)} are repeats and differ by {' and '.join(sizes)}, up to "
        f"{max(d.times for d in apart):.1f} times the stated noise: something changes between runs (temperature, "
        "tension, time of day); their difference is not taken for noise"
    )


def disagreement(samples: Samples, c: Contrast) -> Disagreement | None:
    """What a contrast of repeats says of a change between runs, if anything."""
    slow = c.project(samples.y)[0]
    if len(slow) < FEWEST_MODES:
        return None
    ratios, modes, _ = c.modes(Reach())
    times = float(np.sqrt(np.mean((slow @ modes) ** 2 / (1.0 + ratios[: len(slow)]))))
    if times < DISAGREE:
        return None
    weights = np.array(c.weights) / c.weights[-1]  # the last run less the mean of the others
    apart = weights @ samples.y[list(c.runs), c.signal][:, c.keep]
    names = tuple(samples.runs[r].name for r in c.runs)
    return Disagreement(names, c.sheet, float(np.sqrt(np.mean((apart - apart.mean()) ** 2))), times)


# Levels of one signal.

#: stated levels may be off by this much either way (one sigma of their logarithm); data sheets are no better
LEVEL_SPREAD = 0.35
FACTORS = np.exp(np.linspace(np.log(0.2), np.log(5.0), 35))
TOGETHER = 0.6  # the same of both levels together, where something was read off
LENGTH_SPREAD = 0.8  # the same of the wander length, which few data sheets give at all
LENGTH_STEP = 1.5  # from one length of the grid to the next
LENGTHS = (0.7, 14.0)  # [m] that the grid covers, the stated length apart
MOST = 1.2  # sigmas from the data sheet, of levels of which nothing is known
MODES = 24  # of a record, into which its Fourier modes are put together
BEYOND = 9.2  # chi2 (a likelihood ratio of 100) against repeats, beyond which what runs show is not taken for noise
TIE = 1e-6  # weight of the data sheet where noise says nothing of a level


Level = tuple[float, float, float]


class SignalLevels:
    """How probable levels of one signal are on a grid of lengths, white factors and wander factors, with one kind of
    wander.
    """

    def __init__(
        self, signal: SignalSheet, contrasts: list[Contrast], fast: Sequence[Scatter] = (), *, smooth: bool = False
    ) -> None:
        """fast: what every run shows by itself, beside contrasts of repeats; smooth: the wander is."""
        self.contrasts, self.lengths = contrasts, _lengths(signal)
        self.fast = list(fast) if contrasts else []
        logs = np.log(FACTORS)
        both = np.linalg.inv(TOGETHER**2 + LEVEL_SPREAD**2 * np.eye(2))
        prior = both[0, 0] * (logs[:, None] ** 2 + logs**2) + 2.0 * both[0, 1] * logs[:, None] * logs
        by_length = np.log(self.lengths) ** 2 / LENGTH_SPREAD**2
        self.prior = by_length[:, None, None] + prior
        self.grids, self.fast_grids = [], []
        for k, reach in enumerate(Reach(float(x), smooth) for x in self.lengths):
            modes = [c.modes(reach) for c in contrasts]
            classes, of = _classes(np.concatenate([*(ratios for ratios, _, _ in modes), np.empty(0)]))
            variance = _variance(classes)
            self.prior[k] += np.log(variance) @ np.bincount(of, minlength=len(classes))
            self.grids.append((modes, of, 1.0 / variance))
            self.fast_grids.append([(own, _variance(ratios)) for ratios, own in (f.modes(reach) for f in self.fast)])
        if contrasts:
            self.spectra, self.modes_of = _spectra(signal, contrasts[0], self.lengths, smooth)

    def cost(self, errors: np.ndarray, least: float | None = None) -> np.ndarray:
        """-2 log probability (lengths, white factors, wander factors) after readings (R, S, n).

        A few repeats tell a level to a tenth, all runs to a hundredth; but runs may hold a short wave that no model
        has. So either what is fast in every run is noise, or by odds of exp(-BEYOND/2) it is not, and repeats are
        believed alone. least: of the cost of what is fast, were it noise; by default of this kind of wander.
        """
        fast = self.cost_of_every_run(errors)
        least = float(fast.min()) if least is None else least
        return self.cost_of_contrasts(errors) - 2.0 * np.logaddexp(-0.5 * (fast - least), -0.5 * BEYOND)

    def cost_of_contrasts(self, errors: np.ndarray) -> np.ndarray:
        """The same of contrasts and the data sheet alone."""
        cost, read = self.prior.copy(), [c.project(errors) for c in self.contrasts]
        for k, (modes, of, weights) in enumerate(self.grids):
            rows = [np.empty(0)]
            for (_, slow, fast), (z, windows) in zip(modes, read, strict=True):
                rows += [z @ slow, (windows @ fast).ravel()]
            squares = np.square(np.concatenate(rows))
            cost[k] += weights @ np.bincount(of, squares, minlength=weights.shape[2])
        return cost

    def cost_of_every_run(self, errors: np.ndarray) -> np.ndarray:
        """The same of what is fast in every run, were it noise."""
        cost = np.zeros_like(self.prior)
        read = [part.project(errors) for part in self.fast]
        products = [(len(z), z.T @ z) for z in read]  # of all windows: there are few directions, and many windows
        for k, grids in enumerate(self.fast_grids):
            for (count, product), (modes, variance) in zip(products, grids, strict=True):
                squares = np.sum((product @ modes) * modes, axis=0)
                cost[k] += count * np.log(variance).sum(axis=2) + (1.0 / variance) @ squares
        return cost

    def mean(self, errors: np.ndarray) -> np.ndarray:
        """The mean (K,) of the spectra that the readings (R, S, n) leave possible.

        White noise and a short wander stand in for each other along a bent ridge; levels averaged one by one lie
        inside the bend, where noise is smaller than anywhere on the ridge. So spectra are averaged.
        """
        cost = self.cost(errors).ravel()
        weight = np.exp(-0.5 * (cost - cost.min()))
        return weight @ self.spectra / weight.sum()

    def nearest(self, mean: np.ndarray) -> Level:
        """(white, wander, length) on the grid whose spectrum stands best for a ``mean`` (K,): that from which normal
        noise of the mean one is hardest to tell (Kullback and Leibler).
        """
        apart = (1.0 / self.spectra) @ (mean * self.modes_of) + np.log(self.spectra) @ self.modes_of
        k, i, j = np.unravel_index(np.argmin(apart + TIE * self.prior.ravel()), self.prior.shape)
        return float(FACTORS[i]), float(FACTORS[j]), float(self.lengths[k])

    def draw(self, errors: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
        """Levels (count, 3) by their probability, spread over the cells of the grid."""
        if not self.contrasts:
            spread = np.array([LEVEL_SPREAD, LEVEL_SPREAD, LENGTH_SPREAD])
            return np.exp(spread * rng.standard_normal((count, 3)).clip(-MOST, MOST))
        cost = self.cost(errors)
        weight = np.exp(-0.5 * (cost - cost.min())).ravel()
        k, i, j = np.unravel_index(rng.choice(weight.size, size=count, p=weight / weight.sum()), cost.shape)
        steps = np.log([FACTORS[1] / FACTORS[0]] * 2 + [LENGTH_STEP])
        within = np.exp(steps * (rng.random((count, 3)) - 0.5))
        return np.stack([FACTORS[i], FACTORS[j], self.lengths[k]], axis=1) * within


def _variance(ratios: np.ndarray) -> np.ndarray:
    """Variance (white factors, wander factors, k) of modes with such ratios (k,) of wander to white noise."""
    return FACTORS[:, None, None] ** 2 + FACTORS[None, :, None] ** 2 * ratios


def favours(one: SignalLevels, other: SignalLevels, errors: np.ndarray) -> float:
    """2 log odds of one kind of wander against another, all levels together, after readings (R, S, n); 0 of readings
    without any noise, as of a campaign that is planned.
    """
    if not any(np.any(part) for c in one.contrasts for part in c.project(errors)):
        return 0.0
    least = min(float(kind.cost_of_every_run(errors).min()) for kind in (one, other))
    first, second = (2.0 * np.logaddexp.reduce(-0.5 * kind.cost(errors, least), axis=None) for kind in (one, other))
    return float(first - second)


def _spectra(
    signal: SignalSheet, contrast: Contrast, lengths: np.ndarray, smooth: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Variance (G, K) of the Fourier modes of one record at every point of the grid, and of how many modes each of
    the K stands for.
    """
    count = len(contrast.travel)
    first = np.unique(np.geomspace(1, count, MODES).astype(int))
    last = np.append(first[1:], count + 1)
    turn = np.pi * 0.5 * (first + last - 1) / count  # of the phase from sample to sample
    spacing = float(np.median(np.diff(contrast.travel)))
    steps = spacing / (lengths * max(signal.wander_length, 1e-6))[:, None]
    wander = signal.wander_sd**2 * of_wander((SMOOTH if smooth else 1.0) * steps, turn, smooth)
    white = max(signal.white, FLOOR) ** 2 / contrast.per_bin
    f2 = FACTORS**2
    spectra = f2[:, None, None] * white + f2[:, None] * wander[:, None, None, :]
    return spectra.reshape(-1, len(first)), (last - first).astype(float)


def of_wander(steps: np.ndarray, turn: np.ndarray, smooth: bool) -> np.ndarray:
    """Variance (G, K) of modes that turn by so much (K,) a sample, of wander of unit size whose exponential falls by
    ``steps`` (G, 1) a sample; smooth: it is Matern's.
    """
    rise, apart = np.sinh(steps), np.cosh(steps) - np.cos(turn)
    return rise / apart - smooth * steps * (1.0 - np.cosh(steps) * np.cos(turn)) / apart**2


def _lengths(signal: SignalSheet) -> np.ndarray:
    """Factors on the stated wander length."""
    steps = LENGTH_STEP ** np.arange(-8.0, 9.0)
    lengths = steps * max(signal.wander_length, 1e-6)
    inside = (lengths >= LENGTHS[0]) & (lengths <= LENGTHS[1])
    return steps[inside | (steps == 1.0)] if signal.wander_sd > 0 else np.ones(1)


def _classes(ratios: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ratios of wander to white noise in classes a quarter apart in logarithm: the classes, and which is whose."""
    steps = np.round(4.0 * np.log(np.maximum(ratios, 1e-8)))
    names, of = np.unique(steps, return_inverse=True)
    return np.exp(names / 4.0), of.reshape(-1)


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
        self.groups = repeated_groups(samples)
        differing = shapes if coming_round is None else np.concatenate([shapes, coming_round])
        contrasts = [c for group in self.groups for c in differences(samples, differing, group)]
        self.disagreements = [d for c in contrasts if (d := disagreement(samples, c)) is not None]
        apart = {d.runs for d in self.disagreements}
        contrasts = [c for c in contrasts if tuple(samples.runs[r].name for r in c.runs) not in apart]
        self.repeats = len({c.runs for c in contrasts})
        if columns is not None and not contrasts:  # every run by itself, beside what all these could do to it
            known, records = np.concatenate([shapes, columns]), np.ndindex(samples.y.shape[:2])
            made = [contrast(samples, known, (r,), (1.0,), s) for r, s in records]
            contrasts = [c for c in made if c is not None]
        of_signal = [[c for c in contrasts if c.signal == s] for s in range(len(samples.signals))]
        fast = [scatter(samples, self.groups, s) if self.repeats else [] for s in range(len(samples.signals))]
        each = list(zip(samples.signals, of_signal, fast, strict=True))
        self.signals, self.smooth = ([SignalLevels(*one, smooth=kind) for one in each] for kind in (False, True))

    def at_shapes(self, shapes: np.ndarray) -> "LevelFinder":
        """The same where predictions are taken elsewhere: one of two repeats may have been set 3 sigma off the other,
        and what they leave follows the ``shapes`` there; to others it looks like wander.
        """
        return LevelFinder(self.samples, shapes, self.columns, self.coming_round)

    def __call__(self, errors: np.ndarray) -> Levels:
        """Levels to be expected after what a model leaves of the readings (R, S, n)."""
        share = self.smooth_share(errors)
        read: list[Level] = []
        for rough, smooth in zip(self.signals, self.smooth, strict=True):
            if rough.contrasts:  # of the likelier kind the levels nearest to the mean spectrum of all of both
                mean = (1.0 - share) * rough.mean(errors) + share * smooth.mean(errors)
                read.append((smooth if share > 0.5 else rough).nearest(mean))
            else:
                read.append((1.0, 1.0, 1.0))
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
        odds = sum(favours(*pair, errors) for pair in zip(self.smooth, self.signals, strict=True)) - RARER
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

    @cached_property
    def signals_alike(self) -> list[list[int]]:
        """For every signal of which nothing was read, those that were read and are stated alike; none for others."""
        read = [k for k, signal in enumerate(self.signals) if signal.contrasts]
        stated = [(s.kind, s.white, s.wander_sd, s.wander_length) for s in self.samples.signals]
        return [
            [] if signal.contrasts else [r for r in read if stated[r] == stated[k]]
            for k, signal in enumerate(self.signals)
        ]
