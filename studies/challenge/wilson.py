"""Shares from counts, with the interval that belongs to them."""

import math
from dataclasses import dataclass

Z95 = 1.959964


@dataclass(frozen=True)
class Share:
    """``count`` of ``trials``."""

    count: int
    trials: int

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the share (Wilson 1927); (0, 1) without trials."""
        if self.trials == 0:
            return 0.0, 1.0
        share, z2 = self.count / self.trials, Z95**2
        centre = (share + z2 / (2 * self.trials)) / (1 + z2 / self.trials)
        half = Z95 / (1 + z2 / self.trials) * math.sqrt(share * (1 - share) / self.trials + z2 / (4 * self.trials**2))
        return max(0.0, centre - half), min(1.0, centre + half)

    @property
    def value(self) -> float:
        """The share; NaN without trials."""
        return self.count / self.trials if self.trials else math.nan


def share_of(flags: list[bool]) -> Share:
    """How many of the flags are set."""
    return Share(sum(flags), len(flags))
