"""The table of evidence: what joint fits and searches say of a campaign, as plain numbers."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

Ids = frozenset[str]


@dataclass(frozen=True, kw_only=True)
class Row:
    """A set of named effects, fitted jointly on the metric that all rows share.

    chi2: at the best point; gram (k, k): products of whitened derivatives; away (k,): the numbers, from null or the
    middle of a grid; sigma (k,): the largest that a machine may have, for harmonics what they have in common; owner
    (k,): whose each number is; sized (k,): whether it has its effect's scale (one that only shapes, and a harmonic,
    have their own); plausible; held_out: condition that can be tested -> -2 log of its predictive density.
    """

    ids: Ids
    chi2: float
    gram: np.ndarray
    away: np.ndarray
    sigma: np.ndarray
    owner: tuple[str, ...]
    sized: np.ndarray
    plausible: bool
    held_out: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class Law:
    """The best of its kind in the linear range: chi2 gain, what its numbers must earn, and of how many sizes it is."""

    words: str
    gain: float
    cost: float
    sizes: int


@dataclass(frozen=True, kw_only=True)
class Beyond:
    """What is seen beside a set of named effects: log evidence of a free course at every place and way of pooling, over
    that of none; the best laws of the dictionary, and how many were tried.
    """

    beside: Ids
    courses: np.ndarray
    laws: tuple[Law, ...]
    tried: float


@dataclass(frozen=True, kw_only=True)
class Table:
    """candidates: how many effects could be named; inflation: by how much chance gains more than its degrees of
    freedom, the noise being uncertain; damaged: the data look so; steadfast: effects that only add to the readings, so
    that something unknown in the march neither changes them nor is imitated by them.
    """

    candidates: int
    inflation: float
    damaged: bool
    rows: tuple[Row, ...]
    beyond: tuple[Beyond, ...]
    steadfast: Ids = frozenset()
