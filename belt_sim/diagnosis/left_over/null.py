"""What happens when nothing is missing: a parametric bootstrap of the whole pipeline.

Readings are simulated with nuisances, and with noise at levels that the readings leave possible; they are judged at
those believed in, as the readings themselves are. How far off belief may be is in the draws: levels read once more off
what was drawn would be drawn to the data sheet a second time. Every candidate is refitted in its linear range, at every
point of its grid; a modifier without a grid, which has no such range, counts as one more degree of freedom.
Thresholds come from these gains, not from a table.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from belt_sim.diagnosis.fits.alternatives import Alternatives
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.noise.noise import SMOOTH
from belt_sim.diagnosis.numerics.products import halves, inverse
from belt_sim.diagnosis.numerics.tails import chi2_cdf, chi2_isf, chi2_logsf

BATCH = 250
TAIL = 0.1  # of the smallest p of all, from which on their law is taken to be that of the tail
UPPER = 0.9  # quantile of the bootstrap by which alternatives are counted: below it they say little of the tail
SINGLE = np.float32  # of what is drawn: rounded, it is another draw a hair's breadth aside
SMALL = -30.0  # log p, below which the chance of any of several is the sum of theirs


@dataclass(frozen=True)
class NullGains:
    """chi2 gains (B,) of every candidate when nothing is missing, and the degrees of freedom of each.

    alone: of a candidate with alternatives, the mean gain of one of them by itself. The largest of many gains has a
    larger mean than one gain, but not a broader tail: chance tries more often, not harder. So its law is that of the
    best of so many independent tries as make the bootstrap's upper tenth.
    """

    gains: Mapping[str, np.ndarray]
    dof: Mapping[str, int]
    alone: Mapping[str, float] = field(default_factory=dict)
    _thresholds: dict[tuple[str, float], float] = field(default_factory=dict, init=False, repr=False, compare=False)
    _means: dict[str, float] = field(default_factory=dict, init=False, repr=False, compare=False)

    def log_p(self, name: str, gain):
        """log of the probability of so large a gain, or of gains (B,)."""
        once = chi2_logsf(np.maximum(gain, 0.0) / self.inflation(name), max(self.dof[name], 1))
        return once if name not in self.alone else _of_any(once, self.tries(name))

    def inflation(self, name: str) -> float:
        """Mean bootstrap gain over its degrees of freedom; above 1 where noise levels are uncertain."""
        if name not in self._means:
            self._means[name] = self.alone[name] if name in self.alone else float(np.mean(self.gains[name]))
        return max(self._means[name] / max(self.dof[name], 1), 0.5)

    def tries(self, name: str) -> float:
        """How many independent tries the alternatives of a candidate are worth."""
        if name not in self.alone:
            return 1.0
        upper = float(np.quantile(self.gains[name], UPPER))
        once = float(chi2_cdf(upper / self.inflation(name), max(self.dof[name], 1)))
        return max(float(np.log(UPPER) / np.log(once)), 1.0) if 0.0 < once < 1.0 else 1.0

    def critical(self, names, level: float) -> float:
        """log p that the smallest p of all ``names`` falls below with probability ``level``.

        The few smallest of all draws are another with every seed; the tail as a whole says where they should be. There
        a p is as likely as it is large, or by some power of that where the law of one candidate is not quite its own:
        log p falls short of the tail's beginning by an exponential law.
        """
        names = [n for n in names if self.dof[n] > 0]
        if not names:
            return -np.inf
        smallest = np.min([self.log_p(n, self.gains[n]) for n in names], axis=0)
        begins = float(np.quantile(smallest, max(level, TAIL), method="weibull"))  # so often beaten by one more
        further = begins - smallest[smallest < begins]
        return begins - float(np.mean(further)) * np.log(TAIL / level) if level < TAIL and len(further) else begins

    def threshold(self, name: str, log_p: float) -> float:
        """The gain of one candidate that has this log p."""
        if self.dof[name] == 0 or not np.isfinite(log_p):
            return float("inf")
        if (name, log_p) not in self._thresholds:
            once = -np.expm1(np.log1p(-np.exp(log_p)) / self.tries(name)) if log_p < 0.0 else 1.0
            self._thresholds[name, log_p] = float(chi2_isf(once, self.dof[name]) * self.inflation(name))
        return self._thresholds[name, log_p]


def _of_any(log_p, tries: float):
    """log of the probability that one of so many tries has a p as small as exp(log_p)."""
    once = np.exp(np.maximum(log_p, SMALL))
    with np.errstate(divide="ignore"):
        return np.where(log_p < SMALL, log_p + np.log(tries), np.log(-np.expm1(tries * np.log1p(-once))))


def null_gains(
    bench: Workbench,
    shapes: Mapping[str, np.ndarray | Alternatives],
    current: np.ndarray,
    base: np.ndarray,
    *,
    count: int,
    seed: int,
    tick=lambda n: None,
) -> NullGains:
    """Bootstrap the gains of candidates on top of the current model.

    shapes: name -> predicted shapes (k, R, S, n) of each candidate in its linear range, or alternatives of which the
    best counts; current (c, R, S, n): shapes of what is fitted already; base (R, S, n): predictions;
    count: replicates; tick(n) is told of progress.
    """
    rng = np.random.default_rng(seed)
    tried = _Tried(bench, shapes, current.reshape(-1, *base.shape))
    free = {n: bench.forward.modifiers(n) if tried.ranks[n].any() else 0 for n in shapes}
    noise = NoiseSource(bench, bench.samples.y - base, rng)
    gains: dict[str, list[np.ndarray]] = {n: [] for n in shapes}
    alone: dict[str, list[float]] = {n: [] for n, s in shapes.items() if isinstance(s, Alternatives)}
    for start in range(0, count, BATCH):
        size = min(BATCH, count - start)
        for name, every in tried.gains(noise.draw(size)):
            gains[name].append(np.max(every, axis=0) + (rng.chisquare(free[name], size) if free[name] else 0.0))
            if name in alone:
                whole = every[tried.ranks[name] == tried.ranks[name].max()]  # where all its numbers are in the readings
                alone[name] += [float(np.mean(whole)) + free[name]] * size
        tick(size)
    means = {n: float(np.mean(m)) for n, m in alone.items()}
    dof = {n: int(tried.ranks[n].max()) + free[n] for n in shapes}
    return NullGains({n: np.concatenate(g) for n, g in gains.items()}, dof, means)


class _Tried:
    """Columns of all candidates beside what is fitted already; ranks: of each candidate, how many of the columns that
    are fitted together can be told apart, at every point of its grid.
    """

    def __init__(self, bench: Workbench, shapes: Mapping[str, np.ndarray | Alternatives], current: np.ndarray) -> None:
        families = {n: s.columns if isinstance(s, Alternatives) else s for n, s in shapes.items()}
        ends = np.cumsum([0, *map(len, families.values())])
        choices = [
            np.stack(s.choices) if isinstance(s, Alternatives) else np.arange(len(s))[None] for s in shapes.values()
        ]
        self.places = {n: a + c for n, a, c in zip(shapes, ends[:-1], choices, strict=True)}
        white, own = (bench.metric.whiten(x) for x in (np.concatenate(list(families.values())), current))
        white -= (white @ own.T) @ inverse((own @ own.T)[None])[0][0] @ own
        self.rows = bench.metric.back(white).reshape(len(white), -1)
        gram = white @ white.T
        found = {n: halves(gram[c[:, :, None], c[:, None, :]]) for n, c in self.places.items()}
        self.halves, self.ranks = ({n: f[k] for n, f in found.items()} for k in (0, 1))

    def gains(self, readings: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
        """Every candidate, and the chi2 (points, B) that it takes of readings (B, R, S, n)."""
        moments = self.rows @ readings.reshape(len(readings), -1).T
        for name, places in self.places.items():
            yield name, np.sum((self.halves[name].swapaxes(1, 2) @ moments[places]) ** 2, axis=1)


class NoiseSource:
    """Draws of everything that may differ when nothing is missing, as readings (count, R, S, n)."""

    def __init__(self, bench: Workbench, errors: np.ndarray, rng: np.random.Generator) -> None:
        """errors (R, S, n): what the current model leaves of the readings."""
        self.bench, self.errors, self.rng = bench, errors, rng

    def draw(self, count: int) -> np.ndarray:
        """Errors at levels that the readings leave possible, in single precision."""
        bench, rng = self.bench, self.rng
        samples = bench.samples
        levels, smooth = bench.finder.draw(self.errors, count, rng)
        white = np.array([s.white for s in samples.signals]) / np.sqrt(samples.per_bin)[:, None]
        errors = rng.standard_normal((count, *samples.y.shape), SINGLE)
        errors *= (white * levels[:, None, :, 0]).astype(SINGLE)[..., None]
        errors += self._wander(levels[..., 1], levels[..., 2], smooth)
        errors += self._nuisances(count)
        return errors

    def _nuisances(self, count: int) -> np.ndarray:
        """What nuisances of every run, and those that all runs share, make of readings (count, R, S, n)."""
        bench, rng = self.bench, self.rng
        shape, own = bench.samples.y.shape, bench.shapes.astype(SINGLE).swapaxes(0, 1)
        runs = rng.standard_normal((len(own), count, own.shape[1]), SINGLE) @ own.reshape(*own.shape[:2], -1)
        shared = bench.shared.astype(SINGLE).reshape(len(bench.shared), -1)
        found = rng.standard_normal((count, len(shared)), SINGLE) @ shared
        return found.reshape(count, *shape) + runs.swapaxes(0, 1).reshape(count, *shape)

    def _wander(self, size: np.ndarray, length: np.ndarray, smooth: np.ndarray) -> np.ndarray:
        """Wander (count, R, S, n) at factors (count, S) on its size and length, by recursion along the travel; smooth
        (count,): of which kind it is.
        """
        samples = self.bench.samples
        stated = np.array([max(s.wander_length, 1e-6) for s in samples.signals])
        apart, of = np.unique(np.diff(samples.travel, axis=1), axis=0, return_inverse=True)
        steps, of = (apart.T[:, :, None, None] / (length * stated).T).astype(SINGLE), of.reshape(-1)
        sd = (size * np.array([s.wander_sd for s in samples.signals])).astype(SINGLE)
        if not smooth.any():
            return rough_wander(steps, of, sd.T, self.rng).transpose(3, 1, 2, 0)
        found = np.empty((len(size), *samples.y.shape), SINGLE)
        if not smooth.all():
            found[~smooth] = rough_wander(steps[..., ~smooth], of, sd[~smooth].T, self.rng).transpose(3, 1, 2, 0)
        sloped = smooth_wander(steps[..., smooth][:, of].transpose(3, 1, 2, 0), self.rng)
        found[smooth] = sd[smooth][:, None, :, None] * sloped
        return found


def rough_wander(steps: np.ndarray, of: np.ndarray, size: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Wander (n, R, S, B) of ``size`` (S, B) and exponential correlation at ``steps`` (n - 1, U, S, B) in units of its
    length; of (R,): which of the U every run has. What is worked on together lies together.
    """
    keep = np.exp(-steps)
    fresh = np.sqrt(1.0 - keep**2)
    if steps.shape[1] > 1:
        keep, fresh = keep[:, of], fresh[:, of]
    n, _, signals, count = steps.shape
    drawn = rng.standard_normal((count, len(of), signals, n + 1), steps.dtype)
    found = np.ascontiguousarray(drawn.transpose(3, 1, 2, 0))
    for k in range(n):
        found[k + 1] *= fresh[k]
        found[k + 1] += keep[k] * found[k]
    found *= size
    return found


