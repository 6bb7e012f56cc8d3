"""The table of a campaign: sets of named effects by best-first search, and what is seen beyond the library."""

from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from belt_sim.api.resolve import candidates_of, fitted_model
from belt_sim.campaign import Campaign, suspicions
from belt_sim.diagnosis.choice.decide import MAX_EFFECTS
from belt_sim.diagnosis.choice.refits import Refits
from belt_sim.diagnosis.errors.setting_up import set_up
from belt_sim.diagnosis.examine import _long_enough
from belt_sim.diagnosis.fits.around import Around, around
from belt_sim.diagnosis.fits.candidate import is_plausible, prior_sigma
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import _before, held_out
from belt_sim.diagnosis.fits.workbench import Workbench, workbench
from belt_sim.diagnosis.left_over.null import null_gains
from belt_sim.discovery.search import distinct, exponents_of, singles
from belt_sim.discovery.survey import survey_of
from belt_sim.discovery.words import formula
from studies.score.decide import scores
from studies.score.policy import Policy
from studies.score.table import Beyond, Ids, Law, Row, Table

DRAWS = 100  # of chance, for the inflation alone
BAND = 8.0  # nats behind the best, within which a set stands in the table
SETS = 16  # of them, at most
ROUNDS = 7  # of the search
LAWS = 12


def gather(campaign: Campaign, base: str, policy: Policy) -> Table:
    """The table of ``campaign`` for the model named ``base``."""
    model = fitted_model(base)
    classes = [c for c in candidates_of(None, model) if model.refusal(c) is None and _long_enough(campaign, c)]
    bench = workbench(campaign, model, classes)
    nothing = bench.fit([bench.start((), bench.forward.null())])[0]
    damaged = any(s.severity == "stop" for s in set_up(bench, nothing.values, suspicions(campaign)))
    names = [c.id for c in classes]
    near = around(bench, nothing, names)
    null = null_gains(
        bench, {n: near.shapes(bench, n) for n in names}, nothing.slopes, nothing.values, count=DRAWS, seed=1
    )
    inflation = max(1.0, float(np.mean([null.inflation(n) for n in names])))
    search = _Search(bench, near, nothing, len(names), inflation, policy)
    if damaged:
        return search.table(damaged=True)
    search.run()
    steadfast = frozenset(c.id for c in classes if c.is_additive())
    return replace(search.table(), beyond=search.beyond(), steadfast=steadfast)


@dataclass(frozen=True)
class _Screen:
    """What a candidate must promise to be refitted [chi2]: one size, one in so many candidates."""

    price: float

    def threshold(self, name: str, log_p: float) -> float:
        return self.price


