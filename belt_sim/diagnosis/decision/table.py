"""The table of evidence: what joint fits and searches say of a campaign, as plain numbers."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

Ids = frozenset[str]


@dataclass(frozen=True, kw_only=True)
class Row:
    """A set of named effects, fitted jointly on the metric that all rows share.

    chi2: at the best point; gram (k, k): products of whitened derivatives; away (k,): the numbers in units of their
    scales; sigma (k,): the largest that a machine may have, for harmonics what they have in common; owner (k,): the
    effect of each number; sized (k,): whether it takes its effect's scale (a number that only shapes, and a harmonic,
    have their own); scanned: of every further number, which was scanned over a grid, how many values were tried;
    plausible: whether a real machine could have these numbers; held_out: condition that can be tested -> -2 log of its
    predictive density.
    """

    ids: Ids
    chi2: float
    gram: np.ndarray
    away: np.ndarray
    sigma: np.ndarray
    owner: tuple[str, ...]
    sized: np.ndarray
    scanned: tuple[int, ...] = ()
    plausible: bool = True
    held_out: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class OtherModel:
    """Another base model in the place of effects, with nothing fitted.

    name: as the user would set it; chi2: on the same metric; rms: of its lateral errors [m]; tried: how many were.
    """

    name: str
    chi2: float
    rms: float = 0.0
    tried: int = 1


@dataclass(frozen=True, kw_only=True)
class LawEvidence:
    """A generic law: what it says, its chi2 gain, what its numbers must earn [chi2], and of how many sizes it is."""

    words: str
    gain: float
    cost: float
    sizes: int


@dataclass(frozen=True, kw_only=True)
class UnknownEvidence:
    """What is seen beside a set of named effects.

    courses: log evidence of a free course of the unknown at every place and way of pooling runs, over that of none;
    laws: the best of the dictionary; tried: how many of one term were tried.
    """

    ids: Ids
    courses: np.ndarray
    laws: tuple[LawEvidence, ...]
    tried: float


@dataclass(frozen=True, kw_only=True)
class EvidenceTable:
    """All that a decision rests on.

    candidates: how many effects could be named; inflation: by how much chance gains more than its degrees of freedom,
    the noise being uncertain; damaged: whether the data look so; additive: effects that only add to the readings, so
    that something unknown in the belt's movement neither changes them nor is imitated by them; visible: effects that
    these readings would show at a plausible size (None: not asked).
    """

    candidates: int
    inflation: float
    damaged: bool
    rows: tuple[Row, ...]
    unknown: tuple[UnknownEvidence, ...] = ()
    other_models: tuple[OtherModel, ...] = ()
    additive: Ids = frozenset()
    visible: Ids | None = None
