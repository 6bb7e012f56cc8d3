"""Evidence in the linear range: everything a decision asks of readings, from products of columns and readings alone.

One replicate of a campaign in which nothing is missing is so decided in a millisecond, by the same decide.py as the
readings themselves. gram and raw: products of the candidates' columns run by run, whitened, and in metres about each
record's mean; moments: the same of columns and readings.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np

from belt_sim.diagnosis.choice.chance import SIGMAS
from belt_sim.diagnosis.choice.decide import Ids
from belt_sim.diagnosis.choice.pairs import Pairs
from belt_sim.diagnosis.fits.candidate import is_possible, prior_sigma
from belt_sim.diagnosis.readings.forward import Forward
from belt_sim.diagnosis.readings.spectrum import with_harmonics

FAINT = 1e-9  # of a column's square, so that one that is not seen has no inverse


@dataclass(frozen=True)
class Range:
    """What all replicates share. places: candidate -> columns; positions (K,) of columns in the parameter vector; gram,
    raw (R, K, K); out: condition -> runs (R,) that it leaves out; noise: condition -> second moments (K, K) of raw
    products with errors by chance; thresholds: candidate -> gain by chance.
    """

    forward: Forward
    places: dict[str, list[int]]
    positions: np.ndarray
    gram: np.ndarray
    raw: np.ndarray
    out: dict[str, np.ndarray]
    noise: dict[str, np.ndarray]
    thresholds: dict[str, float]

    @cached_property
    def sigma(self) -> np.ndarray:
        """Prior of each column's number (K,)."""
        return prior_sigma(self.forward, [int(p) for p in self.positions])

    @cached_property
    def whole(self) -> np.ndarray:
        """gram of all runs (K, K)."""
        return self.gram.sum(axis=0)

    @cached_property
    def pairs(self) -> Pairs:
        """All pairs of candidates."""
        return Pairs(self.places, self.whole)


@dataclass(frozen=True)
class Beside:
    """A candidate beside a set."""

    id: str
    score: float
    plausible: bool

    @property
    def passes(self) -> bool:
        """Whether it beats chance with plausible numbers."""
        return self.score > 0.0 and self.plausible


@dataclass(frozen=True)
class Projected:
    """One replicate: moments, raw_moments (R, K)."""

    range: Range
    moments: np.ndarray
    raw_moments: np.ndarray
    solved: dict[frozenset, tuple[np.ndarray, np.ndarray, np.ndarray]] = field(default_factory=dict)

    def trials(self, ids: Ids) -> Sequence[Beside]:
        """Every other candidate beside ``ids``."""
        others = [n for n in self.range.places if n not in ids]
        gains = self.gains([ids, *((*ids, n) for n in others)])
        return [
            Beside(n, g - gains[0] - self.threshold(n), self.plausible((*ids, n)))
            for n, g in zip(others, gains[1:], strict=True)
        ]

    def gains(self, sets: Sequence[Ids]) -> Sequence[float]:
        """chi2 gain of sets over the base model."""
        total = self.moments.sum(axis=0)
        return [float(total[rows] @ numbers) for rows, numbers, _ in map(self._solve, sets)]

    def threshold(self, name: str) -> float:
        """The gain of one effect that chance beats as seldom as agreed."""
        return self.range.thresholds[name]

    def plausible(self, ids: Ids) -> bool:
        """Whether a real machine could have all numbers of a set."""
        rows, numbers, u = self._solve(ids)
        slots = [self.range.forward.slots[p] for p in self.range.positions[rows]]
        return is_possible(slots, numbers + self.range.forward.null()[self.range.positions[rows]], u)

    def worse(self, larger: Ids, smaller: Ids) -> tuple[str, ...]:
        """What of the held-out error is larger with the larger set."""
        surprise, found = 0.0, []
        for name, out in self.range.out.items():
            surprise += self._surprise(larger, out) - self._surprise(smaller, out)
            found += [name] if self._rises(name, larger, smaller) else []
        return tuple((["density"] if surprise >= 0.0 else []) + found)

    def pair(self, seen: Sequence[Ids]) -> Ids | None:
        """The best of all pairs of candidates, if it promises more than what was seen."""
        return self.range.pairs.best(self.moments.sum(axis=0), self.threshold, seen)

    def moved(self, ids: Ids) -> Self:
        """The same: everything is linear."""
        return self

    def _solve(self, ids: Ids) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Columns of a set, their numbers beyond null, and one sigma of these."""
        key = frozenset(ids)
        if key not in self.solved:
            rows = np.array([k for i in ids for k in self.range.places[i]], dtype=int)
            gram = self.range.whole[np.ix_(rows, rows)]
            inverse = np.linalg.pinv(gram + FAINT * np.eye(len(rows)), rcond=1e-10, hermitian=True)
            numbers = inverse @ self.moments.sum(axis=0)[rows]
            self.solved[key] = rows, numbers, np.sqrt(np.maximum(np.diag(inverse), 0.0))
        return self.solved[key]

    def _without(self, ids: Ids, out: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Columns, numbers from the runs that are not left out, and their covariance, with the prior."""
        rows, fitted, u = self._solve(ids)
        slots = [self.range.forward.slots[p] for p in self.range.positions[rows]]
        sigma = with_harmonics(slots, fitted, u**2, self.range.sigma[rows])
        information = self.range.gram[~out].sum(axis=0)[np.ix_(rows, rows)] + np.diag(sigma**-2.0)
        covariance = np.linalg.inv(information) if len(rows) else np.zeros((0, 0))
        return rows, covariance @ self.moments[~out].sum(axis=0)[rows], covariance

    def _surprise(self, ids: Ids, out: np.ndarray) -> float:
        """-2 log predictive density of what was left out, less that of the base model."""
        rows, numbers, covariance = self._without(ids, out)
        if not len(rows):
            return 0.0
        here, along = self.range.gram[out].sum(axis=0)[np.ix_(rows, rows)], self.moments[out].sum(axis=0)[rows]
        left = along - here @ numbers
        total = np.eye(len(rows)) + covariance @ here
        squares = numbers @ here @ numbers - 2.0 * numbers @ along
        return float(squares - left @ np.linalg.solve(total, covariance @ left) + np.linalg.slogdet(total)[1])

    def _rises(self, name: str, larger: Ids, smaller: Ids) -> bool:
        """Whether a condition's error [m] rises by more than noise and the refitted numbers make."""
        out = self.range.out[name]
        raw, along = self.range.raw[out].sum(axis=0), self.raw_moments[out].sum(axis=0)
        new, old = np.zeros(len(raw)), np.zeros(len(raw))
        rows, numbers, covariance = self._without(larger, out)
        new[rows] = numbers
        few, fewer, _ = self._without(smaller, out)
        old[few] = fewer
        apart = new - old
        rise = float(new @ raw @ new - old @ raw @ old - 2.0 * apart @ along)
        moved = (raw @ apart)[rows]
        spread = 2.0 * np.sqrt(apart @ self.range.noise[name] @ apart + moved @ covariance @ moved)
        return rise > 0.0 and rise > SIGMAS * spread - apart @ raw @ apart
