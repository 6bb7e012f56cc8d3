"""Best-first search over joint fits of sets of effects: beside the likeliest set every other candidate, then others in
the place of its members.

A candidate beside a set is screened by what its column takes of the residual; those that promise most are refitted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise
from typing import Self

import numpy as np

from belt_sim.diagnosis.decision.decide import explanations
from belt_sim.diagnosis.decision.policy import POLICY
from belt_sim.diagnosis.decision.table import EvidenceTable, Ids, Row
from belt_sim.diagnosis.fits.belt_starts import places_tried
from belt_sim.diagnosis.fits.fit import Fit, predicted_gain
from belt_sim.diagnosis.fits.heldout import held_out, prior_of_fit
from belt_sim.diagnosis.fits.linearisation import Linearisation, linearise
from belt_sim.diagnosis.fits.plausibility import has_diverged, is_plausible, prefer_plausible
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.linear_algebra import basis
from belt_sim.errors import FitError

ROUNDS = 8
PAIRS = 3  # that are fitted because they promise more together than any effect alone
MAX_EFFECTS = 4


class Search:
    """fits: about the likeliest set that was found."""

    def __init__(self, bench: Workbench, linearisation: Linearisation, inflation: float) -> None:
        """linearisation: about the fit of no effect; inflation: as in ``EvidenceTable``."""
        self.inflation, self.count = inflation, len(bench.forward.classes)
        price = 2.0 * float(np.log(max(self.count, 1))) + 4.0  # of one size, one in so many candidates [chi2]
        self.fits = JointFits(bench, price, linearisation, fits={frozenset(): linearisation.fit})
        self.about: Ids = frozenset()

    def run(self) -> None:
        """Grow the likeliest set, then look in the place of each of its members, until nothing is likelier.

        Explanations are compared about one point: noise levels, and with them what a gain counts, differ elsewhere.
        """
        self.fits.fit_all(self.fits.best_pairs(PAIRS))
        for _ in range(ROUNDS):
            best = self._likeliest()
            ids = self.fits.fits[best].ids
            if best != self.about:  # noise, settings and all subsets are taken about it
                self.fits, self.about = self.fits.move_to(ids), best
                self.fits.fit_all([part for k in range(len(ids) + 1) for part in combinations(ids, k)])
            if len(best) < MAX_EFFECTS:
                self.fits.trials(ids)
            if self._likeliest() == best:
                for name in ids:
                    self.fits.trials(tuple(i for i in ids if i != name))
                if self._likeliest() == best:
                    break

    def table(self, checked: bool = True) -> EvidenceTable:
        """All that is fitted, about where the search stands; checked: with what is predicted of left-out conditions."""
        fits = [f for f in self.fits.fits.values() if np.isfinite(f.chi2)]
        rows = tuple(row_of(self.fits.bench, f, checked) for f in fits)
        return EvidenceTable(candidates=self.count, inflation=self.inflation, damaged=False, rows=rows)

    def _likeliest(self) -> Ids:
        """The likeliest set about where the search stands."""
        return frozenset(explanations(self.table(checked=False), POLICY)[0].effects)


# Pairs of candidates, all at once in the linear range: where a third effect looks like the sum of two, a search that
# adds one effect after the other takes the third and never sees the two.
#
# Columns at null say little of an effect that bends (a guide that touches from some gap on). One that was fitted by
# itself is known where it then stands, and so is what each of the others would add there.


FEW = 4  # numbers of an effect, at most; one with more (a free edge profile) looks like no sum of others
Names = tuple[str, ...]

NESTING = 1.0  # chi2, by which a pair must be ahead of its members
ALIKE_PAIRS = 1e-9  # of the largest eigenvalue of columns of unit length: those below are sums of the others


def leading_pairs(
    shapes: Mapping[str, np.ndarray], residual: np.ndarray, price: float, count: int, known: Mapping[frozenset, float]
) -> list[Names]:
    """At most ``count`` pairs of candidates that promise more than any candidate alone, best first.

    shapes: candidate -> whitened shapes (k, N); residual (N,); price: chi2 that each effect must earn; known: gains of
    nonlinear effects, and of pairs with one of them, where that effect was fitted.
    """
    gains = linear_gains(shapes, residual)
    scores = {ids: max(gain, known.get(frozenset(ids), 0.0)) - price * len(ids) for ids, gain in gains.items()}
    alone = max((s for ids, s in scores.items() if len(ids) == 1), default=-np.inf)
    ahead: list[Names] = [ids for ids, score in scores.items() if len(ids) == 2 and score > alone + NESTING]
    return sorted(ahead, key=lambda ids: -scores[ids])[:count]


def linear_gains(shapes: Mapping[str, np.ndarray], residual: np.ndarray) -> dict[Names, float]:
    """chi2 that every candidate of FEW numbers, and every pair of them, takes of a residual (N,) in the linear range;
    shapes: candidate -> whitened shapes (k, N).
    """
    few = {n: rows for n, rows in shapes.items() if 0 < len(rows) <= FEW}
    rows = np.concatenate([np.empty((0, len(residual))), *few.values()])
    unit = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    gram, moments, ends = unit @ unit.T, unit @ residual, np.cumsum([0, *map(len, few.values())])
    places = {n: np.arange(*pair) for n, pair in zip(few, pairwise(ends), strict=True)}
    found: dict[Names, float] = {}
    for ids in [*((n,) for n in few), *combinations(few, 2)]:
        own = np.concatenate([places[i] for i in ids])
        inverse = np.linalg.pinv(gram[np.ix_(own, own)], rcond=ALIKE_PAIRS, hermitian=True)
        found[ids] = float(moments[own] @ inverse @ moments[own])
    return found


def marginal_gains(columns: np.ndarray, residual: np.ndarray, others: Mapping[str, np.ndarray]) -> dict[str, float]:
    """chi2 that each of ``others``, by its shapes (k, N), would take of what a fit leaves (N,), its own numbers, whose
    derivatives are ``columns`` (K, N), refitted along.
    """
    own = basis(columns)
    spans = {name: np.concatenate([own, basis(rows - (rows @ own.T) @ own)]) for name, rows in others.items()}
    return {name: float(np.sum((span @ residual) ** 2)) for name, span in spans.items()}


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

    price: chi2 that one effect must promise; linearisation: what is about the base fit; starts: set -> where a fit may
    begin (trials that were not carried to their end, and all that was fitted elsewhere); fits: set -> its best joint
    fit; tried: set -> every other candidate beside it.
    """

    bench: Workbench
    price: float
    linearisation: Linearisation
    starts: dict[frozenset, Fit] = field(default_factory=dict)
    fits: dict[frozenset, Fit] = field(default_factory=dict)
    tried: dict[frozenset, list[Trial]] = field(default_factory=dict)

    @property
    def names(self) -> Names:
        """All candidates."""
        return tuple(c.id for c in self.bench.forward.classes)

    def fit(self, ids: Names) -> Fit:
        """The best joint fit of a set that was found."""
        self.fit_all([ids])
        return self.fits[frozenset(ids)]

    def fit_all(self, sets: Sequence[Names]) -> None:
        """Fit those of ``sets`` that were not yet, from where they stood before, or else from the nearest superset."""
        new = {frozenset(ids): ids for ids in sets if frozenset(ids) not in self.fits}
        begun = [(key, start) for key, ids in new.items() for start in self._starts_of(key, ids)]
        best: dict[frozenset, Fit] = {}
        for (key, _), fit in zip(begun, self.bench.fit([start for _, start in begun]) if begun else [], strict=True):
            if key not in best or (fit.is_converged, -fit.chi2) > (best[key].is_converged, -best[key].chi2):
                best[key] = fit
        self.fits |= dict(zip(best, prefer_plausible(self.bench, list(best.values())), strict=True))

    def best_pairs(self, count: int) -> list[Names]:
        """At most ``count`` pairs of candidates that promise more in the linear range than any effect alone."""
        shapes = {n: self.bench.metric.whiten(self.linearisation.shapes_of(self.bench, n)) for n in self.names}
        known: dict[frozenset, float] = {}
        for t in self.trials(()):
            if t.gain > self.price and t.id in self.linearisation.weak:
                gains = marginal_gains(t.fit.columns, t.fit.residual, {n: s for n, s in shapes.items() if n != t.id})
                known |= {frozenset([t.id]): t.gain}
                known |= {frozenset([t.id, n]): t.gain + gain for n, gain in gains.items()}
        return leading_pairs(shapes, self.fit(()).residual, self.price, count, known)

    def move_to(self, ids: Names) -> Self:
        """The same with nuisances and noise taken at the fit of a set, which is another there: until it stays."""
        moved = self._move_once(ids)
        for _ in range(MOVES):
            fit = moved.fit(ids)
            apart = (fit.vector - self.fits[frozenset(ids)].vector)[fit.free] @ fit.columns
            if apart @ apart < RISE:  # the same, as far as readings tell
                break
            self, moved = moved, moved._move_once(ids)
        return moved

    def _move_once(self, ids: Names) -> Self:
        bench = self.bench.moved_to(self.fit(ids).vector)
        known = {key: f for key, f in self.starts.items() if key not in self.fits}
        known |= {key: f for key, f in self.fits.items() if np.isfinite(f.chi2)}
        starts = {}
        for key, f in known.items():
            columns = bench.metric.whiten(f.slopes) if f.free else f.columns
            starts[key] = replace(f, chi2=np.inf, columns=columns, exact=False, settled=False)
        return replace(self, bench=bench, starts=starts, fits={}, tried={})

    def trials(self, ids: Names) -> list[Trial]:
        """Every other candidate beside ``ids``."""
        key = frozenset(ids)
        if key not in self.tried:
            current = self.fit(ids)
            others = [n for n in self.names if n not in key]
            linearisation = self.linearisation
            if current is not linearisation.fit:
                linearisation = linearise(self.bench, current, others, linearisation)
            fits = self.starts | self.fits
            known = {n: f for own, f in fits.items() for n in others if n in own}  # beside something else
            known |= {n: fits[key | {n}] for n in others if key | {n} in fits}
            beside = screen(self.bench, linearisation, others, self.price, known)
            self.tried[key] = [self._trial(current, name, fit) for name, fit in beside.items()]
        return self.tried[key]

    def _trial(self, current: Fit, name: str, fit: Fit) -> Trial:
        key = frozenset(fit.ids)
        if key in self.fits and _better(self.bench, self.fits[key], fit):
            fit = self.fits[key]
        elif fit.is_converged:
            self.fits[key] = fit
        elif fit.settled or fit.taken:  # one that ran out of rounds is nearer than null is
            self.starts[key] = fit
        gain = current.chi2 - fit.chi2
        if gain < -RISE:
            raise FitError(f"refit of {name} beside {current.ids}: chi2 rose by {-gain:.3g}; the optimiser failed")
        return Trial(name, fit, max(gain, 0.0))

    def _starts_of(self, key: frozenset, ids: Names) -> list[Fit]:
        """Where a set begins: where it stood, and where the best larger one has its effects, which may add nothing to
        them; or else at null, and where each of them stood by itself: a gap or a place that is off by far keeps a refit
        from the best point.
        """
        if key in self.starts:
            larger = sorted((f for k, f in self.fits.items() if key and k > key), key=lambda f: f.chi2)[:1]
            return [self.starts[key], *(self._start_from(ids, dict.fromkeys(key, f)) for f in larger)]
        fits = self.starts | self.fits
        larger = [f for k, f in self.starts.items() if k > key]
        if larger:
            return [self._start_from(ids, dict.fromkeys(key, larger[-1]))]
        single = {n: fits[frozenset([n])] for n in key if frozenset([n]) in fits}
        alone = [self._start_from(ids, single)] if len(key) > 1 and single else []
        return [self._start_from(ids, {}), *alone]

    def _start_from(self, ids: Names, known: Mapping[str, Fit]) -> Fit:
        """A fit of ``ids`` to begin at null, with the numbers of some effects as other fits have them."""
        vector = self.bench.forward.null()
        for name, fit in known.items():
            where = self.bench.forward.index(name)
            vector[where] = fit.vector[where]
        return self.bench.start(ids, vector)


