"""One law against several known effects: the single generic law that explains most, put into the march.

Where several effects of the library together imitate one that it has not, one law at one place does as well as all of
them (Occam). The best of so many laws gets ahead of one effect by chance as well, where that is right: how far is told
by campaigns in which it is at work.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from belt_sim.diagnosis.left_over.unknown import OneLaw, Together
from belt_sim.discovery.choose import of_one_term, unlike
from belt_sim.discovery.gate import errors_by_chance
from belt_sim.discovery.refit import Refit, refits
from belt_sim.discovery.rounds import Loop
from belt_sim.discovery.search import Scored, cost, distinct, exponents_of, of_every_form, prices, refined, singles
from belt_sim.discovery.survey import Survey
from belt_sim.discovery.words import formula

REFINED = 8  # laws whose shape numbers are fitted
TRIES = 2  # laws put into the march
PROMISE = 0.75  # share of a gain that a law has to promise in the linear range: a law of the state gains in the march


def one_law(survey: Survey, least: float, *, closely: bool = False) -> OneLaw | None:
    """The single law that explains most; None where none promises a chi2 of ``least`` beyond its price.

    closely: it is sought in closed loop, as laws are of which somebody asks what they say.
    """
    survey = replace(survey, wide=closely)
    read = survey.informed(survey.courses()[0])
    ones = singles(read)
    searched = 2.0 * float(np.log(len(ones) / len(exponents_of(survey))))
    first = in_closed_loop(survey, read) if closely else at_first_order(read, ones)
    best = _best(survey if closely else read, [s for s in first if s.score - searched > PROMISE * least])
    if best is None:
        return None
    law = best.scored.law
    words = f"{law.terms[0].place.words}: {formula(law)}"
    return OneLaw(words, best.fit.values, cost(law), searched)


def together(survey: Survey) -> Together | None:
    """The law that explains most beside the effects of a survey, in the march with them, and there by itself."""
    read = survey.informed(survey.courses()[0])
    best = _best(survey, in_closed_loop(survey, read))
    if best is None:
        return None
    own = best.bench.forward.index(best.written.cls.id)
    vector = best.bench.forward.null()
    vector[own] = best.fit.vector[own]
    begin = best.bench.start((best.written.cls.id,), vector, [p for p in best.fit.free if p in own])
    return Together(best.bench, best.bench.fit([begin])[0], best.fit)


def _best(survey: Survey, laws: Sequence[Scored]) -> Refit | None:
    """The law that is worth most in the march; None where the belt runs away with all."""
    return max((r for r in refits(survey, laws) if r is not None), key=lambda r: r.worth, default=None)


def at_first_order(read: Survey, ones: Iterable[Scored]) -> list[Scored]:
    """The first of laws that read states as the data show them."""
    return sorted((refined(read, s) for s in distinct(ones, REFINED)), key=lambda s: -s.score)[:TRIES]


def in_closed_loop(survey: Survey, read: Survey) -> list[Scored]:
    """The first of laws that change what they read, and do different things to the readings.

    At first order many of those that lead do the same, and one that changes what it reads by much is far behind.
    """
    return [c.scored for c in unlike(survey, of_one_term(Loop(survey), read), TRIES)]


def lead_by_chance(survey: Survey, beside: Survey, *, draws: int, seed: int) -> np.ndarray:
    """How much more chi2 than effects that are right the best law alone explains by chance, its numbers paid, (draws,).

    survey: beside the base model, with the states that the effects make; beside: beside the effects.
    """
    errors = errors_by_chance(beside, draws, np.random.default_rng(seed))
    whole = errors + (survey.ground.residual - beside.ground.residual)
    best = np.full(draws, -np.inf)
    for p, n, gain in of_every_form(survey, whole):
        best = np.maximum(best, np.max(gain - prices(p.forms, n)[:, None], axis=0))
    return best - (survey.ground.left_of_each(whole) - beside.ground.left_of_each(errors))
