"""Pairs of candidates, all at once in the linear range: where a third effect looks like the sum of two, a search that
adds one effect after the other takes the third and never sees the two.

Columns at null say little of an effect that bends (a guide that touches from some gap on). One that was fitted by
itself is known where it then stands, and so is what each of the others would add there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations

import numpy as np

from belt_sim.diagnosis.numerics.products import apart, basis

FEW = 4  # numbers of an effect, at most; one with more (a free edge profile) looks like no sum of others
Ids = tuple[str, ...]

NESTING = 1.0  # chi2, by which a pair must be ahead of its members
ALIKE = 1e-9  # of the largest eigenvalue of columns of unit length: those below are sums of the others


@dataclass(frozen=True)
class Pairs:
    """places: candidate -> its columns; gram (K, K): whitened products of all columns; known: gains of effects that
    bend, and of pairs with one of them, where that effect was fitted.
    """

    places: Mapping[str, Sequence[int]]
    gram: np.ndarray
    known: Mapping[frozenset, float] = field(default_factory=dict)

    def best(self, moments: np.ndarray, price: float, count: int) -> list[Ids]:
        """At most so many pairs that promise more than any effect alone, best first.

        moments (K,): products of columns and residual; price: chi2 that each effect must earn.
        """
        scores = {ids: gain - price * len(ids) for ids, gain in self._gains(moments).items()}
        alone = max((s for ids, s in scores.items() if len(ids) == 1), default=-np.inf)
        ahead: list[Ids] = [ids for ids, score in scores.items() if len(ids) == 2 and score > alone + NESTING]
        return sorted(ahead, key=lambda ids: -scores[ids])[:count]

    def _gains(self, moments: np.ndarray) -> dict[Ids, float]:
        found: dict[Ids, float] = {}
        for sets, rows, inverse in self._inverses:
            along = moments[rows]
            found |= zip(sets, np.einsum("mk,mkl,ml->m", along, inverse, along).tolist(), strict=True)
        return {ids: max(gain, self.known.get(frozenset(ids), 0.0)) for ids, gain in found.items()}

    @cached_property
    def _inverses(self) -> list[tuple[list[Ids], np.ndarray, np.ndarray]]:
        """Singles and pairs with as many columns as one another, these columns (m, k), inverses of their products."""
        few = [n for n, rows in self.places.items() if 0 < len(rows) <= FEW]
        of_size: dict[int, list[Ids]] = {}
        for ids in [(n,) for n in few] + list(combinations(few, 2)):
            of_size.setdefault(sum(len(self.places[i]) for i in ids), []).append(ids)
        size = np.sqrt(np.maximum(np.diag(self.gram), 0.0))
        scale = np.where(size > 0.0, 1.0 / np.where(size > 0.0, size, 1.0), 0.0)
        found = []
        for sets in of_size.values():
            rows = np.array([[k for i in ids for k in self.places[i]] for ids in sets])
            unit = scale[rows][:, :, None] * scale[rows][:, None, :]
            products = self.gram[rows[:, :, None], rows[:, None, :]] * unit
            found.append((sets, rows, np.linalg.pinv(products, rcond=ALIKE, hermitian=True) * unit))
        return found


def beside(columns: np.ndarray, residual: np.ndarray, others: Mapping[str, np.ndarray]) -> dict[str, float]:
    """chi2 that each of ``others``, by its shapes (k, N), would take of what a fit leaves (N,), its own numbers, whose
    derivatives are ``columns`` (K, N), refitted along.
    """
    own = basis(columns)
    further = {name: basis(apart(rows, own)) for name, rows in others.items()}
    return {name: _along(rows, residual) + _along(own, residual) for name, rows in further.items()}


def _along(rows: np.ndarray, residual: np.ndarray) -> float:
    return float(np.sum((rows @ residual) ** 2))