def screen(
    bench: Workbench, linearisation: Linearisation, names: Sequence[str], price: float, known: Mapping[str, Fit]
) -> dict[str, Fit]:
    """Every candidate beside the linearised fit; refitted where its column promises enough."""
    found = {name: best_gauss_newton_step(bench, linearisation, name) for name in names}
    promise = {n: linearisation.fit.chi2 - f.chi2 for n, f in found.items()}
    hopeful = [n for n in names if promise[n] > PROMISING * price]
    first = sorted(hopeful, key=lambda n: -promise[n])[:REFITTED]
    bent = find_nonlinear(bench, linearisation, {n: found[n] for n in hopeful if n not in first})
    # one step says little of what is not linear
    chosen = [n for n in hopeful if n in first or n in linearisation.weak or n in bent]
    return found | fit_best(bench, linearisation, chosen, price, known)


def fit_best(
    bench: Workbench, linearisation: Linearisation, names: Sequence[str], price: float, known: Mapping[str, Fit]
) -> dict[str, Fit]:
    """The best joint fit of the linearised fit's effects with each of ``names``; several starts for nonlinear effects.

    price: chi2 that each must gain; only what does, and the best of others nearly, is carried to its end; known: fits
    with these names, beside the same or something else.
    """
    begun = [(name, start) for name in names for start in linearisation.starts(bench, name, known.get(name))]
    owners, starts = [name for name, _ in begun], [start for _, start in begun]
    numbers = {name: len(start.free) - len(linearisation.fit.free) for name, start in begun}
    thresholds = {name: price + FURTHER * (k - 1) for name, k in numbers.items()}
    race = Race(linearisation.fit.chi2, owners, thresholds, bench.forward.sides)
    fits = bench.fit(starts, race=race) if starts else []
    ends = [k for k in race.leaders(fits) if not fits[k].is_converged]
    for k, fit in zip(ends, bench.fit([fits[k] for k in ends]) if ends else [], strict=True):
        fits[k] = fit
    best: dict[str, Fit] = {}
    for name, fit in zip(owners, fits, strict=True):
        if not has_diverged(fit) and (name not in best or _better(bench, fit, best[name])):
            best[name] = fit
    without = linearisation.fit.chi2
    best = {n: f if f.chi2 <= without else linearisation.with_effect(bench, n) for n, f in best.items()}
    ahead = [n for n, f in best.items() if f.is_converged and without - f.chi2 > price]
    return best | dict(zip(ahead, prefer_plausible(bench, [best[n] for n in ahead]), strict=True))