def smooth_wander(steps: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Smooth wander (..., n) of unit size at ``steps`` (..., n - 1) in units of its length, by recursion of its value
    and its slope, which at one place are independent.
    """
    x = SMOOTH * steps
    fade = np.exp(-x)
    value = np.stack([fade * (1.0 + x), fade * x])  # of both before, the value's share of what comes
    slope = np.stack([-fade * x, fade * (1.0 - x)])
    own = np.sqrt(np.maximum(1.0 - np.sum(value**2, axis=0), 0.0))
    common = -np.sum(value * slope, axis=0) / np.where(own > 0.0, own, np.inf)
    rest = np.sqrt(np.maximum(1.0 - np.sum(slope**2, axis=0) - common**2, 0.0))
    now = rng.standard_normal((2, *steps.shape[:-1]), steps.dtype)
    found = [now[0]]
    for k in range(steps.shape[-1]):
        fresh = rng.standard_normal(now.shape, steps.dtype)
        now = np.stack(
            [
                np.sum(value[..., k] * now, axis=0) + own[..., k] * fresh[0],
                np.sum(slope[..., k] * now, axis=0) + common[..., k] * fresh[0] + rest[..., k] * fresh[1],
            ]
        )
        found.append(now[0])
    return np.stack(found, axis=-1)
