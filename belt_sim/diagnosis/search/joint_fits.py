"""Joint fits of sets of effects to the readings of a campaign, each once.

A candidate beside a set is screened by what its column takes of the residual; those that promise most are refitted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Self

import numpy as np

from belt_sim.diagnosis.fits.around import Around, around
from belt_sim.diagnosis.fits.candidate import has_diverged, is_plausible
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.one_step import bent, projected
from belt_sim.diagnosis.fits.within import within
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.search.pairs import Ids, Pairs, beside
from belt_sim.diagnosis.search.race import ALIKE, Race
from belt_sim.errors import RunFailed

REFITTED = 6  # candidates a round; the others keep what their columns promise
MOVES = 3  # more, at most, until nuisances are where the fit about them puts them
PROMISING = 0.3  # share of its price that a candidate must promise to be refitted
RISE = 1.0  # chi2, by which a larger set may come out worse than a smaller one, by rounding and the end of a search


@dataclass(frozen=True)
class Trial:
    """A candidate beside what was there: the joint fit, and the chi2 that it gains over what was there."""

    id: str
    fit: Fit
    gain: float


@dataclass
class JointFits:
    """Joint fits on one workbench, about one point.

    price: chi2 that one effect must promise; near: what is about the base fit; starts: set -> where a fit may begin
    (trials that were not carried to their end, and all that was fitted elsewhere); fits: set -> its best joint fit;
    tried: set -> every other candidate beside it; bent: gains of single effects that are not linear, and of pairs with
    one.
    """

    bench: Workbench
    price: float
    near: Around
    starts: dict[frozenset, Fit] = field(default_factory=dict)
    fits: dict[frozenset, Fit] = field(default_factory=dict)
    tried: dict[frozenset, list[Trial]] = field(default_factory=dict)
    bent: dict[frozenset, float] = field(default_factory=dict)

    @property
    def names(self) -> Ids:
        """All candidates."""
        return tuple(c.id for c in self.bench.forward.classes)

    def fit(self, ids: Ids) -> Fit:
        """The best joint fit of a set that was found."""
        self._fit([ids])
        return self.fits[frozenset(ids)]

    def fit_all(self, sets: Sequence[Ids]) -> None:
        """Fit those of ``sets`` that were not yet."""
        self._fit(sets)

    def best_pairs(self, count: int) -> list[Ids]:
        """The best pairs of candidates, in the linear range, that promise more than any effect does."""
        pairs, moments = self._pairs(self.near)
        return pairs.best(moments, self.price, count)

    def _pairs(self, near: Around) -> tuple[Pairs, np.ndarray]:
        """All pairs of candidates about the base model, and the products of their columns with what that leaves."""
        shapes = {n: self.bench.metric.whiten(near.here(self.bench, n)) for n in self.names}
        ends = np.cumsum([0, *map(len, shapes.values())])
        rows = np.concatenate(list(shapes.values()))
        places = {n: range(a, b) for n, (a, b) in zip(shapes, pairwise(ends), strict=True)}
        for t in self.tried.get(frozenset(), []):  # there is none about another set: what was found before is kept
            if t.gain > self.price and t.id in near.weak:
                others = {n: s for n, s in shapes.items() if n != t.id}
                gains = beside(t.fit.columns, t.fit.residual, others)
                self.bent |= {frozenset([t.id]): t.gain} | {frozenset([t.id, n]): t.gain + g for n, g in gains.items()}
        return Pairs(places, rows @ rows.T, self.bent), rows @ self.fit(()).residual

    def moved(self, ids: Ids) -> Self:
        """The same with nuisances and noise taken at the fit of a set, which is another there: until it stays."""
        moved = self._moved(ids)
        for _ in range(MOVES):
            if _same(self.fits[frozenset(ids)], moved.fit(ids)):
                break
            self, moved = moved, moved._moved(ids)
        return moved

    def _moved(self, ids: Ids) -> Self:
        bench = self.bench.moved_to(self.fit(ids).vector)
        known = {key: f for key, f in self.starts.items() if key not in self.fits}
        known |= {key: f for key, f in self.fits.items() if np.isfinite(f.chi2)}
        starts = {key: _elsewhere(f, bench) for key, f in known.items()}
        return replace(self, bench=bench, starts=starts, fits={}, tried={})

    def trials(self, ids: Ids) -> list[Trial]:
        """Every other candidate beside ``ids``."""
        key = frozenset(ids)
        if key not in self.tried:
            current = self.fit(ids)
            others = [n for n in self.names if n not in key]
            near = self.near if current is self.near.fit else around(self.bench, current, others, self.near)
            beside = screened(self.bench, near, others, self.price, self._known(key, others))
            self.tried[key] = [self._trial(current, name, fit) for name, fit in beside.items()]
        return self.tried[key]

    def _known(self, key: frozenset, names: Sequence[str]) -> dict[str, Fit]:
        """A fit with each of ``names`` beside ``key``, or else beside something else, where there is one."""
        fits = self.starts | self.fits
        found = {n: f for own, f in fits.items() for n in names if n in own}
        return found | {n: fits[key | {n}] for n in names if key | {n} in fits}

    def _trial(self, current: Fit, name: str, fit: Fit) -> Trial:
        key = frozenset(fit.ids)
        if key in self.fits and _better(self.bench, self.fits[key], fit):
            fit = self.fits[key]
        elif fit.done:
            self.fits[key] = fit
        elif fit.settled or fit.taken:  # one that ran out of rounds is nearer than null is
            self.starts[key] = fit
        gain = current.chi2 - fit.chi2
        if gain < -RISE:
            raise RunFailed(f"refit of {name} beside {current.ids}: chi2 rose by {-gain:.3g}; the optimiser failed")
        return Trial(name, fit, max(gain, 0.0))

    def _fit(self, sets: Sequence[Ids]) -> None:
        """Refit those sets that were not yet, from where they stood before, or else from the nearest superset."""
        new = {frozenset(ids): ids for ids in sets if frozenset(ids) not in self.fits}
        begun = [(key, start) for key, ids in new.items() for start in self._begun(key, ids)]
        best: dict[frozenset, Fit] = {}
        for (key, _), fit in zip(begun, self.bench.fit([start for _, start in begun]) if begun else [], strict=True):
            if key not in best or (fit.done, -fit.chi2) > (best[key].done, -best[key].chi2):
                best[key] = fit
        self.fits |= dict(zip(best, within(self.bench, list(best.values())), strict=True))

    def _begun(self, key: frozenset, ids: Ids) -> list[Fit]:
        """Where a set begins: where it stood, or where a larger one has its effects; or else at null, and where each of
        them stood by itself: a gap or a place that is off by far keeps a refit from the best point.
        """
        if key in self.starts:
            return [self.starts[key]]
        null, fits = self.bench.forward.null(), self.starts | self.fits
        larger = [f for k, f in self.starts.items() if k > key]
        if larger:
            return [self.bench.start(ids, self._numbers(null, dict.fromkeys(key, larger[-1])))]
        single = {n: fits[frozenset([n])] for n in key if frozenset([n]) in fits}
        alone = [self.bench.start(ids, self._numbers(null, single))] if len(key) > 1 and single else []
        return [self.bench.start(ids, null), *alone]

    def _numbers(self, vector: np.ndarray, known: Mapping[str, Fit]) -> np.ndarray:
        """A vector with the numbers of some effects as fits have them."""
        vector = vector.copy()
        for name, fit in known.items():
            where = self.bench.forward.index(name)
            vector[where] = fit.vector[where]
        return vector


def _same(one: Fit, other: Fit) -> bool:
    """Whether two fits of one set have the same numbers, as far as readings tell."""
    if not other.free:
        return True
    apart = (other.vector - one.vector)[other.free] @ other.columns.reshape(len(other.free), -1)
    return bool(apart @ apart < RISE)


def _elsewhere(fit: Fit, bench: Workbench) -> Fit:
    """A fit to go on from on another workbench, with the derivatives that it had."""
    columns = bench.metric.whiten(fit.slopes) if fit.free else fit.columns
    return replace(fit, chi2=np.inf, columns=columns, true=False, settled=False)


def screened(
    bench: Workbench, near: Around, names: Sequence[str], price: float, known: Mapping[str, Fit]
) -> dict[str, Fit]:
    """Every candidate beside what ``near`` is around; refitted where its column promises enough."""
    found = {name: projected(bench, near, name) for name in names}
    promise = {n: near.fit.chi2 - f.chi2 for n, f in found.items()}
    hopeful = [n for n in names if promise[n] > PROMISING * price]
    first = sorted(hopeful, key=lambda n: -promise[n])[:REFITTED]
    doubtful = {*near.weak, *bent(bench, near, {n: found[n] for n in hopeful if n not in first})}
    chosen = [n for n in hopeful if n in first or n in doubtful]  # one step says little of what is not linear
    return found | best_of(bench, near, chosen, price, known)


def best_of(
    bench: Workbench, near: Around, names: Sequence[str], price: float, known: Mapping[str, Fit]
) -> dict[str, Fit]:
    """The best joint fit of what ``near`` is around with each of ``names``; several starts for nonlinear effects.

    price: chi2 that each must gain; only what does, and the best of others nearly, is carried to its end; known: fits
    with these names, beside the same or something else.
    """
    begun = [(name, start) for name in names for start in near.starts(bench, name, known.get(name))]
    owners, starts = [name for name, _ in begun], [start for _, start in begun]
    race = Race(near.fit.chi2, owners, dict.fromkeys(names, price), bench.forward.sides)
    fits = bench.fit(starts, race=race) if starts else []
    ends = [k for k in race.ahead(fits) if not fits[k].done]
    for k, fit in zip(ends, bench.fit([fits[k] for k in ends]) if ends else [], strict=True):
        fits[k] = fit
    best = _best(bench, near, owners, fits)
    ahead = [n for n, f in best.items() if f.done and near.fit.chi2 - f.chi2 > price]
    return best | dict(zip(ahead, within(bench, [best[n] for n in ahead]), strict=True))


def _best(bench: Workbench, near: Around, owners: Sequence[str], fits: Sequence[Fit]) -> dict[str, Fit]:
    """The best fit of every owner, of those that have not diverged; at null where these are worse than without it."""
    best: dict[str, Fit] = {}
    for name, fit in zip(owners, fits, strict=True):
        if not has_diverged(fit) and (name not in best or _better(bench, fit, best[name])):
            best[name] = fit
    return {n: f if f.chi2 <= near.fit.chi2 else near.with_effect(bench, n) for n, f in best.items()}


def _better(bench: Workbench, one: Fit, other: Fit) -> bool:
    """Whether one fit is better than another; of two that readings do not tell apart, what a machine can have is."""
    if abs(one.chi2 - other.chi2) > ALIKE:
        return one.chi2 < other.chi2
    return (is_plausible(bench.forward, one), -one.chi2) > (is_plausible(bench.forward, other), -other.chi2)