def _better(bench: Workbench, one: Fit, other: Fit) -> bool:
    """Whether one fit is better than another; of two that readings do not tell apart, what a machine can have is."""
    if abs(one.chi2 - other.chi2) > ALIKE:
        return one.chi2 < other.chi2
    return (is_plausible(bench.forward, one), -one.chi2) > (is_plausible(bench.forward, other), -other.chi2)


FURTHER = 2.0  # chi2 that each further free number must gain (Akaike): the 70 of an edge gain 70 by chance
ALIKE = 0.5  # chi2 by which two ends of one search may differ along a valley that readings hardly bound
CLOSE = 12.0  # chi2 behind the best candidate, or the least that counts: further behind, no exact end is needed
HORIZON = 20.0  # steps as good as the next that a fit behind others is given
BEHIND = 0.3  # share of the best score so far; a valley is slow where it bends, and what is ahead now may lose
MET = 0.02  # of a number, or its scale: two fits of a candidate so near each other go the same way
TRIED = 2  # steps that every fit is given


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
                # a step that failed made the next ones short
                at_once = predicted_gain(replace(fit, radius=np.inf), self.sides)
                reach = fit.chi2 - max(HORIZON * predicted_gain(fit, self.sides), at_once)
                met = any(n == name and np.allclose(fit.vector, f.vector, rtol=MET, atol=MET) for n, f in seen)
                fit.settled = met or self._score(name, reach) < least
            seen.append((name, fit))

    def leaders(self, fits: Sequence[Fit]) -> list[int]:
        """Which fits are the best of candidates near the front, or as good."""
        best, least = self._front(fits)
        near = {n for n, chi2 in best.items() if self._score(n, chi2) > least}
        return [k for k, n in enumerate(self.owners) if n in near and fits[k].chi2 < best[n] + ALIKE]

    def _front(self, fits: Sequence[Fit]) -> tuple[dict[str, float], float]:
        """The best chi2 of every candidate, and the score below which none is near the front."""
        best: dict[str, float] = {}
        for name, fit in zip(self.owners, fits, strict=True):
            best[name] = min(fit.chi2, best.get(name, np.inf))
        return best, max([0.0, *(self._score(n, c) for n, c in best.items())]) - CLOSE

    def _score(self, name: str, chi2: float) -> float:
        return self.chi2 - chi2 - self.thresholds[name]


