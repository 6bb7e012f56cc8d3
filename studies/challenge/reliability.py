"""What probabilities are worth: those that were said, in bins, against how often they were right."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from studies.challenge.facts import Facts
from studies.challenge.wilson import Share, share_of

EDGES = (0.0, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)


@dataclass(frozen=True)
class Bin:
    """Names said at a probability from low to high; said: their mean; true: so many were hidden; alike: so many were,
    or stand for a hidden effect that the answer itself cannot tell from them."""

    low: float
    high: float
    said: float
    true: Share
    alike: Share

    @property
    def name(self) -> str:
        """From where to where."""
        return f"{self.low:g} - {self.high:g}"


def reliability(rows: Sequence[Facts]) -> list[Bin]:
    """Every bin of ``EDGES`` that holds a named effect."""
    said = [(p, name in f.hidden, name not in f.false_names) for f in rows for name, p in f.named.items()]
    found = []
    for low, high in pairwise(EDGES):
        mine = [s for s in said if low <= s[0] < high or s[0] == high == EDGES[-1]]
        if mine:
            mean = sum(p for p, _, _ in mine) / len(mine)
            found.append(Bin(low, high, mean, share_of([t for _, t, _ in mine]), share_of([a for _, _, a in mine])))
    return found
