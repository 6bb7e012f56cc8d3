"""Levels of one signal: how probable white noise, wander and its length are on a grid, one kind of wander at a time."""

from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np

from belt_sim.campaign import SignalSheet
from belt_sim.diagnosis.noise.contrasts import Contrast, Scatter
from belt_sim.diagnosis.noise.covariance import FLOOR, SMOOTH, Reach

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
    """The grid of one signal: white factors, wander factors, length factors."""

    def __init__(
        self, signal: SignalSheet, contrasts: list[Contrast], fast: Sequence[Scatter] = (), *, smooth: bool = False
    ) -> None:
        """fast: what every run shows by itself, beside contrasts of repeats; smooth: the wander is."""
        self.contrasts, self.lengths = contrasts, _lengths(signal)
        reaches = [Reach(float(x), smooth) for x in self.lengths]
        self.reaches, self.fast = reaches, list(fast) if contrasts else []
        f2, logs = FACTORS**2, np.log(FACTORS)
        both = np.linalg.inv(TOGETHER**2 + LEVEL_SPREAD**2 * np.eye(2))
        prior = both[0, 0] * (logs[:, None] ** 2 + logs**2) + 2.0 * both[0, 1] * logs[:, None] * logs
        by_length = np.log(self.lengths) ** 2 / LENGTH_SPREAD**2
        self.prior = by_length[:, None, None] + prior
        self.modes, self.places, self.weights = [], [], []
        for k, reach in enumerate(reaches):
            modes = [c.modes(reach) for c in contrasts]
            ends = np.cumsum([0, *(len(m.ratios) for m in modes)])
            classes, of = _classes(np.concatenate([*(m.ratios for m in modes), np.empty(0)]))
            variance = f2[:, None, None] + f2[None, :, None] * classes
            self.prior[k] += np.log(variance) @ np.bincount(of, minlength=len(classes))
            self.modes.append(modes)
            self.places.append([np.eye(len(classes))[of[a:b]] for a, b in pairwise(ends)])
            self.weights.append((1.0 / variance).reshape(len(FACTORS) ** 2, len(classes)).T)
        if contrasts:
            self.spectra, self.modes_of = _spectra(signal, contrasts[0], self.lengths, smooth)

    def cost(self, errors: np.ndarray) -> np.ndarray:
        """-2 log probability (B, lengths, white factors, wander factors)."""
        cost = self._of_contrasts(errors)
        if not self.fast:
            return cost
        fast = self._of_every_run(errors)
        return cost + _noise_or_not(fast, fast.min(axis=(1, 2, 3)))

    def _of_contrasts(self, errors: np.ndarray) -> np.ndarray:
        cost = np.repeat(self.prior[None], len(errors), axis=0)
        read = [c.project(errors) for c in self.contrasts]
        for k, modes in enumerate(self.modes):
            squares = sum(
                (m.squares(z) @ place for m, z, place in zip(modes, read, self.places[k], strict=True)),
                np.zeros((len(errors), self.weights[k].shape[0])),
            )
            cost[:, k] += (squares @ self.weights[k]).reshape(cost.shape[0], *cost.shape[2:])
        return cost

    def _of_every_run(self, errors: np.ndarray) -> np.ndarray:
        """Of what is fast in every run, were it noise: -2 log probability (B, lengths, white factors, wander ones)."""
        shape = len(FACTORS), len(FACTORS)
        cost = np.zeros((len(errors), len(self.lengths), *shape))
        for part, of_lengths in zip(self.fast, self._fast_grids, strict=True):
            z = part.project(errors)
            products = z.swapaxes(1, 2) @ z  # of all windows together: there are few directions, and many windows
            for k, (modes, logs, weights) in enumerate(of_lengths):
                squares = np.sum((products @ modes) * modes, axis=1)
                cost[:, k] += logs
                cost[:, k] += (squares @ weights).reshape(-1, *shape)
        return cost

    @cached_property
    def _fast_grids(self) -> list[list[tuple[np.ndarray, np.ndarray, np.ndarray]]]:
        """Of what is fast in every run, at every length: modes, the logarithms of their variances all together on the
        grid of both factors, and what each weighs there."""
        f2, found = FACTORS**2, []
        for part in self.fast:
            of_lengths = []
            for ratios, modes in map(part.modes, self.reaches):
                variance = f2[:, None, None] + f2[None, :, None] * ratios
                logs = part.count * np.log(variance).sum(axis=2)
                of_lengths.append((modes, logs, (1.0 / variance).reshape(-1, len(ratios)).T))
            found.append(of_lengths)
        return found

    def mean(self, errors: np.ndarray) -> np.ndarray:
        """The mean (B, K) of the spectra that the readings (B, R, S, n) leave possible.

        White noise and a short wander stand in for each other along a bent ridge; levels averaged one by one lie
        inside the bend, where noise is smaller than anywhere on the ridge. So spectra are averaged.
        """
        cost = self.cost(errors).reshape(len(errors), -1)
        weight = np.exp(-0.5 * (cost - cost.min(axis=1, keepdims=True)))
        return weight @ self.spectra / weight.sum(axis=1, keepdims=True)

    def nearest(self, mean: np.ndarray) -> list[Level]:
        """(white, wander, length) on the grid whose spectrum stands best for a ``mean`` (B, K): that from which normal
        noise of the mean one is hardest to tell (Kullback and Leibler).
        """
        inverse, own = self._of_spectra
        nearest = np.argmin((mean * self.modes_of) @ inverse + own + TIE * self.prior.ravel(), axis=1)
        k, i, j = np.unravel_index(nearest, self.prior.shape)
        return [(float(a), float(b), float(c)) for a, b, c in zip(FACTORS[i], FACTORS[j], self.lengths[k], strict=True)]

    @cached_property
    def _of_spectra(self) -> tuple[np.ndarray, np.ndarray]:
        """1 / the spectra (K, G), and their logarithms together (G,)."""
        return (1.0 / self.spectra).T, np.log(self.spectra) @ self.modes_of

    def draw(self, errors: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
        """Levels (count, 3) by their probability, spread over the cells of the grid."""
        if not self.contrasts:
            spread = np.array([LEVEL_SPREAD, LEVEL_SPREAD, LENGTH_SPREAD])
            return np.exp(spread * rng.standard_normal((count, 3)).clip(-MOST, MOST))
        cost = self.cost(errors[None])[0]
        weight = np.exp(-0.5 * (cost - cost.min())).ravel()
        k, i, j = np.unravel_index(rng.choice(weight.size, size=count, p=weight / weight.sum()), cost.shape)
        steps = np.log([FACTORS[1] / FACTORS[0]] * 2 + [LENGTH_STEP])
        within = np.exp(steps * (rng.random((count, 3)) - 0.5))
        return np.stack([FACTORS[i], FACTORS[j], self.lengths[k]], axis=1) * within


def _noise_or_not(cost: np.ndarray, least: np.ndarray) -> np.ndarray:
    """-2 log probability (B, ...) of what is fast in every run, from that were it noise and the ``least`` of it (B,).

    A few repeats tell a level to a tenth, all runs to a hundredth; but runs may hold a short wave that no model has. So
    either it is noise, or by odds of exp(-BEYOND/2) it is not, and repeats are believed alone.
    """
    cost = cost - least[:, None, None, None]
    known, near = np.full_like(cost, -0.5 * BEYOND), cost < BEYOND + 75.0  # further off it changes no digit
    return -2.0 * np.logaddexp(-0.5 * cost, -0.5 * BEYOND, out=known, where=near)


def favours(one: SignalLevels, other: SignalLevels, errors: np.ndarray) -> np.ndarray:
    """2 log odds (B,) of one kind of wander against another, all levels together, after readings (B, R, S, n); 0 of
    readings without any noise, as of a campaign that is planned.
    """
    if not any(np.any(part) for c in one.contrasts for part in c.project(errors)):
        return np.zeros(len(errors))
    costs = [kind._of_contrasts(errors) for kind in (one, other)]
    if one.fast:
        fast = [kind._of_every_run(errors) for kind in (one, other)]
        least = np.min([cost.min(axis=(1, 2, 3)) for cost in fast], axis=0)
        costs = [cost + _noise_or_not(further, least) for cost, further in zip(costs, fast, strict=True)]
    return _evidence(costs[0]) - _evidence(costs[1])


def _evidence(cost: np.ndarray) -> np.ndarray:
    """2 log of the sum (B,) of probabilities, of which ``cost`` (B, ...) is -2 log."""
    cost = cost.reshape(len(cost), -1)
    least = cost.min(axis=1)
    return 2.0 * np.log(np.sum(np.exp(-0.5 * (cost - least[:, None])), axis=1)) - least


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