# What one more effect promises: one Gauss-Newton step, exact where it enters linearly.
#
# A number that only shapes an effect (where a weld is) says nothing while that is null: a step from null tries its null
# value alone, and an effect that is somewhere else promises next to nothing there. So a step is taken from each of the
# best points of its grid as well, and the best counts.
#
# Of an effect that bends (a cover that soon is as soft as can be) a step may promise far too little: it goes nowhere
# near the size that the effect has, and what it does there is another shape. One prediction at the step's end tells.


BENT = 0.3  # of what a step should do, by which it may do something else


def best_gauss_newton_step(bench: Workbench, linearisation: Linearisation, name: str) -> Fit:
    """The best fit with one more effect than the linearised one, a step from null or from points of its grid."""
    return min(map(_gauss_newton_step, linearisation.linear_starts(bench, name)), key=lambda fit: fit.chi2)


def find_nonlinear(bench: Workbench, linearisation: Linearisation, stepped: Mapping[str, Fit]) -> list[str]:
    """Effects that do something else at the ends of their steps than the step foresaw; none that a machine has on the
    other side of null only.
    """
    null, (low, high) = bench.forward.null(), bench.forward.sides
    ends = {n: np.clip(f.vector, low, high) for n, f in stepped.items()}
    places = {n: bench.forward.index(n) for n in stepped}
    asked = [n for n, k in places.items() if not bench.forward.linear[k].all() and (ends[n] != null)[k].any()]
    if not asked:
        return []
    there = bench.forward.values(np.stack([ends[n] for n in asked]))
    steps = [(stepped[n], (ends[n] - stepped[n].vector)[stepped[n].free]) for n in asked]
    foreseen = np.stack([f.values + np.einsum("k,krsn->rsn", step, f.slopes) for f, step in steps])
    does, by_slopes = (bench.metric.whiten(v - linearisation.fit.values) for v in (there, foreseen))
    with np.errstate(over="ignore", invalid="ignore"):  # a step may end anywhere
        off, size = (np.linalg.norm(rows, axis=1) for rows in (does - by_slopes, by_slopes))
    known = np.isfinite(there).all(axis=(1, 2, 3))
    return [n for n, o, s, k in zip(asked, off, size, known, strict=True) if not (k and o <= BENT * s)]


