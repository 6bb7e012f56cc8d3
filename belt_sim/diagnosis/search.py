"""Best-first search over joint fits of sets of effects, and the screening of what may be added to a set."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise

import numpy as np

from belt_sim.diagnosis.decide import POLICY, EvidenceTable, Ids, Row, explanations
from belt_sim.diagnosis.errors import held_out, prior_of_fit
from belt_sim.diagnosis.fit import Fit, Refit, basis
from belt_sim.diagnosis.linearisation import EVEN, GridStart, Linearisation, linearise_effects
from belt_sim.diagnosis.plausibility import has_diverged, is_plausible, prefer_plausible
from belt_sim.diagnosis.workbench import Workbench

# Which effects are worth a joint refit beside a fitted set, and the best refit of each.
#
# In the linear range one Gauss-Newton step tells what an effect would gain (score test). Those that promise most are
# refitted, and so is what is nonlinear, of which a step says little.


Names = tuple[str, ...]

REFITTED = 6  # effects beside one set; the others keep what their columns promise
PROMISING = 0.3  # share of the penalty that a step must gain


def screen(
    bench: Workbench, linearisation: Linearisation, names: Sequence[str], penalty: float, earlier: Mapping[str, Fit]
) -> dict[str, Fit]:
    """The linearised fit with each of ``names`` added: refitted where a step promises enough, else as that step has it.

    penalty, earlier: as in ``fit_best``.
    """
    steps = {name: best_gauss_newton_step(bench, linearisation, name) for name in names}
    gains = {n: linearisation.fit.chi2 - f.chi2 for n, f in steps.items()}
    promising = [n for n in names if gains[n] > PROMISING * penalty]
    first = sorted(promising, key=lambda n: -gains[n])[:REFITTED]
    nonlinear = find_nonlinear(bench, linearisation, {n: steps[n] for n in promising if n not in first})
    chosen = [n for n in promising if n in first or n in linearisation.starts or n in nonlinear]
    return steps | fit_best(bench, linearisation, chosen, penalty, earlier)


# One Gauss-Newton step, exact where an effect enters linearly.
#
# A number that only shapes an effect (where a weld is) says nothing while that is null: a step from null tries its null
# value alone, and an effect that is somewhere else promises next to nothing there. So a step is taken from each of the
# best points of its grid as well, and the best counts.
#
# The step of a nonlinear effect (a cover that soon is as soft as can be) may promise far too little: it goes nowhere
# near the size that the effect has, and what it does there is another shape. One prediction at the step's end tells.

NONLINEAR = 0.3  # share of what a step should do, by which an effect does something else


def best_gauss_newton_step(bench: Workbench, linearisation: Linearisation, name: str) -> Fit:
    """The best fit with one more effect than the linearised one, a step from null or from points of its grid, as the
    derivatives there foresee it."""
    null, ends = linearisation.with_effect(bench, name), []
    on_grid = [s for s in linearisation.starts.get(name, []) if isinstance(s, GridStart)]  # shapes are known there
    for start in (null, *(s.begin(bench, null) for s in on_grid)):
        size = start.sensitivity
        scale = np.where(size > 1e-6, 1.0 / np.maximum(size, 1e-6), 0.0)
        step = scale * np.linalg.lstsq((start.columns * scale[:, None]).T, start.residual, rcond=1e-8)[0]
        vector = start.vector.copy()
        vector[start.free] += step
        residual = start.residual - step @ start.columns
        values = start.values + np.einsum("k,krsn->rsn", step, start.slopes)
        ends.append(replace(start, vector=vector, residual=residual, chi2=float(residual @ residual), values=values))
    return min(ends, key=lambda fit: fit.chi2)


def find_nonlinear(bench: Workbench, linearisation: Linearisation, steps: Mapping[str, Fit]) -> list[str]:
    """Effects that do something else at the ends of their steps than the derivatives foresee; none that a machine has
    on the other side of null only.
    """
    null, (low, high) = bench.forward.null(), bench.forward.sides
    ends = {n: np.clip(f.vector, low, high) for n, f in steps.items()}
    positions = {n: bench.forward.index(n) for n in steps}
    names = [n for n, k in positions.items() if not bench.forward.linear[k].all() and (ends[n] != null)[k].any()]
    if not names:
        return []
    values = bench.forward.values(np.stack([ends[n] for n in names]))
    fits = [steps[n] for n in names]
    back = [(ends[n] - f.vector)[f.free] for n, f in zip(names, fits, strict=True)]  # to the sides a machine has
    foreseen = np.stack([f.values + np.einsum("k,krsn->rsn", b, f.slopes) for f, b in zip(fits, back, strict=True)])
    change, linear = (bench.metric.whiten(v - linearisation.fit.values) for v in (values, foreseen))
    with np.errstate(over="ignore", invalid="ignore"):  # a step may end anywhere
        error, size = (np.linalg.norm(rows, axis=1) for rows in (change - linear, linear))
    finite = np.isfinite(values).all(axis=(1, 2, 3))
    return [names[k] for k in np.flatnonzero(~(finite & (error <= NONLINEAR * size)))]


# Joint refits, from several starts where an effect is nonlinear.


def fit_best(
    bench: Workbench, linearisation: Linearisation, names: Sequence[str], penalty: float, earlier: Mapping[str, Fit]
) -> dict[str, Fit]:
    """The best joint fit of the linearised fit's effects with each of ``names``.

    penalty: chi2 that each must gain; only what does, and the best of others nearly, is carried to its end; earlier:
    fits with these names, beside the same effects or different ones.
    """
    # A refit begins at null, so that no super-model ends above its sub-model; where an earlier one ended, with all its
    # numbers if it is of the same set, else with those of the effect; if none is of the same set, at points of the
    # effect's grid, where what only shapes it moves nothing yet, and at sizes that show.
    begun = list[tuple[str, Fit]]()
    for name in names:
        null, further = linearisation.with_effect(bench, name), linearisation.starts.get(name, [])
        known, same = earlier.get(name), False
        begun.append((name, null))
        if known is not None and further:
            same, vector = set(known.ids) == set(null.ids), null.vector.copy()
            taken = null.free if same else bench.forward.index(name)
            vector[taken] = known.vector[taken]
            begun.append((name, replace(null, vector=vector, chi2=np.inf, exact=False)))
        begun += [(name, start.begin(bench, null)) for start in further if not same]
    owners, starts = [name for name, _ in begun], [start for _, start in begun]
    numbers = {name: len(start.free) - len(linearisation.fit.free) for name, start in begun}
    penalties = {name: penalty + PER_NUMBER * (k - 1) for name, k in numbers.items()}
    without = linearisation.fit.chi2
    race = Race(without, owners, penalties)
    fits = bench.fit(starts, race.find_hopeless)
    chi2, least = race.front(fits)  # what is the best of its effect near the front, or as good, comes to its end
    near = {n for n, c in chi2.items() if race.score(n, c) > least}
    ends = [k for k, n in enumerate(owners) if n in near and fits[k].chi2 < chi2[n] + SAME_END]
    ends = [k for k in ends if not fits[k].is_converged]
    for k, fit in zip(ends, bench.fit([fits[k] for k in ends]), strict=True):
        fits[k] = fit
    best: dict[str, Fit] = {}
    for name, fit in zip(owners, fits, strict=True):
        if not has_diverged(fit) and (name not in best or is_better(bench, fit, best[name])):
            best[name] = fit
    best = {n: f if f.chi2 <= without else linearisation.with_effect(bench, n) for n, f in best.items()}
    paying = [n for n, f in best.items() if f.is_converged and without - f.chi2 > penalty]
    return best | dict(zip(paying, prefer_plausible(bench, [best[n] for n in paying]), strict=True))


def is_better(bench: Workbench, one: Fit, other: Fit) -> bool:
    """Whether one fit is better than another; of two that readings do not tell apart, what a machine can have is."""
    if abs(one.chi2 - other.chi2) > SAME_END:
        return one.chi2 < other.chi2
    return (is_plausible(bench.forward, one), -one.chi2) > (is_plausible(bench.forward, other), -other.chi2)


PER_NUMBER = 2.0  # chi2 that each further free number must gain (Akaike): the 70 of an edge gain 70 by chance
SAME_END = 0.5  # chi2 by which two ends of one fit may differ along a valley that readings hardly bound
FRONT = 12.0  # chi2 behind the best effect, or the least that counts: further behind, no exact end is needed
HORIZON = 20.0  # steps as good as the next that a fit behind others is given
BEHIND = 0.3  # share of the best score so far; a valley is slow where it bends, and what is ahead now may lose
SAME_POINT = 0.02  # of a number, or its scale: two fits of an effect so near each other go the same way
FEWEST_STEPS = 2  # that every fit is given


@dataclass(frozen=True)
class Race:
    """Fits of several effects beside a set that fits with ``chi2``, each from several starts: which go on.

    owners: the effect of every fit; penalties: chi2 that every effect must gain.
    """

    chi2: float
    owners: Sequence[str]
    penalties: Mapping[str, float]

    def find_hopeless(self, refits: Sequence[Refit]) -> list[Refit]:
        """Each refit that has met a better one of its effect, or would be far behind the front of all even after
        HORIZON more steps as good as the next.
        """
        least = BEHIND * (self.front([refit.fit for refit in refits])[1] + FRONT) - FRONT
        hopeless: list[Refit] = []
        better: list[tuple[str, np.ndarray]] = []
        for name, refit in sorted(zip(self.owners, refits, strict=True), key=lambda pair: pair[1].fit.chi2):
            if not refit.settled and refit.is_ready and refit.steps >= FEWEST_STEPS:
                # a step that failed made the next ones short
                reach = refit.fit.chi2 - max(HORIZON * refit.predicted_gain(), refit.predicted_gain(radius=np.inf))
                same = [v for n, v in better if n == name]
                met = any(np.allclose(refit.fit.vector, v, rtol=SAME_POINT, atol=SAME_POINT) for v in same)
                if met or self.score(name, reach) < least:
                    hopeless.append(refit)
            better.append((name, refit.fit.vector))
        return hopeless

    def front(self, fits: Sequence[Fit]) -> tuple[dict[str, float], float]:
        """The best chi2 of every effect, and the score below which none is near the front."""
        best: dict[str, float] = {}
        for name, fit in zip(self.owners, fits, strict=True):
            best[name] = min(fit.chi2, best.get(name, np.inf))
        return best, max([0.0, *(self.score(n, c) for n, c in best.items())]) - FRONT

    def score(self, name: str, chi2: float) -> float:
        """The penalised gain."""
        return self.chi2 - chi2 - self.penalties[name]


# Pairs of effects, all at once in the linear range: where a third effect looks like the sum of two, a search that adds
# one effect after the other takes the third and never sees the two.
#
# Columns at null say little of a nonlinear effect (a guide that touches from some gap on). One that was fitted by
# itself is known where it then stands, and so is what each of the others would add there.

NUMBERS_IN_PAIRS = 4  # numbers of an effect, at most; one with more (a free edge profile) looks like no sum of others
NESTING = 1.0  # chi2, by which a pair must be ahead of its members
ALIKE_PAIRS = 1e-9  # of the largest eigenvalue of columns of unit length: those below are sums of the others


def leading_pairs(
    shapes: Mapping[str, np.ndarray], residual: np.ndarray, penalty: float, count: int, known: Mapping[frozenset, float]
) -> list[Names]:
    """At most ``count`` pairs of effects that promise more than any effect alone, best first.

    shapes: effect -> whitened shapes (k, N); residual (N,); penalty: chi2 that each effect must gain; known: gains of
    nonlinear effects, and of pairs with one of them, where that effect was fitted.
    """
    gains = linear_gains(shapes, residual)
    scores = {ids: max(gain, known.get(frozenset(ids), 0.0)) - penalty * len(ids) for ids, gain in gains.items()}
    alone = max((s for ids, s in scores.items() if len(ids) == 1), default=-np.inf)
    ahead: list[Names] = [ids for ids, score in scores.items() if len(ids) == 2 and score > alone + NESTING]
    return sorted(ahead, key=lambda ids: -scores[ids])[:count]


def linear_gains(shapes: Mapping[str, np.ndarray], residual: np.ndarray) -> dict[Names, float]:
    """chi2 that every effect of NUMBERS_IN_PAIRS numbers, and every pair, takes of a residual (N,) in the linear range;
    shapes: effect -> whitened shapes (k, N).
    """
    few = {n: rows for n, rows in shapes.items() if 0 < len(rows) <= NUMBERS_IN_PAIRS}
    rows = np.concatenate([np.empty((0, len(residual))), *few.values()])
    unit = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    gram, moments, ends = unit @ unit.T, unit @ residual, np.cumsum([0, *map(len, few.values())])
    places = {n: np.arange(*pair) for n, pair in zip(few, pairwise(ends), strict=True)}
    gains: dict[Names, float] = {}
    for ids in [*((n,) for n in few), *combinations(few, 2)]:
        own = np.concatenate([places[i] for i in ids])
        inverse = np.linalg.pinv(gram[np.ix_(own, own)], rcond=ALIKE_PAIRS, hermitian=True)
        gains[ids] = float(moments[own] @ inverse @ moments[own])
    return gains


# Best-first search over joint fits of sets of effects.
#
# The search adds every other candidate to the likeliest set, then tries others in the place of each of its members. Its
# state is one value, ``Search``; every step returns a new one.


SEARCH_ROUNDS = 8
PROMISING_PAIRS = 3  # that are fitted because they promise more together than any effect alone
MAX_EFFECTS = 4
NUISANCE_MOVES = 3  # more, at most, until nuisances are where the fit at them puts them
UNMOVED = 1.0  # squared distance of two fits [sigma^2], below which readings hardly tell them apart
RISE = 1.0  # chi2, by which a larger set may fit worse than a smaller one, by rounding and the end of a fit
NO_EFFECTS: Ids = frozenset()


@dataclass(frozen=True, kw_only=True)
class Search:
    """All that is fitted on one workbench.

    reference: the set at whose fit the workbench takes noise levels and settings; linearisation: about the fit of no
    effect where the search began; inflation: as in ``EvidenceTable``; fits: set -> its best joint fit; starts: set ->
    where a fit may begin (fits that were not carried to their end, and all that was fitted on an earlier workbench);
    extended: sets to which every other candidate was added; singles: candidate -> its fit by itself, once all were
    added to the empty set.
    """

    bench: Workbench
    linearisation: Linearisation
    inflation: float = 1.0
    reference: Ids = NO_EFFECTS
    fits: Mapping[Ids, Fit] = field(default_factory=dict)
    starts: Mapping[Ids, Fit] = field(default_factory=dict)
    extended: frozenset[Ids] = frozenset()
    singles: Mapping[str, Fit] = field(default_factory=dict)

    @property
    def names(self) -> Names:
        """All candidates."""
        return tuple(c.id for c in self.bench.forward.classes)

    @property
    def penalty(self) -> float:
        """The chi2 that one effect must gain: one size, one of so many candidates."""
        return 2.0 * float(np.log(max(len(self.names), 1))) + 4.0


def run_search(search: Search) -> Search:
    """Grow the likeliest set, then look in the place of each of its members, until nothing is likelier.

    Sets are compared on one workbench: noise levels, and with them what a gain counts, differ on others.
    """
    # joint fits of pairs that promise more in the linear range than any effect alone
    search = extend(search, ())
    whiten, near, nothing = search.bench.metric.whiten, search.linearisation, search.fits[NO_EFFECTS]
    shapes = {n: whiten(near.shapes_of(search.bench, n)) for n in search.names}
    gains: dict[Ids, float] = {}  # where columns at null say little
    for name, fit in search.singles.items():
        own = max(nothing.chi2 - fit.chi2, 0.0)
        if own > search.penalty and name in near.starts:
            gains[frozenset([name])], taken = own, basis(fit.columns)
            for other, rows in ((n, rows) for n, rows in shapes.items() if n != name):  # its own numbers refitted
                span = np.concatenate([taken, basis(rows - (rows @ taken.T) @ taken)])
                gains[frozenset([name, other])] = own + float(np.sum((span @ fit.residual) ** 2))
    search = add_fits(search, leading_pairs(shapes, nothing.residual, search.penalty, PROMISING_PAIRS, gains))

    for _ in range(SEARCH_ROUNDS):
        best = _likeliest(search)
        ids = search.fits[best].ids
        if best != search.reference:
            subsets = [part for k in range(len(ids) + 1) for part in combinations(ids, k)]
            search = add_fits(move_to(search, ids), subsets)
        if len(best) < MAX_EFFECTS:
            search = extend(search, ids)
        if _likeliest(search) == best:
            for name in ids:
                search = extend(search, tuple(i for i in ids if i != name))
            if _likeliest(search) == best:
                break
    return search


def _likeliest(search: Search) -> Ids:
    """The likeliest set of those that are fitted."""
    return frozenset(explanations(tabulate(search, checked=False), POLICY)[0].effects)


def add_fits(search: Search, sets: Sequence[Names]) -> Search:
    """The search with joint fits of ``sets``."""
    new = {frozenset(ids): ids for ids in sets if frozenset(ids) not in search.fits}
    bench, latest, begun = search.bench, {**search.starts, **search.fits}, list[tuple[Ids, Fit]]()
    for key, ids in new.items():
        # where a set stood, and where the best larger one has its effects, which may add nothing to them; or else null,
        # and where each of them stood by itself: a gap or a place that is off by far keeps a refit from the best point
        if key in search.starts:
            larger = sorted((f for k, f in search.fits.items() if key and k > key), key=lambda f: f.chi2)[:1]
            starts = [search.starts[key], *(start_from(bench, ids, dict.fromkeys(ids, f)) for f in larger)]
        elif larger := [f for k, f in search.starts.items() if k > key]:
            starts = [start_from(bench, ids, dict.fromkeys(ids, larger[-1]))]
        else:
            single = {n: latest[frozenset([n])] for n in ids if frozenset([n]) in latest}
            alone = [start_from(bench, ids, single)] if len(ids) > 1 and single else []
            starts = [start_from(bench, ids, {}), *alone]
        begun += [(key, start) for start in starts]
    best: dict[Ids, Fit] = {}
    for (key, _), fit in zip(begun, search.bench.fit([start for _, start in begun]), strict=True):
        if key not in best or (fit.is_converged, -fit.chi2) > (best[key].is_converged, -best[key].chi2):
            best[key] = fit
    plausible = prefer_plausible(search.bench, list(best.values()))
    return _nest(replace(search, fits={**search.fits, **dict(zip(best, plausible, strict=True))}))


def _nest(search: Search) -> Search:
    """The search with every set that fits worse than one of its subsets refitted from the best of these, the numbers of
    its other effects at null: a fit on an earlier workbench may lie beyond a ridge, from which no step leads back."""
    fits = dict(search.fits)
    for size in sorted({len(key) for key in fits}):
        begun = dict[Ids, Fit]()
        for key in (k for k in fits if len(k) == size):
            part = min((f for k, f in fits.items() if k < key), key=lambda f: f.chi2, default=fits[key])
            if not fits[key].chi2 <= part.chi2 + RISE:
                begun[key] = start_from(search.bench, fits[key].ids, dict.fromkeys(part.ids, part))
        refits = prefer_plausible(search.bench, search.bench.fit([*begun.values()])) if begun else []
        fits |= {key: fit for key, fit in zip(begun, refits, strict=True) if not fits[key].chi2 <= fit.chi2}
    return replace(search, fits=fits)


def start_from(bench: Workbench, ids: Names, fits: Mapping[str, Fit]) -> Fit:
    """A fit of ``ids`` to begin at null, with the numbers of some effects as other fits have them."""
    vector = bench.forward.null()
    for name, fit in fits.items():
        positions = bench.forward.index(name)
        vector[positions] = fit.vector[positions]
    return bench.start(ids, vector)


def extend(search: Search, ids: Names) -> Search:
    """The search with every other candidate added to the set ``ids``."""
    key = frozenset(ids)
    if key in search.extended:
        return search
    search = add_fits(search, [ids])
    current, latest = search.fits[key], {**search.starts, **search.fits}
    others = [n for n in search.names if n not in key]
    linearisation = search.linearisation
    if current is not linearisation.fit:
        linearisation = linearise_effects(search.bench, current, others, linearisation)
    earlier = {n: f for own, f in latest.items() for n in others if n in own}
    earlier |= {n: latest[key | {n}] for n in others if key | {n} in latest}  # rather than beside other effects
    screened = screen(search.bench, linearisation, others, search.penalty, earlier)
    # those that are converged, and better than what was known, are fits of their sets
    fits, starts, singles = dict(search.fits), dict(search.starts), dict(search.singles)
    for name, screened_fit in screened.items():
        fit, larger = screened_fit, frozenset(screened_fit.ids)
        if larger in fits and is_better(search.bench, fits[larger], fit):
            fit = fits[larger]
        elif fit.is_converged:
            fits[larger] = fit
        elif fit.settled or fit.steps:  # one that ran out of rounds is nearer than null is
            starts[larger] = fit
        if key == NO_EFFECTS:
            singles[name] = fit
    return _nest(replace(search, fits=fits, starts=starts, extended=search.extended | {key}, singles=singles))


def move_to(search: Search, ids: Names) -> Search:
    """The search with nuisances and noise levels taken at the fit of a set, which is another there: until it stays.

    What was fitted before says only where to begin: chi2 and whitened columns are not known on another workbench.
    """
    search = add_fits(search, [ids])
    fit = search.fits[frozenset(ids)]
    for move in range(NUISANCE_MOVES + 1):
        if move:
            search = add_fits(search, [(), ids])
            before, fit = fit, search.fits[frozenset(ids)]
            apart = (fit.vector - before.vector)[fit.free] @ fit.columns
            if apart @ apart < UNMOVED:
                break
        earlier = {key: f for key, f in search.starts.items() if key not in search.fits}
        earlier |= {key: f for key, f in search.fits.items() if np.isfinite(f.chi2)}
        none = np.empty((0, 0))
        starts = {k: replace(f, chi2=np.inf, columns=none, exact=False, settled=False) for k, f in earlier.items()}
        search = replace(
            search, bench=search.bench.moved_to(fit.vector), reference=frozenset(fit.ids),
            starts=starts, fits={}, extended=frozenset(), singles={},
        )  # fmt: skip
    return search


def tabulate(search: Search, checked: bool = True) -> EvidenceTable:
    """All that is fitted as a table of evidence; checked: with what is predicted of left-out conditions."""
    rows = tuple(row_of(search.bench, f, checked) for f in search.fits.values() if np.isfinite(f.chi2))
    return EvidenceTable(candidates=len(search.names), inflation=search.inflation, damaged=False, rows=rows)


def row_of(bench: Workbench, fit: Fit, checked: bool) -> Row:
    """A joint fit as a row of the table of evidence; checked: with what it predicts of left-out conditions."""
    slots = [bench.forward.slots[k] for k in fit.free]
    columns = fit.columns.reshape(len(slots), len(fit.residual))
    left_out = held_out(bench, fit) if checked else {}
    _, sigma, away = prior_of_fit(bench, fit)
    scanned = {position: len(values) for name in fit.ids for position, values in bench.forward.grids(name).items()}
    if any(s.effect.comes_round for s in slots):  # of how many places the start of every run was chosen, where it was
        length = float(np.max(bench.samples.cases.rig.belt_length))
        turned = [max(1, round(length / (EVEN * r.start_u))) for r in bench.samples.runs if r.start_u > 0.0]
    else:
        turned = []
    kept = [k for k, position in enumerate(fit.free) if position not in scanned]
    sized = np.array([not (s.parameter.modifier or s.effect.is_additive()) for s in slots], dtype=bool)
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
