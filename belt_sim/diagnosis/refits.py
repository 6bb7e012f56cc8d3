"""Evidence from joint refits: sets of effects fitted to the readings of a campaign, each once.

A candidate beside a set is screened by what its column takes of the residual; those that promise most are refitted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Self

import numpy as np

from belt_sim.diagnosis.around import Around, around
from belt_sim.diagnosis.candidate import has_diverged, is_plausible
from belt_sim.diagnosis.chance import Chance
from belt_sim.diagnosis.decide import NESTING, Ids
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.heldout import HeldOut, held_out
from belt_sim.diagnosis.null import NullGains
from belt_sim.diagnosis.pairs import Pairs
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.errors import RunFailed

REFITTED = 6  # candidates a round; the others keep what their columns promise
PROMISING = 0.3  # share of its threshold that a candidate must promise to be refitted


@dataclass
class Trial:
    """A candidate beside what was there: its joint fit, gain over the reference, threshold."""

    id: str
    fit: Fit
    gain: float
    threshold: float
    plausible: bool
    held_out: HeldOut

    @property
    def passes(self) -> bool:
        return self.gain > self.threshold and self.plausible

    @property
    def score(self) -> float:
        """Gain above what chance would give an effect with as many parameters."""
        return self.gain - self.threshold if np.isfinite(self.threshold) else -np.inf


@dataclass
class Refits:
    """Refits on one workbench; null: thresholds at the base model; near: what is about that, if known already; starts:
    set -> vector to begin a refit at.
    """

    bench: Workbench
    null: NullGains
    critical: float
    chance: Chance
    near: Around | None = None
    starts: dict[frozenset, np.ndarray] = field(default_factory=dict)
    fits: dict[frozenset, Fit] = field(default_factory=dict)
    tried: dict[frozenset, list[Trial]] = field(default_factory=dict)
    held: dict[frozenset, HeldOut] = field(default_factory=dict)

    @property
    def names(self) -> Ids:
        """All candidates."""
        return tuple(c.id for c in self.bench.forward.classes)

    def threshold(self, name: str) -> float:
        """The gain of one effect that chance beats as seldom as agreed."""
        return self.null.threshold(name, self.critical)

    def fit(self, ids: Ids) -> Fit:
        """The best joint fit of a set that was found."""
        self._fit([ids])
        return self.fits[frozenset(ids)]

    def gains(self, sets: Sequence[Ids]) -> list[float]:
        """chi2 gain of sets over the base model."""
        self._fit([(), *sets])
        base = self.fits[frozenset()].chi2
        return [base - self.fits[frozenset(ids)].chi2 for ids in sets]

    def plausible(self, ids: Ids) -> bool:
        """Whether a real machine could have all numbers of a set."""
        return is_plausible(self.bench.forward, self.fit(ids))

    def held_out(self, ids: Ids) -> HeldOut:
        """Held-out errors of a set."""
        key = frozenset(ids)
        if key not in self.held:
            self.held[key] = held_out(self.bench, self.fit(ids))
        return self.held[key]

    def worse(self, larger: Ids, smaller: Ids) -> tuple[str, ...]:
        """What of the held-out error is larger with the larger set."""
        return self.chance.worse(self.held_out(larger), self.held_out(smaller))

    def pair(self, seen: Sequence[Ids]) -> Ids | None:
        """The best of all pairs of candidates about what ``near`` is, if it promises more than what was seen."""
        if self.near is None:
            return None
        shapes = {n: self.bench.metric.whiten(self.near.here(self.bench, n)) for n in self.names}
        ends = np.cumsum([0, *map(len, shapes.values())])
        rows = np.concatenate(list(shapes.values()))
        places = {n: range(a, b) for n, (a, b) in zip(shapes, pairwise(ends), strict=True)}
        return Pairs(places, rows @ rows.T).best(rows @ self.near.fit.residual, self.threshold, seen)

    def moved(self, ids: Ids) -> Self:
        """Refits with nuisances taken at the fit of a set."""
        starts = self.starts | {key: f.vector for key, f in self.fits.items()}
        return replace(self, bench=self.bench.moved_to(self.fit(ids).vector), starts=starts, fits={}, tried={}, held={})

    def trials(self, ids: Ids) -> list[Trial]:
        """Every other candidate beside ``ids``."""
        key = frozenset(ids)
        if key not in self.tried:
            current = self.fit(ids)
            others = [n for n in self.names if n not in key]
            near = self.near
            if near is None or current is not near.fit:
                near = around(self.bench, current, others, near.points if near is not None else None)
            beside = screened(self.bench, near, others, self.threshold)
            self.tried[key] = [self._trial(current, name, fit) for name, fit in beside.items()]
        return self.tried[key]

    def _trial(self, current: Fit, name: str, fit: Fit) -> Trial:
        key = frozenset(fit.ids)
        if key in self.fits and self.fits[key].chi2 < fit.chi2:
            fit = self.fits[key]
        elif fit.done:
            self.fits[key] = fit
            self.held.pop(key, None)
        gain = current.chi2 - fit.chi2
        if gain < -NESTING:
            raise RunFailed(f"refit of {name} beside {current.ids}: chi2 rose by {-gain:.3g}; the optimiser failed")
        return Trial(
            id=name,
            fit=fit,
            gain=max(gain, 0.0),
            threshold=self.threshold(name),
            plausible=is_plausible(self.bench.forward, fit),
            held_out=held_out(self.bench, fit),
        )

    def _fit(self, sets: Sequence[Ids]) -> None:
        """Refit those sets that were not yet, from where they stood before, or else from the nearest superset."""
        new = {frozenset(ids): ids for ids in sets if frozenset(ids) not in self.fits}
        begun = [self.bench.start(ids, self._start(key)) for key, ids in new.items()]
        for key, fit in zip(new, self.bench.fit(begun) if begun else [], strict=True):
            self.fits[key] = fit

    def _start(self, key: frozenset) -> np.ndarray:
        null = self.bench.forward.null()
        if key in self.starts:
            return self.starts[key]
        larger = [v for k, v in self.starts.items() if k > key]
        vector = null.copy()
        for name in key:
            where = self.bench.forward.index(name)
            vector[where] = larger[-1][where] if larger else null[where]
        return vector


def screened(bench: Workbench, near: Around, names: Sequence[str], threshold) -> dict[str, Fit]:
    """Every candidate beside what ``near`` is around; refitted where its column promises enough."""
    found = {name: projected(bench, near, name) for name in names}
    promise = {n: (near.fit.chi2 - f.chi2) - threshold(n) for n, f in found.items()}
    hopeful = [n for n in names if near.fit.chi2 - found[n].chi2 > PROMISING * threshold(n)]
    first = sorted(hopeful, key=lambda n: -promise[n])[:REFITTED]
    chosen = [n for n in hopeful if n in first or n in near.weak]  # one step says little of what is not linear
    return found | best_of(bench, near, chosen)


def projected(bench: Workbench, near: Around, name: str) -> Fit:
    """One Gauss-Newton step from ``near`` with one more effect: exact where it enters linearly."""
    start = near.with_effect(bench, name)
    size = np.linalg.norm(start.columns, axis=1)
    scale = np.where(size > 1e-6, 1.0 / np.maximum(size, 1e-6), 0.0)
    step = scale * np.linalg.lstsq((start.columns * scale[:, None]).T, start.residual, rcond=1e-8)[0]
    vector = start.vector.copy()
    vector[start.free] += step
    residual = start.residual - step @ start.columns
    return replace(
        start,
        vector=vector,
        residual=residual,
        chi2=float(residual @ residual),
        values=start.values + np.einsum("k,krsn->rsn", step, start.slopes),
    )


def best_of(bench: Workbench, near: Around, names: Sequence[str]) -> dict[str, Fit]:
    """The best joint fit of what ``near`` is around with each of ``names``; several starts for nonlinear effects."""
    starts, owners = [], []
    for name in names:
        starts.append(near.with_effect(bench, name))  # from null, so that no super-model ends above its sub-model
        owners.append(name)
        for point in near.weak.get(name, ()):
            vector = near.fit.vector.copy()
            for position, value in point:
                vector[position] = value
            starts.append(bench.start((*near.fit.ids, name), vector))
            owners.append(name)
    best: dict[str, Fit] = {}
    for name, fit in zip(owners, bench.fit(starts) if starts else [], strict=True):
        if (name not in best or fit.chi2 < best[name].chi2) and not has_diverged(fit):
            best[name] = fit
    return best
