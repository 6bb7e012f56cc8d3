"""Best-first search over joint fits of sets of effects.

The search adds every other candidate to the likeliest set, then tries others in the place of each of its members. Its
state is one value, ``Search``; every step returns a new one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from belt_sim.diagnosis.decision.decide import explanations
from belt_sim.diagnosis.decision.policy import POLICY
from belt_sim.diagnosis.decision.table import EvidenceTable, Ids, Row
from belt_sim.diagnosis.fits.belt_starts import places_tried
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import held_out, prior_of_fit
from belt_sim.diagnosis.fits.linearisation import Linearisation, linearise
from belt_sim.diagnosis.fits.plausibility import is_plausible, prefer_plausible
from belt_sim.diagnosis.fits.screening import Names, is_better, leading_pairs, marginal_gains, screen
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.errors import FitError

ROUNDS = 8
PAIRS = 3  # that are fitted because they promise more together than any effect alone
MAX_EFFECTS = 4
MOVES = 3  # more, at most, until nuisances are where the fit at them puts them
UNMOVED = 1.0  # squared distance of two fits [sigma^2], below which readings hardly tell them apart
RISE = 1.0  # chi2, by which a larger set may fit worse than a smaller one, by rounding and the end of a fit
NOTHING: Ids = frozenset()


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
    reference: Ids = NOTHING
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

    @property
    def latest(self) -> dict[Ids, Fit]:
        """Set -> its fit, or else where one may begin."""
        return {**self.starts, **self.fits}

    def single_gain(self, name: str) -> float:
        """The chi2 that a candidate gains by itself."""
        return max(self.fits[NOTHING].chi2 - self.singles[name].chi2, 0.0)


def begin_search(bench: Workbench, linearisation: Linearisation, inflation: float) -> Search:
    """The search with no effect fitted but none."""
    fits = {NOTHING: linearisation.fit}
    return Search(bench=bench, linearisation=linearisation, inflation=inflation, fits=fits)


def run_search(search: Search) -> Search:
    """Grow the likeliest set, then look in the place of each of its members, until nothing is likelier.

    Sets are compared on one workbench: noise levels, and with them what a gain counts, differ on others.
    """
    search = add_pairs(search, PAIRS)
    for _ in range(ROUNDS):
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
    begun = [(key, start) for key, ids in new.items() for start in _starts_of(search, ids)]
    best: dict[Ids, Fit] = {}
    for (key, _), fit in zip(begun, search.bench.fit([start for _, start in begun]), strict=True):
        if key not in best or (fit.is_converged, -fit.chi2) > (best[key].is_converged, -best[key].chi2):
            best[key] = fit
    plausible = prefer_plausible(search.bench, list(best.values()))
    return replace(search, fits={**search.fits, **dict(zip(best, plausible, strict=True))})


def _starts_of(search: Search, ids: Names) -> list[Fit]:
    """Where a set begins: where it stood, and where the best larger one has its effects, which may add nothing to them;
    or else at null, and where each of them stood by itself: a gap or a place that is off by far keeps a refit from the
    best point.
    """
    key, bench = frozenset(ids), search.bench
    if key in search.starts:
        larger = sorted((f for k, f in search.fits.items() if key and k > key), key=lambda f: f.chi2)[:1]
        return [search.starts[key], *(_start_from(bench, ids, dict.fromkeys(ids, f)) for f in larger)]
    larger = [f for k, f in search.starts.items() if k > key]
    if larger:
        return [_start_from(bench, ids, dict.fromkeys(ids, larger[-1]))]
    latest = search.latest
    single = {n: latest[frozenset([n])] for n in ids if frozenset([n]) in latest}
    alone = [_start_from(bench, ids, single)] if len(ids) > 1 and single else []
    return [_start_from(bench, ids, {}), *alone]


def _start_from(bench: Workbench, ids: Names, fits: Mapping[str, Fit]) -> Fit:
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
    current, latest = search.fits[key], search.latest
    others = [n for n in search.names if n not in key]
    linearisation = search.linearisation
    if current is not linearisation.fit:
        linearisation = linearise(search.bench, current, others, linearisation)
    earlier = {n: f for own, f in latest.items() for n in others if n in own}
    earlier |= {n: latest[key | {n}] for n in others if key | {n} in latest}  # rather than beside other effects
    return keep_screened(search, key, screen(search.bench, linearisation, others, search.penalty, earlier))


def keep_screened(search: Search, key: Ids, screened: Mapping[str, Fit]) -> Search:
    """The search after fits of the set ``key`` and one more effect each, by name: those that are converged, and better
    than what was known, are fits of their sets.

    Raises FitError where one fits worse than the set alone.
    """
    fits, starts, singles = dict(search.fits), dict(search.starts), dict(search.singles)
    for name, screened_fit in screened.items():
        fit, larger = screened_fit, frozenset(screened_fit.ids)
        if larger in fits and is_better(search.bench, fits[larger], fit):
            fit = fits[larger]
        elif fit.is_converged:
            fits[larger] = fit
        elif fit.settled or fit.steps:  # one that ran out of rounds is nearer than null is
            starts[larger] = fit
        gain = search.fits[key].chi2 - fit.chi2
        if gain < -RISE:
            raise FitError(f"refit of {name} beside {sorted(key)}: chi2 rose by {-gain:.3g}; the optimiser failed")
        if key == NOTHING:
            singles[name] = fit
    return replace(search, fits=fits, starts=starts, extended=search.extended | {key}, singles=singles)


def add_pairs(search: Search, count: int) -> Search:
    """The search with joint fits of at most ``count`` pairs that promise more in the linear range than any effect
    alone."""
    search = extend(search, ())
    whiten, near = search.bench.metric.whiten, search.linearisation
    shapes = {n: whiten(near.shapes_of(search.bench, n)) for n in search.names}
    gains: dict[Ids, float] = {}  # where columns at null say little
    for name, fit in search.singles.items():
        own = search.single_gain(name)
        if own > search.penalty and name in near.starts:
            more = marginal_gains(fit, {n: s for n, s in shapes.items() if n != name})
            gains |= {frozenset([name]): own}
            gains |= {frozenset([name, n]): own + gain for n, gain in more.items()}
    residual = search.fits[NOTHING].residual
    return add_fits(search, leading_pairs(shapes, residual, search.penalty, count, gains))


def move_to(search: Search, ids: Names) -> Search:
    """The search with nuisances and noise levels taken at the fit of a set, which is another there: until it stays."""
    search = add_fits(search, [ids])
    fit = search.fits[frozenset(ids)]
    search = _lay_out_at(search, fit)
    for _ in range(MOVES):
        search = add_fits(search, [ids])
        before, fit = fit, search.fits[frozenset(ids)]
        apart = (fit.vector - before.vector)[fit.free] @ fit.columns
        if apart @ apart < UNMOVED:
            break
        search = _lay_out_at(search, fit)
    return search


def _lay_out_at(search: Search, fit: Fit) -> Search:
    """The search with the workbench moved to a fit; all that was fitted says only where to begin there."""
    bench = search.bench.moved_to(fit.vector)
    earlier = {key: f for key, f in search.starts.items() if key not in search.fits}
    earlier |= {key: f for key, f in search.fits.items() if np.isfinite(f.chi2)}
    starts = {key: f.as_start() for key, f in earlier.items()}
    return replace(
        search, bench=bench, reference=frozenset(fit.ids), starts=starts, fits={}, extended=frozenset(), singles={}
    )


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
