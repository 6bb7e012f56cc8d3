"""How large the noise is, signal by signal: white noise, wander, how far wander reaches, and whether it is smooth.

What is known beforehand is the data sheet. What is read off are contrasts in which no model appears: differences of
repeated runs. Without repeats it is what single runs leave beside everything that settings, sensors and all candidates
could do to them; that may hold a stranger as well as noise, and is trusted only where it agrees with the sheet. A
sensor of which nothing was read is as others are that are stated alike: instruments of one make are off together.

A smooth wander has more of long waves and less of short ones than any rough one: taken for rough it leaves waves that
look like something missing. Where readings do not tell, both are drawn, each as often as it is probable.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from belt_sim.campaign import Run
from belt_sim.diagnosis.noise.contrasts import Contrast, contrast, scatter
from belt_sim.diagnosis.noise.covariance import Levels
from belt_sim.diagnosis.noise.metric import AT_ONCE
from belt_sim.diagnosis.noise.signal_levels import LENGTH_SPREAD, LEVEL_SPREAD, Level, SignalLevels, favours
from belt_sim.diagnosis.readings.samples import Samples


def repeated_groups(samples: Samples) -> list[tuple[int, ...]]:
    """Indices of runs with the same settings, group by group, where there are two or more."""
    found: dict[tuple, list[int]] = {}
    for k, run in enumerate(samples.runs):
        found.setdefault(_settings_of(run), []).append(k)
    return [tuple(runs) for runs in found.values() if len(runs) > 1]


def _settings_of(run: Run) -> tuple:
    return run.tension, run.yaw, run.yaw_head, run.speed, run.direction, run.yaw_at


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


def single_runs(samples: Samples, columns: np.ndarray) -> list[Contrast]:
    """Every run and signal, beside what columns (k, R, S, n) could do to it."""
    made = [
        contrast(samples, columns, (r,), (1.0,), s)
        for r in range(len(samples.runs))
        for s in range(len(samples.signals))
    ]
    return [c for c in made if c is not None]


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
        self.repeats = len({c.runs for c in contrasts})
        if columns is not None and not contrasts:
            contrasts = single_runs(samples, np.concatenate([shapes, columns]))
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
        return self.many(errors[None])[0]

    def many(self, errors: np.ndarray) -> list[Levels]:
        """The same for many sets of readings (B, R, S, n)."""
        share = self.smooth_share(errors)
        read = [self._estimate(pair, errors, share) for pair in zip(self.signals, self.smooth, strict=True)]
        best = [_mean_of_alike([read[s] for s in alike], read[k]) for k, alike in enumerate(self.signals_alike)]
        found = []
        for k in range(len(errors)):
            white, wander, length = zip(*(b[k] for b in best), strict=True)
            far = self.repeats == 0 and _far_off(white, wander, length)
            found.append(
                Levels(
                    white=white,
                    wander=wander,
                    length=length,
                    smooth=bool(share[k] > 0.5),
                    repeats=self.repeats,
                    read=any(signal.contrasts for signal in self.signals),
                    trusted=not far,
                )
            )
        return found

    def smooth_share(self, errors: np.ndarray) -> np.ndarray:
        """Probability (B,) that the wander is smooth, after what a model leaves of readings (B, R, S, n)."""
        pairs = zip(self.smooth, self.signals, strict=True)
        odds = sum((favours(*pair, errors) for pair in pairs), np.full(len(errors), -RARER))
        return 1.0 / (1.0 + np.exp(-0.5 * odds.clip(-100.0, 100.0)))

    def _estimate(self, pair: tuple[SignalLevels, SignalLevels], errors: np.ndarray, share: np.ndarray) -> list[Level]:
        """Of one signal, in every set: of the likelier kind the levels nearest to the mean spectrum of all of both."""
        found: list[Level] = []
        for start in range(0, len(errors), AT_ONCE):
            part, odds = errors[start : start + AT_ONCE], share[start : start + AT_ONCE]
            if not pair[0].contrasts:
                found += [(1.0, 1.0, 1.0)] * len(part)
                continue
            rough, smooth = (signal.mean(part) for signal in pair)
            mean = (1.0 - odds)[:, None] * rough + odds[:, None] * smooth
            both = zip(*(signal.nearest(mean) for signal in pair), odds, strict=True)
            found += [of_smooth if odd > 0.5 else of_rough for of_rough, of_smooth, odd in both]
        return found

    def draw(self, errors: np.ndarray, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Levels (count, S, 3) that the readings (R, S, n) leave possible, by their probability, and whether the wander
        is smooth (count,).
        """
        smooth = rng.random(count) < self.smooth_share(errors[None])[0]
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


def _mean_of_alike(others: list[list[Level]], own: list[Level]) -> list[Level]:
    """(white, wander, length) of one signal in every set of readings: the means of others, in logarithm, if any."""
    if not others:
        return own
    means = np.exp(np.mean(np.log(others), axis=0))
    return [(float(a), float(b), float(c)) for a, b, c in means]


def _far_off(white: Sequence[float], wander: Sequence[float], length: Sequence[float]) -> bool:
    """Whether levels are so far from the data sheet that something else may be in them."""
    off = np.abs(np.log([*white, *wander])) > UNTRUSTED * LEVEL_SPREAD
    return bool(off.any() or (np.abs(np.log(length)) > UNTRUSTED * LENGTH_SPREAD).any())
