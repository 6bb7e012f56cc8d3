"""Intervals of fitted numbers by likelihood: as far either way as chi2 stays below what truth exceeds once in twenty.

About the best fit chi2 is a parabola in whatever enters linearly, and value +- 1.96 u says it all. A place along a
span, a gap or a time constant does not: its readings change faster on one side than on the other. So every number is
tried 1.96 u off, the others as they then have to be; only where chi2 comes out otherwise is the number held at further
places and the others refitted, until its rise is known (profile likelihood).
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.plausibility import covariance_of, is_constrained
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.readings.parameter_vector import Slot
from belt_sim.results.estimates import COVERAGE_95, Estimate

LINEAR = 0.15  # share by which the root of a rise may differ from the parabola's
ROUNDS = 4  # places tried either way
FARTHEST = 3.0  # times as far from one place to the next, at most
CLOSE = 0.1  # how near the root of a rise comes to what it should be
LEAST = 0.3  # share of the way to a place where chi2 is far too large, at least

Found = Mapping[str, Mapping[str, Estimate]]


def profile_intervals(bench: Workbench, fit: Fit, found: Found) -> dict[str, dict[str, Estimate]]:
    """The estimates ``found`` of a fit, with intervals of their own where 1.96 u either way is not what chi2 says; only
    those of which the readings then say something.
    """
    slots, covariance = [bench.forward.slots[p] for p in fit.free], covariance_of(fit.columns)
    rows = [k for k, s in enumerate(slots) if s.name in found.get(s.effect.id, {})]
    sides = [_Side(fit, k, slots[k], covariance[k], way) for k in rows for way in (-1.0, 1.0)]
    if not sides:
        return {i: dict(numbers) for i, numbers in found.items()}
    values = bench.forward.values(np.stack([side.parabola for side in sides]))
    with np.errstate(over="ignore", invalid="ignore"):  # a step too far may end anywhere
        chi2 = np.where(np.isfinite(values).all(axis=(1, 2, 3)), bench.metric.chi2(bench.fitted.y - values), np.inf)
    rises = np.sqrt(np.maximum(chi2 - fit.chi2, 0.0))  # roots, as those of a parabola are in proportion to the way
    crooked = {side.row for side, rise in zip(sides, rises, strict=True) if not side.is_quadratic(rise)}
    for _ in range(ROUNDS if crooked else 0):
        due = [side for side in sides if side.row in crooked and not side.is_bracketed]
        held = [bench.start(fit.ids, side.start(), [p for p in fit.free if p != side.position]) for side in due]
        for side, other in zip(due, bench.fit(held) if held else [], strict=True):
            side.record(np.sqrt(max(other.chi2 - fit.chi2, 0.0)), other.vector)
    told = {i: dict(numbers) for i, numbers in found.items()}
    for low, high in zip(sides[::2], sides[1::2], strict=True):
        slot = slots[low.row]
        own = told[slot.effect.id]
        if low.row in crooked:
            ends = sorted(float(side.end * slot.scale) for side in (low, high))
            own[slot.name] = replace(own[slot.name], interval=(ends[0], ends[1]))
        if not is_constrained(slot, own[slot.name]):
            del own[slot.name]
    return told


class _Side:
    """One number of a fit on one side of its value, in units of its scale: what rise of chi2 is known where.

    parabola: the point at which a parabola has the rise that ends the interval, or the bound of what machines have.
    """

    def __init__(self, fit: Fit, row: int, slot: Slot, covariance: np.ndarray, way: float) -> None:
        """covariance (k,): of this number with all."""
        self.row, self.position, self.way, self.inside = row, fit.free[row], way, fit.vector
        self.value, self.u = float(fit.vector[self.position]), float(np.sqrt(covariance[row]))
        bound = way * (slot.parameter.plausible[int(way > 0)] / slot.scale - self.value)
        self.most = bound if bound > 0.0 else COVERAGE_95 * self.u  # what no machine has needs no interval
        self.at = min(COVERAGE_95 * self.u, self.most)
        self.parabola = fit.vector.copy()
        self.parabola[fit.free] += way * self.at * covariance / max(covariance[row], 1e-300)
        self.rises: list[tuple[float, float]] = [(0.0, 0.0)]

    def start(self) -> np.ndarray:
        """Where to begin a fit with the number held at the next place: from the farthest that is within."""
        nearest = self.inside.copy()
        nearest[self.position] = self.value + self.way * self.at
        return nearest

    def is_quadratic(self, rise: float) -> bool:
        """Whether the root of the rise of chi2 at the first place is what a parabola has there."""
        return abs(rise - self.at / max(self.u, 1e-300)) < LINEAR * COVERAGE_95

    @property
    def is_bracketed(self) -> bool:
        """Whether the rise that ends the interval has been met, or cannot be."""
        at, rise = self.rises[-1]
        return len(self.rises) > 1 and (abs(rise - COVERAGE_95) < CLOSE or (at >= self.most and rise < COVERAGE_95))

    @property
    def end(self) -> float:
        """Where the interval ends: at the bound of what a machine could have where the readings set none."""
        open_ended = all(rise < COVERAGE_95 - CLOSE for _, rise in self.rises)
        return self.value + self.way * (self.most if open_ended else self.at)

    def record(self, rise: float, vector: np.ndarray) -> None:
        """Root of the rise of chi2 at the place asked for; the next place follows from all that are known."""
        self.rises.append((self.at, rise))
        if rise <= COVERAGE_95:
            self.inside = max(self.inside, vector, key=lambda v: self.way * v[self.position])
        self.at = min(_crossing(self.rises), self.most)


def _crossing(rises: list[tuple[float, float]]) -> float:
    """Where the rise reaches that of the interval: between two places, or beyond the last."""
    known = sorted(rises)
    below = max((p for p in known if p[1] <= COVERAGE_95), key=lambda p: p[0])
    above = min((p for p in known if p[1] > COVERAGE_95 and p[0] > below[0]), key=lambda p: p[0], default=None)
    if above is None:
        return below[0] * float(np.clip(COVERAGE_95 / max(below[1], 1e-9), 1.0, FARTHEST))
    share = (COVERAGE_95 - below[1]) / (above[1] - below[1])
    return below[0] + max(share, LEAST) * (above[0] - below[0])