class _Search:
    """Best first: beside the likeliest set every other candidate, then in the place of each of its members."""

    def __init__(
        self, bench: Workbench, near: Around, nothing: Fit, count: int, inflation: float, policy: Policy
    ) -> None:
        self.count, self.inflation, self.policy = count, inflation, policy
        chance: Any = None  # no held-out error is judged on the way
        screen: Any = _Screen(2.0 * float(np.log(count)) + 4.0)
        self.refits = Refits(bench, screen, 0.0, chance, near, fits={frozenset(): nothing})
        self.about: Ids = frozenset()
        self.seen: dict[Ids, tuple[tuple[str, ...], float]] = {frozenset(): ((), 0.0)}

    def run(self) -> None:
        """Grow the sets until the likeliest has been looked around."""
        done, current = set[Ids](), tuple[str, ...]()
        for number in range(ROUNDS):
            self.refits.trials(current)
            done.add(frozenset(current))
            pair = self.refits.pair([()]) if number == 0 else None
            if pair is not None:
                self.refits.fit(pair)
            best = self._likeliest()
            rest = [tuple(i for i in self.refits.fits[best].ids if i != name) for name in best]
            ahead = [] if best in done or len(best) >= MAX_EFFECTS else [self.refits.fits[best].ids]
            unseen = ahead or [r for r in rest if frozenset(r) not in {*done, *self.refits.tried}]
            if not unseen:
                break
            if ahead:
                self._move(best)
            current = unseen[0]
        self._move(self._likeliest())
        top = max(value for _, value in self.seen.values())
        near = sorted((v for v in self.seen.values() if v[1] > top - BAND), key=lambda v: -v[1])[:SETS]
        self.refits.gains([ids for ids, _ in near])

    def _likeliest(self) -> Ids:
        """The likeliest set about where the search stands."""
        found = {ids: value for (ids, _), value in scores(self.table(checked=False), self.policy).items()}
        self.seen |= {ids: (self.refits.fits[ids].ids, value) for ids, value in found.items()}
        return max(found, key=lambda ids: found[ids])

    def _move(self, best: Ids) -> None:
        """Take noise, settings and all subsets about a set."""
        if best != self.about:
            ids = self.refits.fits[best].ids
            self.refits, self.about = self.refits.moved(ids), best
            self.refits.gains([part for k in range(len(ids)) for part in combinations(ids, k)])

    def table(self, damaged: bool = False, checked: bool = True) -> Table:
        """All that is fitted, about where the search stands; checked: with what is held out."""
        fits = [f for f in self.refits.fits.values() if np.isfinite(f.chi2)]
        rows = tuple(_row(self.refits.bench, f, checked) for f in fits)
        return Table(candidates=self.count, inflation=self.inflation, damaged=damaged, rows=rows, beyond=())

    def beyond(self) -> tuple[Beyond, ...]:
        """What is seen beside nothing, beside the likeliest set, and beside that without one of its members."""
        ids = self.refits.fits[self.about].ids
        sets = dict.fromkeys([(), ids, *(tuple(i for i in ids if i != name) for name in ids)])
        return tuple(_beyond(self.refits.bench, self.refits.fit(s)) for s in sets)


def _row(bench: Workbench, fit: Fit, checked: bool) -> Row:
    slots = [bench.forward.slots[k] for k in fit.free]
    columns = fit.columns.reshape(len(slots), len(fit.residual))
    left_out = held_out(bench, fit).conditions if checked else {}
    null, sigma = bench.forward.null()[fit.free], prior_sigma(bench.forward, fit.free)
    harmonics = np.array([s.effect.is_additive() for s in slots], dtype=np.bool_)
    if harmonics.any():
        sigma = np.where(harmonics, _before(bench, fit)[1], sigma)
    for name in fit.ids:  # what is tried over a grid may be anywhere on it
        for position, values in bench.forward.grids(name).items():
            k = fit.free.index(position)
            null[k], sigma[k] = 0.5 * (min(values) + max(values)), np.ptp(values) / np.sqrt(12.0)
    return Row(
        ids=frozenset(fit.ids),
        chi2=float(fit.chi2),
        gram=columns @ columns.T,
        away=fit.vector[fit.free] - null,
        sigma=sigma,
        owner=tuple(s.effect.id for s in slots),
        sized=np.array([not s.effect.parameters[s.name].modifier for s in slots], dtype=bool) & ~harmonics,
        plausible=not slots or is_plausible(bench.forward, fit),
        held_out={n: c.surprise for n, c in left_out.items() if c.testable},
    )


def _beyond(bench: Workbench, fit: Fit) -> Beyond:
    survey = survey_of(bench, fit)
    ones = singles(survey)
    laws = tuple(
        Law(words=formula(s.law), gain=s.gain, cost=s.gain - s.score, sizes=1 + s.law.terms[0].form.waving)
        for s in distinct(ones, LAWS)
    )
    courses = np.array([c.gain for c in survey.courses()])
    tried = len(ones) / len(exponents_of(survey))
    return Beyond(beside=frozenset(fit.ids), courses=courses, laws=laws, tried=tried)
