"""How large the noise is, signal by signal: white noise, wander, and how far wander reaches.

What is known beforehand is the data sheet. What is read off are contrasts in which no model appears: differences of
repeated runs. Without repeats it is what single runs leave beside everything that settings, sensors and all candidates
could do to them; that may hold a stranger as well as noise, and is trusted only where it agrees with the sheet.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from belt_sim.campaign import Run, SignalSheet
from belt_sim.diagnosis.contrasts import Contrast, contrast
from belt_sim.diagnosis.noise import Levels
from belt_sim.diagnosis.samples import Samples

#: stated levels may be off by this much either way (one sigma of their logarithm); data sheets are no better
LEVEL_SPREAD = 0.35
FACTORS = np.exp(np.linspace(np.log(0.2), np.log(5.0), 35))
TOGETHER = 0.6  # the same of both levels together, where something was read off
LENGTH_SPREAD = 0.8  # the same of the wander length, which few data sheets give at all
LENGTH_STEP = 1.5  # from one length of the grid to the next
LENGTHS = (0.7, 14.0)  # [m] that the grid covers, the stated length apart
UNTRUSTED = 2.0  # sigmas from the data sheet at which levels without repeats may be a stranger's
MOST = 1.2  # sigmas from the data sheet, of levels of which nothing is known


class LevelFinder:
    """Probability of noise levels on a grid, from contrasts of runs."""

    def __init__(self, samples: Samples, shapes: np.ndarray, columns: np.ndarray | None = None) -> None:
        """shapes (K, R, S, n): what else may differ between repeats (settings), in units of one sigma; columns
        (k, R, S, n): what all candidates could do to the readings; without them single runs tell nothing.
        """
        self.groups = repeated_groups(samples)
        contrasts = [c for group in self.groups for c in _differences(samples, shapes, group)]
        self.repeats = len({c.runs for c in contrasts})
        if columns is not None and not contrasts:
            contrasts = _single_runs(samples, np.concatenate([shapes, columns]))
        self.signals = [
            _SignalLevels(signal, [c for c in contrasts if c.signal == s]) for s, signal in enumerate(samples.signals)
        ]

    def __call__(self, errors: np.ndarray) -> Levels:
        """Levels to be expected after what a model leaves of the readings (R, S, n)."""
        return self.many(errors[None])[0]

    def many(self, errors: np.ndarray) -> list[Levels]:
        """The same for many sets of readings (B, R, S, n)."""
        best = [signal.best(errors) for signal in self.signals]
        found = []
        for k in range(len(errors)):
            white, wander, length = zip(*(b[k] for b in best), strict=True)
            far = self.repeats == 0 and _far_off(white, wander, length)
            found.append(
                Levels(
                    white=white, wander=wander, length=length, repeats=self.repeats, read=self._read, trusted=not far
                )
            )
        return found

    @property
    def _read(self) -> bool:
        return any(signal.contrasts for signal in self.signals)

    def draw(self, errors: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
        """Levels (count, S, 3) that the readings (R, S, n) leave possible, by their probability."""
        return np.stack([signal.draw(errors, count, rng) for signal in self.signals], axis=1)


class _SignalLevels:
    """The grid of one signal: white factors, wander factors, length factors."""

    def __init__(self, signal: SignalSheet, contrasts: list[Contrast]) -> None:
        self.contrasts = contrasts
        self.lengths = _lengths(signal)
        f2, logs = FACTORS**2, np.log(FACTORS)
        both = np.linalg.inv(TOGETHER**2 + LEVEL_SPREAD**2 * np.eye(2))
        prior = both[0, 0] * (logs[:, None] ** 2 + logs**2) + 2.0 * both[0, 1] * logs[:, None] * logs
        by_length = np.log(self.lengths) ** 2 / LENGTH_SPREAD**2
        self.prior = by_length[:, None, None] + prior
        self.modes, self.places, self.weights = [], [], []
        for k, length in enumerate(self.lengths):
            modes = [c.modes(length) for c in contrasts]
            ends = np.cumsum([0, *(len(m.ratios) for m in modes)])
            classes, of = _classes(np.concatenate([*(m.ratios for m in modes), np.empty(0)]))
            variance = f2[:, None, None] + f2[None, :, None] * classes
            self.prior[k] += np.log(variance) @ np.bincount(of, minlength=len(classes))
            self.modes.append(modes)
            self.places.append([np.eye(len(classes))[of[a:b]] for a, b in pairwise(ends)])
            self.weights.append((1.0 / variance).reshape(len(FACTORS) ** 2, len(classes)).T)

    def cost(self, errors: np.ndarray) -> np.ndarray:
        """-2 log probability (B, lengths, white factors, wander factors)."""
        cost = np.repeat(self.prior[None], len(errors), axis=0)
        read = [c.read(errors) for c in self.contrasts]
        for k, modes in enumerate(self.modes):
            squares = sum(
                (m.squares(z) @ place for m, z, place in zip(modes, read, self.places[k], strict=True)),
                np.zeros((len(errors), self.weights[k].shape[0])),
            )
            cost[:, k] += (squares @ self.weights[k]).reshape(cost.shape[0], *cost.shape[2:])
        return cost

    def best(self, errors: np.ndarray) -> list[tuple[float, float, float]]:
        """(white, wander, length) on the grid nearest to what is to be expected, for each of the readings."""
        if not self.contrasts:
            return [(1.0, 1.0, 1.0)] * len(errors)
        cost = self.cost(errors)
        weight = np.exp(-0.5 * (cost - cost.min(axis=(1, 2, 3), keepdims=True)))
        weight /= weight.sum(axis=(1, 2, 3), keepdims=True)
        length = _nearest(self.lengths, weight.sum(axis=(2, 3)))
        white, wander = (_nearest(FACTORS, weight.sum(axis=axes)) for axes in ((1, 3), (1, 2)))
        return [(float(a), float(b), float(c)) for a, b, c in zip(white, wander, length, strict=True)]

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


def _nearest(grid: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Values of the grid (B,) nearest to the mean logarithm at probabilities ``weight`` (B, grid)."""
    mean = weight @ np.log(grid)
    return grid[np.argmin(np.abs(np.log(grid) - mean[:, None]), axis=1)]


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


def _far_off(white: Sequence[float], wander: Sequence[float], length: Sequence[float]) -> bool:
    """Whether levels are so far from the data sheet that something else may be in them."""
    off = np.abs(np.log([*white, *wander])) > UNTRUSTED * LEVEL_SPREAD
    return bool(off.any() or (np.abs(np.log(length)) > UNTRUSTED * LENGTH_SPREAD).any())


def repeated_groups(samples: Samples) -> list[tuple[int, ...]]:
    """Indices of runs with the same settings, group by group, where there are two or more."""
    found: dict[tuple, list[int]] = {}
    for k, run in enumerate(samples.runs):
        found.setdefault(_settings_of(run), []).append(k)
    return [tuple(runs) for runs in found.values() if len(runs) > 1]


def _settings_of(run: Run) -> tuple:
    return run.tension, run.yaw, run.yaw_head, run.speed, run.direction, run.yaw_at


def _differences(samples: Samples, shapes: np.ndarray, group: tuple[int, ...]) -> list[Contrast]:
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


def _single_runs(samples: Samples, columns: np.ndarray) -> list[Contrast]:
    """Every run and signal, beside what columns (k, R, S, n) could do to it."""
    made = [
        contrast(samples, columns, (r,), (1.0,), s)
        for r in range(len(samples.runs))
        for s in range(len(samples.signals))
    ]
    return [c for c in made if c is not None]
