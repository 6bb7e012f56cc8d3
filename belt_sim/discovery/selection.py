"""The choice of a law: laws of one term, then of two where the second earns its place; how stable the choice is.

Candidates come from the linear range, with the states of the base model and with those of the likeliest latent input.
They are fitted and compared in closed loop.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from belt_sim.discovery.closed_loop import (
    ClosedLoopFit,
    fit_closed_loop,
    states_of_fit,
    states_with_latent_input,
)
from belt_sim.discovery.form_dictionary import COURSES_ONLY, WITH_KNEE, simpler_form
from belt_sim.discovery.latent_input import LatentInput
from belt_sim.discovery.linear_search import (
    WITHIN,
    ScoredLaw,
    cost,
    distinct_families,
    exponents_of,
    gain_of,
    refine_numbers,
    single_term_laws,
    two_term_laws,
)
from belt_sim.discovery.search_data import SearchData
from belt_sim.effects.law import BY_THE_BELT, Form, Law, Place, Term

SINGLES, PAIRS, FIRSTS, ALIKE = 20, 8, 5, 8
PLACES, FORMS = (8, 2), 4  # the likeliest places, first many and then few, and other forms that are tried there
WITH_SLOPES = 2  # laws with a knee, of which both slopes are tried
SAME = 0.998  # cosine of readings that are the same
POLISHED, POLISH = 6, 30  # laws that are fitted to the end, steps
MODELLED = 0.02  # of a gain, to which linear columns can be trusted
REPETITIONS = 400  # of the campaign, simulated


@dataclass(frozen=True)
class LawChoice:
    """best: the law with the best score; simple: the best of one term; judged: all laws in closed loop, best first.

    frequency: how often it comes first when all is measured again; possible: chi2 that the latent input explains.
    """

    best: ScoredLaw
    judged: tuple[ScoredLaw, ...]
    frequency: float
    simple: ScoredLaw
    possible: float


def choose_law(data: SearchData, latent: LatentInput) -> LawChoice:
    """The law that explains most for its numbers; latent: the likeliest input, which says what the states were."""
    data = replace(data, wide=True)
    ones = one_term_laws(data, replace(data, states=states_with_latent_input(data, latent)))
    possible = latent_input_gain(data, latent)
    firsts = different_laws(data, ones, FIRSTS) if ones[0].gain < possible else []
    beside = [(replace(data, states=states_of_fit(data, c)), c.scored_law) for c in firsts]
    seconds = [(s, distinct_families(two_term_laws(s, [one]), PAIRS)) for s, one in beside]
    everything = _merge(ones, _fit_all(data, seconds))
    polished = [fit_closed_loop(data, c.law, c.sizes, POLISH) for c in everything[:POLISHED]]
    sloped = laws_with_both_slopes(data, ones) if firsts else []
    everything = _merge(everything, [*(c for c in polished if c is not None), *sloped])
    leading = (everything[0], _best_of_one_term(everything))  # in the march the second may win
    for made in {c.law.family: c for c in leading}.values():
        everything = _merge(everything, _fit_all(data, _other_places(data, made)))
    best = everything[0]
    close = WITHIN + MODELLED * best.gain
    rivals = [c for c in everything[1:] if c.score > best.score - close and len(c.law.terms) <= len(best.law.terms)]
    return LawChoice(
        best=best.scored_law,
        judged=tuple(c.scored_law for c in everything),
        frequency=_frequency(data, [best, *rivals]),
        simple=_best_of_one_term(everything).scored_law,
        possible=possible,
    )


def _best_of_one_term(laws: Sequence[ClosedLoopFit]) -> ClosedLoopFit:
    """The first of ``laws`` with one term."""
    return next(c for c in laws if len(c.law.terms) == 1)


def one_term_laws(data: SearchData, read: SearchData) -> list[ClosedLoopFit]:
    """Laws of one term in closed loop, best first; read: the data with the states of a latent input."""
    tried = [(s, distinct_families(single_term_laws(s), SINGLES)) for s in (data, read)]
    ones = _merge(_fit_all(data, [*tried, (data, steady_changes(data))]), ())
    for places in PLACES:
        ones = _merge(ones, _fit_all(data, _other_forms(data, ones, places)))
    return ones


def steady_changes(data: SearchData) -> list[ScoredLaw]:
    """A steady change of the tension and of each stiffness, without a score: to first order a large one looks like
    something else. Other forms are then tried at its place, with the states that it makes."""
    places = [place for place in data.places if place.relative and not place.is_stretch]
    return [ScoredLaw(Law((Term(place, Form("none")),)), 0.0, 0.0) for place in places]


def laws_with_both_slopes(data: SearchData, ones: Sequence[ClosedLoopFit]) -> list[ClosedLoopFit]:
    """The first of laws of one term with a knee, at different places, with a slope of its own on either side of it.

    What acts beyond a knee only has no slope below, and what saturates none above. Such a law lacks nothing that a
    second term beside it would bring: with the slope of one side free, the other is another too.
    """
    first: dict[str, ClosedLoopFit] = {}
    for c in ones:
        if c.law.terms[0].form.shape in WITH_KNEE:
            first.setdefault(c.law.terms[0].place.name, c)
    found = []
    for c in list(first.values())[:WITH_SLOPES]:  # a straight law and one that saturates
        term, size = c.law.terms[0], float(c.sizes[0])
        straight = replace(term.form, shape="linear", knee=None)
        law = Law(tuple(replace(term, form=f) for f in (straight, replace(term.form, shape="saturation"))))
        sizes = [size, -size] if term.form.shape == "dead_zone" else [0.0, size]
        found.append(fit_closed_loop(data, law, np.array(sizes), POLISH))
    return [c for c in found if c is not None]


def _fit_all(data: SearchData, tried: Iterable[tuple[SearchData, Sequence[ScoredLaw]]]) -> list[ClosedLoopFit]:
    """Candidates, each with the data that suggest it, in closed loop."""
    found: list[ClosedLoopFit] = []
    for read, many in tried:
        for one in many:
            fine = refine_numbers(read, one)
            _, sizes = read.projector.fit_sizes(read.columns(fine.law))
            made = fit_closed_loop(data, fine.law, sizes)
            if made is not None and (plain := _simplify(read, made.law)) != made.law:
                made = fit_closed_loop(data, plain, made.sizes)
            if made is not None:
                found.append(made)
    return found


def _simplify(data: SearchData, law: Law) -> Law:
    """A law without the numbers that have run out of range."""
    end, cell = data.states.s[-1], data.states.s[1]
    paces = [float(np.min(data.states.speed)) if t.form.timed else 1.0 for t in law.terms]
    forms = [
        simpler_form(t.form, float(end / pace), float(cell / pace)) for t, pace in zip(law.terms, paces, strict=True)
    ]
    terms = [replace(t, form=form or t.form) for t, form in zip(law.terms, forms, strict=True)]
    return Law(tuple(terms))


def different_laws(data: SearchData, laws: Sequence[ClosedLoopFit], count: int) -> list[ClosedLoopFit]:
    """The first of ``laws`` that do different things to the readings."""
    some = list(laws[: 4 * count])
    gram = data.projector.gram_of(np.stack([c.readings for c in some]))
    size = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    kept: list[int] = []
    for k in range(len(some)):
        if all(abs(gram[k, j]) < SAME * size[k] * size[j] for j in kept):
            kept.append(k)
    return [some[k] for k in kept[:count]]


def _merge(some: Sequence[ClosedLoopFit], more: Sequence[ClosedLoopFit]) -> list[ClosedLoopFit]:
    """The best of each family of both, best first."""
    found: dict[tuple, ClosedLoopFit] = {}
    for c in (*some, *more):
        if c.law.family not in found or c.score > found[c.law.family].score:
            found[c.law.family] = c
    return sorted(found.values(), key=lambda c: -c.score)


def _other_forms(
    data: SearchData, laws: Sequence[ClosedLoopFit], count: int
) -> list[tuple[SearchData, list[ScoredLaw]]]:
    """Other forms at the first ``count`` places of ``laws``, with the states that those laws make: a law that describes
    the readings says what the true one reads, even where its form is another and the base model's states are far off.
    """
    first: dict[str, ClosedLoopFit] = {}
    for c in laws:
        first.setdefault(c.law.terms[0].place.name, c)
    with_law = [
        replace(data, states=states_of_fit(data, c), places=(c.law.terms[0].place,))
        for c in list(first.values())[:count]
    ]
    return [(s, distinct_families(single_term_laws(s), FORMS)) for s in with_law]


def _other_places(data: SearchData, best: ClosedLoopFit) -> list[tuple[SearchData, list[ScoredLaw]]]:
    """Laws that may do the same: with one term at other places, or with all terms there where they share a place."""
    at_work, found, terms = replace(data, states=best.states), list[ScoredLaw](), best.law.terms
    moved = [_laws_at_other_places(data, terms, (k,)) for k in range(len(terms))]
    if len(terms) > 1 and len({t.place.name for t in terms}) == 1:
        moved.append(_laws_at_other_places(data, terms, range(len(terms))))
    for laws in moved:
        scored = [ScoredLaw(law, g, g - cost(law)) for law in laws for g in (gain_of(at_work, law),)]
        found += distinct_families(sorted(scored, key=lambda s: -s.score), ALIKE)
    return [(at_work, found)]


def _laws_at_other_places(data: SearchData, terms: Sequence[Term], which: Collection[int]) -> list[Law]:
    """Laws with those of the ``terms`` that are asked for at one other place, going with the tension in any way."""
    old, steady = terms[min(which)].place, {terms[k].form.variable for k in which} <= {"none", "yaw_set"}
    carried = all(terms[k].form.is_carried for k in which)
    return [
        Law(tuple(Term(place, t.form, n) if k in which else t for k, t in enumerate(terms)))
        for place in data.places_to_try
        if place.name != old.name and (place.kind == "sensor") == (old.kind == "sensor")
        for n in exponents_of(data)
        if _may_act_at(place, steady, carried)
    ]


def _may_act_at(place: Place, steady: bool, carried: bool) -> bool:
    """Whether a term may act at a place; carried: it goes round with the belt, so that it is not alike at both
    pulleys."""
    if carried:
        return place.kind in BY_THE_BELT and place.where != "both" and (steady or not place.relative)
    return not place.is_carried and (steady or place.kind not in COURSES_ONLY)


def latent_input_gain(data: SearchData, latent: LatentInput) -> float:
    """chi2 that the mean of a latent input explains, less what it would of noise."""
    g, u = data.projector, latent.inputs(data.design.grid)
    felt = [data.states.channel_input(latent.place, u, *part)[None] for part in latent.place.parts]
    column = data.design.place_columns(latent.place, felt)[0].astype(float)
    return g.chi2() - g.chi2(g.residual - column) - latent.by_chance


def _frequency(data: SearchData, laws: Sequence[ClosedLoopFit]) -> float:
    """How often the first of ``laws`` stays first under fresh noise, the data being as it says."""
    if len(laws) == 1:
        return 1.0
    rows = np.stack([c.readings for c in laws])
    along, prices = data.projector.gram_of(rows), np.array([cost(c.law) for c in laws])
    first = along[0]
    rng = np.random.default_rng(1)
    root = np.linalg.cholesky(along + 1e-6 * np.trace(along) / len(along) * np.eye(len(along)))
    noise = rng.standard_normal((REPETITIONS, len(laws))) @ root.T
    gains = 2.0 * (first + noise) - np.diag(along)
    return float(np.mean(np.argmax(gains - prices, axis=1) == 0))
