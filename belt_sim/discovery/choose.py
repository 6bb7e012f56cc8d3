"""The choice of a law: singles, then pairs that earn their second term; what cannot be told apart; how stable it is.

Candidates come from projected gains, with the states of the base model and with those that the data show; they are
judged in closed loop.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from belt_sim.discovery.evidence import Course
from belt_sim.discovery.forms import SHAPED, STATED, limit_of
from belt_sim.discovery.loop import Closed, closed, states_with
from belt_sim.discovery.places import place_columns
from belt_sim.discovery.rounds import Loop
from belt_sim.discovery.search import (
    WITHIN,
    Scored,
    cost,
    distinct,
    exponents_of,
    fitted,
    gain_of,
    pairs,
    refined,
    singles,
)
from belt_sim.discovery.survey import Survey
from belt_sim.effects.law_terms import BY_THE_BELT, STIFFNESS, Law, Place, Term

SINGLES, PAIRS, FIRSTS, ALIKE = 20, 8, 5, 8
PLACES, FORMS = (8, 2), 4  # the likeliest places, first many and then few, and other forms that are tried there
BENT = 2  # laws with a knee, of which both slopes are tried
ONE = 0.998  # cosine of readings that are the same
POLISHED, POLISH = 6, 30  # laws that are fitted to the end, steps
MODELLED = 0.02  # of a gain, to which linear columns can be trusted
AGAIN = 400  # imagined repetitions of the campaign


@dataclass(frozen=True)
class Choice:
    """best: the law with the best score; simple: the best of one term; judged: all laws in closed loop, best first.

    frequency: how often it comes first when all is measured again; possible: chi2 that a free course explains.
    """

    best: Scored
    judged: tuple[Scored, ...]
    frequency: float
    simple: Scored
    possible: float


def choose(survey: Survey, course: Course) -> Choice:
    """The law that explains most for its numbers, beside a course of the unknown that says what the states were."""
    survey = replace(survey, wide=True)
    loop, read = Loop(survey), survey.informed(course)
    ones = of_one_term(loop, read)
    possible = explained(survey, course)
    firsts = unlike(survey, ones, FIRSTS) if ones[0].gain < possible else []
    beside = [(replace(survey, states=states_with(loop, c)), c.scored) for c in firsts]
    seconds = [(s, distinct(pairs(s, [one]), PAIRS)) for s, one in beside]
    everything = _merged(ones, _judged(loop, seconds))
    more = [closed(loop, c.law, c.sizes, POLISH) for c in everything[:POLISHED]]
    everything = _merged(everything, [*(c for c in more if c is not None), *(bent(loop, ones) if firsts else [])])
    leading = {c.law.family: c for c in (everything[0], _simple(everything))}  # in the march the second may win
    for made in leading.values():
        everything = _merged(everything, _judged(loop, _alike(survey, made)))
    best = everything[0]
    close = WITHIN + MODELLED * best.gain
    rivals = [c for c in everything[1:] if c.score > best.score - close and len(c.law.terms) <= len(best.law.terms)]
    frequency = _frequency(survey, [best, *rivals])
    return Choice(best.scored, tuple(c.scored for c in everything), frequency, _simple(everything).scored, possible)


def _simple(laws: Sequence[Closed]) -> Closed:
    """The first of ``laws`` with one term."""
    return next(c for c in laws if len(c.law.terms) == 1)


def of_one_term(loop: Loop, read: Survey) -> list[Closed]:
    """Laws of one term in closed loop, best first; read: the survey with states as the data show them."""
    ones = _judged(loop, [(s, distinct(singles(s), SINGLES)) for s in (loop.survey, read)])
    for places in PLACES:
        ones = _merged(ones, _judged(loop, _otherwise(loop, ones, places)))
    return ones


def bent(loop: Loop, ones: Sequence[Closed]) -> list[Closed]:
    """The first of laws of one term with a knee, at different places, with a slope of its own on either side of it.

    What acts beyond a knee only has no slope below, and what saturates none above. Such a law lacks nothing that a
    second term beside it would bring: with the slope of one side free, the other is another too.
    """
    first: dict[str, Closed] = {}
    for c in ones:
        if c.law.terms[0].form.shape in SHAPED:
            first.setdefault(c.law.terms[0].place.name, c)
    made = [closed(loop, *_both_slopes(c), POLISH) for c in list(first.values())[:BENT]]
    return [c for c in made if c is not None]


def _both_slopes(one: Closed) -> tuple[Law, np.ndarray]:
    """A law of one term as a straight one and one that saturates, and their sizes."""
    term, size = one.law.terms[0], float(one.sizes[0])
    straight = replace(term.form, shape="linear", knee=None)
    law = Law(tuple(replace(term, form=f) for f in (straight, replace(term.form, shape="saturation"))))
    return law, np.array([size, -size] if term.form.shape == "dead_zone" else [0.0, size])


def _judged(loop: Loop, tried: Iterable[tuple[Survey, Sequence[Scored]]]) -> list[Closed]:
    """Candidates, each with the survey that suggests it, in closed loop; of those that say the same the best."""
    found: dict[tuple, Closed] = {}
    for survey, many in tried:
        for one in many:
            fine = refined(survey, one)
            _, sizes, _ = fitted(survey, survey.columns(fine.law))
            made = closed(loop, fine.law, sizes)
            if made is not None and (plain := _plain(survey, made.law)) != made.law:
                made = closed(loop, plain, made.sizes)
            if made is not None and (made.law.family not in found or made.score > found[made.law.family].score):
                found[made.law.family] = made
    return sorted(found.values(), key=lambda c: -c.score)


def _plain(survey: Survey, law: Law) -> Law:
    """A law without the numbers that have run out of range."""
    end, cell = survey.states.s[-1], survey.states.s[1]
    paces = [float(np.min(survey.states.speed)) if t.form.timed else 1.0 for t in law.terms]
    forms = [limit_of(t.form, float(end / pace), float(cell / pace)) for t, pace in zip(law.terms, paces, strict=True)]
    return Law(tuple(replace(t, form=form or t.form) for t, form in zip(law.terms, forms, strict=True)))


def unlike(survey: Survey, laws: Sequence[Closed], count: int) -> list[Closed]:
    """The first of ``laws`` that do different things to the readings."""
    some = list(laws[: 4 * count])
    gram = _against(survey, np.stack([c.readings for c in some]))
    size = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    kept: list[int] = []
    for k in range(len(some)):
        if all(abs(gram[k, j]) < ONE * size[k] * size[j] for j in kept):
            kept.append(k)
    return [some[k] for k in kept[:count]]


def _merged(some: Sequence[Closed], more: Sequence[Closed]) -> list[Closed]:
    """All of both, best first, of those that say the same the best."""
    found: dict[tuple, Closed] = {}
    for c in (*some, *more):
        if c.law.family not in found or c.score > found[c.law.family].score:
            found[c.law.family] = c
    return sorted(found.values(), key=lambda c: -c.score)


def _otherwise(loop: Loop, laws: Sequence[Closed], count: int) -> list[tuple[Survey, list[Scored]]]:
    """Other forms at the first ``count`` places of ``laws``, with the states that those laws make: a law that describes
    the readings says what the true one reads, even where its form is another and the base model's states are far off.
    """
    first: dict[str, Closed] = {}
    for c in laws:
        first.setdefault(c.law.terms[0].place.name, c)
    at_work = [
        replace(loop.survey, states=states_with(loop, c), places=(c.law.terms[0].place,))
        for c in list(first.values())[:count]
    ]
    return [(s, distinct(singles(s), FORMS)) for s in at_work]


def _alike(survey: Survey, best: Closed) -> list[tuple[Survey, list[Scored]]]:
    """What may say the same as a law: one of its terms at other places; all of them, where they share one."""
    at_work, found, terms = replace(survey, states=best.states), list[Scored](), best.law.terms
    moved = [_elsewhere(survey, terms, (k,)) for k in range(len(terms))]
    if len(terms) > 1 and len({t.place.name for t in terms}) == 1:
        moved.append(_elsewhere(survey, terms, range(len(terms))))
    for laws in moved:
        scored = [Scored(law, g, g - cost(law)) for law in laws for g in (gain_of(at_work, law),)]
        found += distinct(sorted(scored, key=lambda s: -s.score), ALIKE)
    return [(at_work, found)]


def _elsewhere(survey: Survey, terms: Sequence[Term], which: Collection[int]) -> list[Law]:
    """Laws with those of the ``terms`` that are asked for at one other place, going with the tension in any way."""
    old, steady = terms[min(which)].place, {terms[k].form.variable for k in which} <= {"none", "yaw_set"}
    carried = all(terms[k].form.carried for k in which)
    return [
        Law(tuple(Term(place, t.form, n) if k in which else t for k, t in enumerate(terms)))
        for place in survey.tried
        if place.name != old.name and (place.kind == "sensor") == (old.kind == "sensor")
        for n in exponents_of(survey)
        if _said_of(place, steady, carried)
    ]


def _said_of(place: Place, steady: bool, carried: bool) -> bool:
    """Whether a term may be of a place; carried: it goes round with the belt, so that both pulleys do not feel it
    alike."""
    if carried:
        return (steady and place.kind in STIFFNESS) or (place.kind in BY_THE_BELT and place.where != "both")
    return not place.carried and (steady or place.kind not in STATED)


def explained(survey: Survey, course: Course) -> float:
    """chi2 that the mean of a course explains."""
    g, u = survey.ground, course.inputs(survey.ops.grid)
    felt = [survey.states.felt(course.place, u, *part)[None] for part in course.place.parts]
    column = place_columns(survey.ops, course.place, felt)[0].astype(float)
    return g.left() - g.left(g.residual - column)


def _frequency(survey: Survey, laws: Sequence[Closed]) -> float:
    """How often the first of ``laws`` stays first under fresh noise, the data being as it says."""
    if len(laws) == 1:
        return 1.0
    rows = np.stack([c.readings for c in laws])
    along, prices = _against(survey, rows), np.array([cost(c.law) for c in laws])
    first = along[0]
    rng = np.random.default_rng(1)
    root = np.linalg.cholesky(along + 1e-6 * np.trace(along) / len(along) * np.eye(len(along)))
    noise = rng.standard_normal((AGAIN, len(laws))) @ root.T
    gains = 2.0 * (first + noise) - np.diag(along)
    return float(np.mean(np.argmax(gains - prices, axis=1) == 0))


def _against(survey: Survey, rows: np.ndarray) -> np.ndarray:
    """Products (k, k) of whitened rows (k, R, m) with what runs share taken out."""
    g = survey.ground
    onto = g.onto_shared(rows).sum(axis=1)
    return np.einsum("krm,lrm->kl", rows, rows) - onto @ g.inverse @ onto.T
