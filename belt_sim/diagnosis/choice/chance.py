"""May a larger set of effects stand beside a smaller one: its held-out errors may not rise, beyond what noise does.

With d the difference of two predictions and e the errors of the larger set when that is right, the mean square of the
larger set's errors exceeds that of the smaller one's by -(|d|^2 + 2 d.e) / m. Draws of e (noise, nuisances, and what
refitted numbers are off by) say how large that gets by chance. Every record is taken about its own mean: where it
begins is the instrument's.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from belt_sim.diagnosis.fits.heldout import HeldOut, conditions, lateral_readings
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.left_over.null import NoiseSource
from belt_sim.diagnosis.numerics.tails import chi2_isf, gumbel_fit, gumbel_isf

DRAWS = 200
SIGMAS = 3.8  # by which an error rises in one of a dozen conditions, with the right effects, once in 1000 campaigns
UNASKED = 1e-3  # chi2, below which both predict a condition alike
FLOOR_LEVEL = 0.002  # of campaigns with nothing missing, whose worst condition is beyond the limit


@dataclass(frozen=True)
class Chance:
    """draws: condition -> lateral errors (B, m) [m] that instruments and settings alone make."""

    draws: dict[str, np.ndarray]

    def worse(self, larger: HeldOut, smaller: HeldOut) -> tuple[str, ...]:
        """Names of the conditions that ``larger`` predicts worse than ``smaller``; "density" for their whole."""
        tested = [n for n in larger.conditions if n not in larger.untestable]
        surprise = [larger.conditions[n].surprise - smaller.conditions[n].surprise for n in tested]
        asked = max(map(abs, surprise), default=0.0) > UNASKED  # runs without yaw say nothing of what needs one
        found = ["density"] if asked and sum(surprise) >= 0.0 else []
        return (*found, *self.rises(larger, smaller))

    def rises(self, larger: HeldOut, smaller: HeldOut) -> tuple[str, ...]:
        """Names of the conditions in which the error in metres rises, whatever the density says."""
        tested = [n for n in larger.conditions if n not in larger.untestable]
        return tuple(n for n in tested if self._rises(n, larger, smaller))

    def _rises(self, name: str, larger: HeldOut, smaller: HeldOut) -> bool:
        new, old = larger.conditions[name], smaller.conditions[name]
        after, before = (about_means(c.errors[None], c.record)[0] for c in (new, old))
        rise = float(after @ after - before @ before)
        if not rise > 0.0:
            return not np.isfinite(rise)
        apart = before - after
        by_noise, by_numbers = self.draws[name] @ apart, new.moved @ apart
        spread = 2.0 * np.sqrt(np.mean(by_noise**2) + by_numbers @ by_numbers)
        return bool(rise > SIGMAS * spread - apart @ apart)

    def beyond_floor(self, fit: HeldOut) -> dict[str, float]:
        """Condition -> its held-out rms over the floor, where that is more than instruments and settings make: as it
        is, and about the mean of each record. A zero three sigma off is no law.
        """
        found, centred = self._beyond(fit, as_read), self._beyond(fit, about_means)
        return {name: ratio for name, ratio in found.items() if name in centred}

    def _beyond(self, fit: HeldOut, taken: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> dict[str, float]:
        """The same of errors as they are ``taken`` (errors (B, m), which record each is of (m,)).

        What refitted numbers are off by is a few normal numbers, whose squares reach further than a mean over readings:
        they are given their own share of the limit.
        """
        record = {n: c.record for n, c in fit.conditions.items()}
        size = {n: np.mean(taken(e, record[n]) ** 2, axis=1) for n, e in self.draws.items() if e.shape[1]}
        floor = {n: float(np.mean(s)) for n, s in size.items()}
        limit = beyond(np.max([s / floor[n] for n, s in size.items()], axis=0), FLOOR_LEVEL)
        found = {}
        for name, c in fit.conditions.items():
            if name in floor and c.testable:
                moved = taken(c.moved, c.record)
                apart, few = float(np.mean(np.sum(moved**2, axis=0))), reach_of_few(moved, FLOOR_LEVEL / len(floor))
                error = float(np.mean(taken(c.errors[None], c.record) ** 2))
                if not error <= limit * floor[name] + max(limit * apart, few):
                    found[name] = np.sqrt(error / (floor[name] + apart))
        return found


def beyond(largest: np.ndarray, level: float) -> float:
    """What the largest of several, of which draws (B,) are given, exceeds with probability ``level``.

    By the law of extremes (Gumbel) that all draws make: the few largest of them alone are another with every seed.
    """
    return gumbel_isf(level, *gumbel_fit(largest))


def chance_of(bench: Workbench, left: np.ndarray, seed: int) -> Chance:
    """Draws of everything that may differ when nothing is missing, by held-out condition.

    left (R, S, n): what the model leaves of the readings.
    """
    errors = NoiseSource(bench, left, np.random.default_rng(seed)).draw(DRAWS)
    return Chance({n: errors[:, out][:, lateral_readings(bench, out)] for n, out in conditions(bench).items()})


def as_read(rows: np.ndarray, record: np.ndarray) -> np.ndarray:
    """Rows (B, m) as they are."""
    return rows


def reach_of_few(rows: np.ndarray, level: float) -> float:
    """The mean square that sums of rows (k, m), each times a normal number, exceed with probability ``level``: by the
    chi2 law of the same mean and variance (Satterthwaite 1946, Biometrics Bull. 2(6) 110)."""
    sizes = np.linalg.eigvalsh(rows @ rows.T) / max(rows.shape[1], 1)
    whole, squares = float(np.sum(sizes)), float(np.sum(sizes**2))
    dof = whole**2 / squares if squares > 0.0 else 1.0
    return whole / dof * float(chi2_isf(level, dof))


def about_means(rows: np.ndarray, record: np.ndarray) -> np.ndarray:
    """Rows (B, m) about the mean of each record."""
    count = np.maximum(np.bincount(record), 1)
    means = np.array([np.bincount(record, weights=row) for row in rows]).reshape(len(rows), len(count)) / count
    return rows - means[:, record]