def _gauss_newton_step(start: Fit) -> Fit:
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


# A joint fit as a row of the table of evidence.


def row_of(bench: Workbench, fit: Fit, checked: bool) -> Row:
    """What a decision needs to know of a fit; checked: with what it predicts of left-out conditions."""
    slots = [bench.forward.slots[k] for k in fit.free]
    columns = fit.columns.reshape(len(slots), len(fit.residual))
    left_out = held_out(bench, fit) if checked else {}
    _, sigma, away = prior_of_fit(bench, fit)
    scanned = {position: len(values) for name in fit.ids for position, values in bench.forward.grids(name).items()}
    turned = places_tried(bench) if any(s.effect.comes_round for s in slots) else ()
    kept = [k for k, position in enumerate(fit.free) if position not in scanned]
    sized = np.array([not (s.only_shapes or s.effect.is_additive()) for s in slots], dtype=bool)
    return Row(
        ids=frozenset(fit.ids),
        chi2=float(fit.chi2),
        gram=(columns @ columns.T)[np.ix_(kept, kept)],
        away=away[kept],
        sigma=sigma[kept],
        owner=tuple(slots[k].effect.id for k in kept),
        sized=sized[kept],
        scanned=(*scanned.values(), *turned),
        plausible=not slots or is_plausible(bench.forward, fit),
        held_out={n: c.surprise for n, c in left_out.items() if c.testable},
    )
