"""Refits side by side: those that are behind, or have met a better one of their candidate, go no further."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit, hoped

ALIKE = 0.5  # chi2 by which two ends of one search may differ along a valley that readings hardly bound
CLOSE = 12.0  # chi2 behind the best candidate, or the least that counts: further behind, no exact end is needed
HORIZON = 20.0  # steps as good as the next that a fit behind others is given
BEHIND = 0.3  # share of the best score so far; a valley is slow where it bends, and what is ahead now may lose
MET = 0.02  # of a number, or its scale: two fits of a candidate so near each other go the same way
TRIED = 2  # steps that every fit is given


def _together(one: Fit, other: Fit) -> bool:
    """Whether two fits of one set have met."""
    return bool(np.allclose(one.vector, other.vector, rtol=MET, atol=MET))


@dataclass(frozen=True)
class Race:
    """Fits of several candidates beside a set that fits with ``chi2``, each from several starts: which go on.

    owners: the candidate of every fit; thresholds: of every candidate.
    """

    chi2: float
    owners: Sequence[str]
    thresholds: dict[str, float]
    sides: tuple[np.ndarray, np.ndarray]

    def __call__(self, fits: Sequence[Fit]) -> None:
        """Settle what has met a better fit of its candidate, or would be far behind the front of all even after so many
        more steps as good as the next.
        """
        least = BEHIND * (self._front(fits)[1] + CLOSE) - CLOSE
        seen: list[tuple[str, Fit]] = []
        for name, fit in sorted(zip(self.owners, fits, strict=True), key=lambda pair: pair[1].chi2):
            if not (fit.settled or fit.due.any() or fit.taken < TRIED):
                at_once = hoped(replace(fit, radius=np.inf), self.sides)  # a step that failed made the next ones short
                reach = fit.chi2 - max(HORIZON * hoped(fit, self.sides), at_once)
                met = any(n == name and _together(fit, other) for n, other in seen)
                fit.settled = met or self._score(name, reach) < least
            seen.append((name, fit))

    def ahead(self, fits: Sequence[Fit]) -> list[int]:
        """Which fits are the best of candidates near the front, or as good."""
        best, least = self._front(fits)
        near = [
            self._score(n, best[n]) > least and f.chi2 < best[n] + ALIKE for n, f in zip(self.owners, fits, strict=True)
        ]
        return [k for k, ahead in enumerate(near) if ahead]

    def _front(self, fits: Sequence[Fit]) -> tuple[dict[str, float], float]:
        """The best chi2 of every candidate, and the score below which none is near the front."""
        best: dict[str, float] = {}
        for name, fit in zip(self.owners, fits, strict=True):
            best[name] = min(fit.chi2, best.get(name, np.inf))
        return best, max([0.0, *(self._score(n, c) for n, c in best.items())]) - CLOSE

    def _score(self, name: str, chi2: float) -> float:
        return self.chi2 - chi2 - self.thresholds[name]
