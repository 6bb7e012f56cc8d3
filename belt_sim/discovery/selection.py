"""The choice of a law in closed loop, its fit in the march, and the search for laws as a diagnosis asks for it."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import groupby

import numpy as np

from belt_sim.diagnosis.decide import LawEvidence, UnknownEvidence
from belt_sim.diagnosis.errors import errors_of
from belt_sim.diagnosis.examine import LawResult, Matters
from belt_sim.diagnosis.fit import Fit, covariance_of
from belt_sim.diagnosis.forward import Forward
from belt_sim.diagnosis.plausibility import has_diverged
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.discovery.closed_loop import ClosedLoopFit, fit_closed_loop, states_with
from belt_sim.discovery.linear_search import (
    TERM,
    WITHIN,
    RankedLaws,
    ScoredLaw,
    cost,
    distinct_families,
    exponents_of,
    first_of_each,
    refine_numbers,
    single_term_laws,
    two_term_laws,
    unexplained_elsewhere,
)
from belt_sim.discovery.search_data import (
    COURSES_ONLY,
    WITH_KNEE,
    LatentInput,
    SearchData,
    Spectra,
    has_many_readings,
    search_data_of,
    simpler_form,
)
from belt_sim.effects.generic_law import GenericLaw, law_effect
from belt_sim.effects.law import BY_THE_BELT, Form, Law, Place, SizedLaw, Term, number_name
from belt_sim.jax_setup import map_in_threads

# The choice of a law: laws of one term, then of two where the second earns its place; how stable the choice is.
#
# Candidates come from the linear range, with the states of the base model and with those of the likeliest latent input.
# They are fitted and compared in closed loop.


SINGLES, LAW_PAIRS, FIRSTS, LAWS_ELSEWHERE = 20, 8, 5, 8
LIKELIEST, FORMS = (8, 2), 4  # the likeliest places, first many and then few, and other forms that are tried there
WITH_SLOPES = 2  # laws with a knee, of which both slopes are tried
SAME_COSINE = 0.998  # cosine of readings that are the same
POLISHED, POLISH = 6, 30  # laws that are fitted to the end, steps
MODELLED = 0.02  # of a gain, to which linear columns can be trusted


@dataclass(frozen=True)
class LawChoice:
    """best: the law with the best score; simple: the best of one term; judged: all laws in closed loop, best first;
    possible: chi2 that the latent input explains."""

    best: ScoredLaw
    judged: tuple[ScoredLaw, ...]
    simple: ScoredLaw
    possible: float


def choose_law(data: SearchData, latent: LatentInput, pairs: bool = True) -> LawChoice:
    """The law that explains most for its numbers; latent: the likeliest input, which says what the states were; pairs:
    whether laws of two terms are tried."""
    data = replace(data, wide=True)
    read = replace(data, states=states_with(data, latent))
    tried = [(s, distinct_families(single_term_laws(s), SINGLES)) for s in (data, read)]
    # to first order a large steady change of tension or stiffness looks like something else: each is fitted
    changing = [place for place in data.places if place.relative and not place.is_stretch]
    steady = [ScoredLaw(Law((Term(place, Form("none")),)), 0.0, 0.0) for place in changing]
    ones = _merge(_fit_all(data, [*tried, (data, steady)]), ())
    for places in LIKELIEST:
        # a law that describes the readings says what the true one reads, even where its form is another and the base
        # model's states are far off: other forms at the first places, with the states that those laws make
        some = first_of_each(ones, lambda c: c.law.terms[0].place.name, places)
        at_work = [replace(data, states=states_with(data, c), places=(c.law.terms[0].place,)) for c in some]
        ones = _merge(ones, _fit_all(data, [(s, distinct_families(single_term_laws(s), FORMS)) for s in at_work]))
    g, u, place = data.projector, latent.inputs(data.states.s), latent.place
    felt = [data.columns_at(part[0], data.states.channel_input(place, u, *part)[None]) for part in place.parts]
    column = (felt[0] if len(felt) == 1 else np.sum(felt, axis=0))[0].astype(float)
    possible = g.chi2() - g.chi2(g.residual - column) - latent.by_chance
    everything, sloped = ones, list[ClosedLoopFit]()
    if pairs and ones[0].gain < possible:
        some, firsts = ones[: 4 * FIRSTS], list[int]()  # the first that do different things to the readings
        gram = data.projector.gram_of(np.stack([c.readings for c in some]))
        size = np.sqrt(np.maximum(np.diag(gram), 1e-30))
        for k in range(len(some)):
            if all(abs(gram[k, j]) < SAME_COSINE * size[k] * size[j] for j in firsts):
                firsts.append(k)
        different = [some[k] for k in firsts[:FIRSTS]]
        beside = [(replace(data, states=states_with(data, c)), c.scored_law) for c in different]
        seconds = [(s, distinct_families(two_term_laws(s, one), LAW_PAIRS)) for s, one in beside]
        everything, sloped = _merge(ones, _fit_all(data, seconds)), two_slope_laws(data, ones)
    polished = [fit_closed_loop(data, c.law, c.sizes, POLISH) for c in everything[:POLISHED]]
    everything = _merge(everything, [*(c for c in polished if c is not None), *sloped])
    simple = next(c for c in everything if len(c.law.terms) == 1)  # in the march the second may win
    for made in {c.law.family: c for c in (everything[0], simple)}.values():
        everything = _merge(everything, _fit_all(data, _other_places(data, made)))
    judged = tuple(c.scored_law for c in everything)
    return LawChoice(
        best=judged[0], judged=judged, simple=next(s for s in judged if len(s.law.terms) == 1), possible=possible
    )


def two_slope_laws(data: SearchData, ones: Sequence[ClosedLoopFit]) -> list[ClosedLoopFit]:
    """Piecewise linear laws, with one slope below the knee and another beyond it.

    A dead zone has slope 0 below its knee, a saturation slope 0 beyond it. The best of these at each place (ones: laws
    of one term, best first) are fitted anew with both slopes free: size 1 times x, and size 2 times x up to the knee.
    The search for second terms misses such a law, because its two terms nearly cancel and each alone explains little.
    """
    with_knee, found = (c for c in ones if c.law.terms[0].form.shape in WITH_KNEE), []
    for c in first_of_each(with_knee, lambda c: c.law.terms[0].place.name, WITH_SLOPES):
        term, size = c.law.terms[0], float(c.sizes[0])
        linear = replace(term, form=replace(term.form, shape="linear", knee=None))
        saturating = replace(term, form=replace(term.form, shape="saturation"))
        sizes = [size, -size] if term.form.shape == "dead_zone" else [0.0, size]
        found.append(fit_closed_loop(data, Law((linear, saturating)), np.array(sizes), POLISH))
    return [c for c in found if c is not None]


def _fit_all(data: SearchData, tried: Iterable[tuple[SearchData, Sequence[ScoredLaw]]]) -> list[ClosedLoopFit]:
    """Candidates, each with the data that suggest it, in closed loop."""
    found: list[ClosedLoopFit] = []
    for read, many in tried:
        for one in many:
            law = refine_numbers(read, one.law)
            made = fit_closed_loop(data, law, read.projector.fit_sizes(read.columns(law))[1])
            if made is None:
                continue
            terms, s = [], read.states.s
            for t in made.law.terms:  # without the numbers that have run out of range
                pace = read.pace(t.form)
                terms.append(replace(t, form=simpler_form(t.form, float(s[-1] / pace), float(s[1] / pace))))
            if (plain := Law(tuple(terms))) != made.law:
                made = fit_closed_loop(data, plain, made.sizes)
            found += [] if made is None else [made]
    return found


def _merge(some: Sequence[ClosedLoopFit], more: Sequence[ClosedLoopFit]) -> list[ClosedLoopFit]:
    """The best of each family of both, best first."""
    found: dict[tuple, ClosedLoopFit] = {}
    for c in (*some, *more):
        if c.law.family not in found or c.score > found[c.law.family].score:
            found[c.law.family] = c
    return sorted(found.values(), key=lambda c: -c.score)


def _other_places(data: SearchData, best: ClosedLoopFit) -> list[tuple[SearchData, list[ScoredLaw]]]:
    """Laws that may do the same: with one term at other places, or with all terms there where they share a place."""
    at_work, found, terms = replace(data, states=best.states), list[ScoredLaw](), best.law.terms
    moved = [_laws_at_other_places(data, terms, (k,)) for k in range(len(terms))]
    if len(terms) > 1 and len({t.place.name for t in terms}) == 1:
        moved.append(_laws_at_other_places(data, terms, range(len(terms))))
    for laws in moved:
        gains = [data.projector.fit_sizes(at_work.columns(law))[0] for law in laws]
        scored = [ScoredLaw(law, gain, gain - cost(law)) for law, gain in zip(laws, gains, strict=True)]
        found += distinct_families(sorted(scored, key=lambda s: -s.score), LAWS_ELSEWHERE)
    return [(at_work, found)]


def _laws_at_other_places(data: SearchData, terms: Sequence[Term], which: Collection[int]) -> list[Law]:
    """Laws with those of the ``terms`` that are asked for at one other place, going with the tension in any way."""
    old, steady = terms[min(which)].place, {terms[k].form.variable for k in which} <= {"none", "yaw_set"}
    found = []
    for place in data.places_to_try:
        if all(terms[k].form.is_carried for k in which):  # it goes round with the belt: not alike at both pulleys
            there = place.kind in BY_THE_BELT and place.where != "both" and (steady or not place.relative)
        else:
            there = not place.is_carried and (steady or place.kind not in COURSES_ONLY)
        if there and place.name != old.name and (place.kind == "sensor") == (old.kind == "sensor"):
            for n in exponents_of(data):
                moved = (Term(place, t.form, n) if k in which else t for k, t in enumerate(terms))
                found.append(Law(tuple(moved)))
    return found


# Laws fitted in the march itself: which are fitted there, and which the readings cannot tell from the best; and the
# search for a law from end to end.
#
# The closed loop follows whatever acts on the belt to all orders. A law of the encoder moves the travel at which the
# belt is read: of that the loop has the first order only, so such a law may explain much more in the march.


ROUND_SIGMAS = 2.0  # sigma
RUNAWAY_READING = 10.0  # times the largest reading: a belt that a march takes further has run away
SIZE_HALVINGS = 20  # to a millionth, as good as nothing
WORTH_TRYING = 0.5  # of the best law's gain, that a law of the encoder has to show
FAMILIES = 4  # of laws of the travel: against an edge's short waves a long way is not of first order
ELSEWHERE = 2  # close laws at other places that are put into the march
ANYWHERE = frozenset[str]()
CLOSE_LAWS_TOLD = 12  # laws that are told beside the one that won
CERTAIN = 2.0  # sigma that the size of every term must be from zero

#: number of a law -> value, u (one sigma), unit
Estimates = dict[str, tuple[float, float, str]]


@dataclass(frozen=True)
class MarchFit:
    """A law in the march: its effect, its workbench and joint fit, and the chi2 it explains; exponent: of the
    first term with the tension, value and u, as a fit has it that leaves it free."""

    scored: ScoredLaw
    effect: type[GenericLaw]
    bench: Workbench
    fit: Fit
    gain: float
    exponent: tuple[float, float]

    @property
    def worth(self) -> float:
        """chi2 that the law explains in the march, its numbers paid."""
        return self.gain - cost(self.scored.law)

    @property
    def positions(self) -> dict[str, int]:
        """Positions of the law's numbers in the parameter vector."""
        forward = self.bench.forward
        return {forward.slots[p].name: p for p in forward.index(self.effect.id)}

    def estimates(self) -> Estimates:
        """Every number of the law, with its u (one sigma) and unit; u is 0 of a number that was held."""
        found, variance = {}, dict(zip(self.fit.free, np.diag(self.fit.covariance), strict=True))
        for name, p in self.positions.items():
            scale = self.bench.forward.slots[p].scale
            u = float(np.sqrt(variance.get(p, 0.0))) * abs(scale)
            found[name] = (float(self.fit.vector[p]) * scale, u, self.effect.parameters[name].unit)
        return found

    def sizes_are_certain(self, sigmas: float) -> bool:
        """Whether the size of every term lies that far from zero, its knee being held; of a wave, both sizes together.

        Of a term that is beyond its knee nearly always, readings know size times knee and none of the two.
        """
        at, free = self.positions, self.fit.free
        for k in range(len(self.scored.law.terms)):
            knee = at.get(number_name("knee", k), -1)
            kept = [n for n, p in enumerate(free) if p != knee]
            variance = dict(zip([free[n] for n in kept], np.diag(covariance_of(self.fit.columns[kept])), strict=True))
            sizes = (at[name] for name in (number_name(n, k) for n in ("size", "cos", "sin")) if name in at)
            squares = (float(self.fit.vector[p]) ** 2 / variance[p] if p in variance else np.inf for p in sizes)
            if not sum(squares) >= sigmas**2:
                return False
        return True


def fit_law_in_march(data: SearchData, scored: ScoredLaw) -> MarchFit | None:
    """Fit a law in the march with the chosen effects; None where the belt runs away, however small the law."""
    sizes = data.projector.fit_sizes(data.columns(scored.law))[1] if scored.sizes is None else np.array(scored.sizes)
    effect = law_effect(SizedLaw(scored.law, tuple(float(s) for s in sizes), data.tension))
    old = data.bench.forward
    chosen = [c for c in old.classes if c.id in data.fit.ids]
    forward = Forward(data.bench.samples, old.model, [*chosen, effect], old.step, old.terms)
    bench = replace(data.bench, forward=forward, keeps_noise=True)
    vector, free, own = forward.null(), [], []
    for cls in chosen:
        for new, before in zip(forward.index(cls.id), old.index(cls.id), strict=True):
            vector[new] = data.fit.vector[before]
            free += [new] if before in data.fit.free else []
    for position in forward.index(effect.id):
        name = forward.slots[position].name
        vector[position] = getattr(effect, name) / forward.slots[position].scale
        own += [] if effect.parameters[name].modifier else [position]
        if not (name.startswith("exponent") and len(np.unique(data.stated_tension)) == 1):
            free.append(position)
    ids = (*[c.id for c in chosen], effect.id)
    start = _start_on_pulleys(bench, vector, own)
    if start is None:
        return None
    made = _fit_from(data, scored, effect, bench.moved_to(start), Fit(ids=ids, free=free, vector=start))
    if made is None:
        return None

    # exponents of the tension are held that the readings cannot tell from the round ones of the search, or else from
    # the nearest whole number: one that says nothing costs much where a tension was left out, as what is left may not
    # know it at all
    vector, held = made.fit.vector.copy(), set()
    for name, (value, u, _) in made.estimates().items():
        round_ones = [n for n in (getattr(effect, name), float(np.round(value))) if abs(value - n) < ROUND_SIGMAS * u]
        if name.startswith("exponent") and round_ones:
            position = made.positions[name]
            vector[position] = round_ones[0] / forward.slots[position].scale
            held.add(position)
    if not held:
        return made
    begun = Fit(ids=ids, free=[p for p in made.fit.free if p not in held], vector=vector)
    rounded = _fit_from(data, scored, effect, made.bench, begun)
    return made if rounded is None or rounded.gain < made.gain - WITHIN else replace(rounded, exponent=made.exponent)


def _fit_from(
    data: SearchData, scored: ScoredLaw, effect: type[GenericLaw], bench: Workbench, start: Fit
) -> MarchFit | None:
    fit = bench.fit([start])[0]
    if has_diverged(fit):
        return None
    left = float(data.bench.metric.chi2(data.bench.fitted.y - fit.values))
    made = MarchFit(scored, effect, bench, fit, data.fit.chi2 - min(left, fit.chi2), (0.0, 0.0))
    return replace(made, exponent=made.estimates()["exponent"][:2])


def _start_on_pulleys(bench: Workbench, vector: np.ndarray, sizes: list[int]) -> np.ndarray | None:
    """``vector`` with the law's ``sizes`` halved until the march's belt goes no further than some times the real one.

    The sizes are those of the linear range; a law that feeds back on itself may run away in the march. None where it
    does so without the law.
    """
    furthest = RUNAWAY_READING * float(np.nanmax(np.abs(bench.fitted.y)))
    points = np.repeat(vector[None], SIZE_HALVINGS + 1, axis=0)
    points[:, sizes] *= 0.5 ** np.arange(SIZE_HALVINGS + 1.0)[:, None]
    for point in points:
        if float(np.max(np.abs(bench.forward.values(point[None])))) < furthest:  # nan is no less
            return point
    return None


@dataclass(frozen=True)
class CloseLaw:
    """A law that the readings cannot tell from the one that won, and the chi2 by which it is worth less."""

    scored: ScoredLaw
    less: float


@dataclass
class MarchTrials:
    """Laws fitted in the march (``tried``; None of one that runs away); enough: chi2 that a law has to explain."""

    data: SearchData
    choice: LawChoice
    enough: float
    tried: dict[tuple, MarchFit | None] = field(default_factory=dict)

    def fit(self, laws: Sequence[ScoredLaw]) -> None:
        """Fit laws there that have not been."""
        firsts = first_of_each(laws, lambda s: _key(s.law))
        new = {_key(s.law): s for s in firsts if _key(s.law) not in self.tried}
        # side by side: compiling, loading and marching a few rows leave a core idle
        made = map_in_threads(lambda s: fit_law_in_march(self.data, s), new.values())
        self.tried |= dict(zip(new, made, strict=True))

    def acceptable(self) -> list[MarchFit]:
        """Laws that explain enough, every size being known, best first."""
        made = [r for r in self.tried.values() if r is not None and r.gain >= self.enough]
        return sorted((r for r in made if r.sizes_are_certain(CERTAIN)), key=lambda r: r.worth, reverse=True)

    def indistinguishable(self, won: MarchFit) -> list[CloseLaw]:
        """Laws that the readings cannot tell from one: the best of each place, then the rest."""
        found: dict[tuple, CloseLaw] = {}
        # what the march makes of laws at each place, beyond the search: what it made of the last that was put there;
        # anywhere else what it made of the first
        made = [r for r in self.tried.values() if r is not None]
        shift = {law_places(r.scored.law): r.worth - r.scored.score for r in made}
        shift = {ANYWHERE: made[0].worth - made[0].scored.score if made else 0.0} | shift
        for s in (*self.choice.judged, *(r.scored for r in made)):
            key, there = _key(s.law), s.score + shift.get(law_places(s.law), shift[ANYWHERE])
            if key in self.tried:
                own = self.tried[key]
                there = -np.inf if own is None else own.worth
            close = CloseLaw(s, max(won.worth - there, 0.0))
            fewer = len(s.law.terms) <= len(won.scored.law.terms)
            if key != _key(won.scored.law) and fewer and close.less < WITHIN + MODELLED * won.gain:
                found.setdefault(key, close)
        ranked = sorted(found.values(), key=lambda c: c.less)
        first = {law_places(c.scored.law): c for c in reversed(ranked)}
        return sorted(ranked, key=lambda c: (first[law_places(c.scored.law)] is not c, c.less))


def best_in_march(
    data: SearchData, choice: LawChoice, likeliest: LatentInput, enough: float
) -> tuple[MarchFit | None, tuple[CloseLaw, ...]]:
    """The best law in the march, and those that the readings cannot tell from it.

    likeliest: the latent input of the likeliest place; enough: chi2 that a law has to explain.
    """
    march = MarchTrials(data, choice, enough)
    march.fit([choice.best, *([choice.simple] if len(choice.best.law.terms) > 1 else [])])
    march.fit(laws_of_the_encoder(choice, likeliest))
    if not (made := march.acceptable()):
        return None, ()
    own, close = law_places(made[0].scored.law), march.indistinguishable(made[0])
    elsewhere = (c.scored for c in close if law_places(c.scored.law) != own)
    march.fit(first_of_each(elsewhere, lambda scored: law_places(scored.law), ELSEWHERE))
    first, *others = march.acceptable()
    # what predicts unseen runs worse than nothing is no law
    for won in (first, *(r for r in others if first.worth - r.worth < WITHIN + MODELLED * first.gain)):
        error = errors_of(data.bench, data.fit, won.bench, won.fit).held_out
        if error is None or error.after <= error.before:
            return won, tuple(march.indistinguishable(won)[:CLOSE_LAWS_TOLD])
    return None, ()


def laws_of_the_encoder(choice: LawChoice, likeliest: LatentInput) -> list[ScoredLaw]:
    """The best laws of the encoder, where it is the likeliest place or they explain a good part of what the best law
    does."""
    own = [s for s in choice.judged if [t.place.name for t in s.law.terms] == ["travel"]][:FAMILIES]
    promise = max((s.gain for s in own), default=0.0)
    return own if promise >= WORTH_TRYING * choice.best.gain or likeliest.place.name == "travel" else []


def law_places(law: Law) -> frozenset[str]:
    """Where a law acts."""
    return frozenset(t.place.name for t in law.terms)


def _key(law: Law) -> tuple:
    """What tells laws apart: what they say, and the lengths of waves to a tenth."""
    lengths = tuple(round(10.0 * float(np.log(t.form.at))) if t.form.is_wave and t.form.at else 0 for t in law.terms)
    return law.family, tuple(t.exponent for t in law.terms), lengths


# The search from end to end: where something acts, which law, and how that does in the march.

RUNS_OF_A_LAW = 3  # runs, below which no law is guessed
DESCRIBED_BY_LAW = 0.7  # of what a latent input explains; a law that explains less does not describe it


@dataclass(frozen=True, kw_only=True)
class SearchOutcome:
    """What a search has found.

    data: of the search; latent_inputs: of all places, by evidence (none where nothing was sought); choice: None where
    nothing is missing; best: None where no law describes it; close: laws that the readings cannot tell from it.
    """

    data: SearchData
    latent_inputs: tuple[LatentInput, ...]
    choice: LawChoice | None = None
    best: MarchFit | None = None
    close: tuple[CloseLaw, ...] = ()

    @cached_property
    def alike(self) -> tuple[Place, ...]:
        """Places at which something may act as well as at that of the law, or of no law where none is told.

        One margin, the noise and MODELLED of what is explained, and two rules: a free input there is as likely as at
        the likeliest place, beside the states that the law makes; or a law of one term there makes what the told law
        makes.
        """
        if self.choice is None:
            return ()
        told, scored = self.best is not None, self.choice.best if self.best is None else self.best.scored
        data = replace(self.data, wide=True)
        sizes = (
            data.projector.fit_sizes(data.columns(scored.law))[1] if scored.sizes is None else np.array(scored.sizes)
        )
        made = fit_closed_loop(data, scored.law, sizes)
        latent_inputs = (data if made is None else replace(data, states=states_with(data, made))).latent_inputs
        top = latent_inputs[0].gain
        left = unexplained_elsewhere(data, scored.law) if told else {}
        for c in latent_inputs:
            left[c.place] = min(2.0 * (top - c.gain), left.get(c.place, np.inf))  # log evidence as chi2
        most, own = WITHIN + MODELLED * max(scored.gain, 2.0 * top), {t.place for t in scored.law.terms if told}
        return tuple(sorted((p for p, x in left.items() if x < most and p not in own), key=lambda p: left[p]))

    @property
    def latent(self) -> LatentInput:
        """The latent input of greatest evidence; where a law was found, of those at its place, but for a stretch of the
        belt, which is nowhere along the travel."""
        place = None if self.best is None else self.best.scored.law.terms[0].place
        if place is None or place.is_stretch:
            return self.latent_inputs[0]
        if place.is_carried:
            return self.data.latent_inputs_at(place)[0]
        return next(c for c in self.latent_inputs if c.place.name == place.name)


LOOP = 0.005  # of a gain, and WITHIN beside it: to which the closed loop and the march agree


def search_law(
    data: SearchData,
    tell: Callable[[str], None] = lambda text: None,
    *,
    latent_inputs: Sequence[LatentInput] | None = None,
    pairs: bool = True,
    matters: Callable[[list[ScoredLaw]], bool] = lambda laws: True,
) -> SearchOutcome:
    """Search the law of what is missing beside a fit; something is missing.

    latent_inputs: of ``data``, where they are known; pairs: whether laws of two terms are tried; matters: whether laws
    would change what is decided; those that would not if they explained LOOP and WITHIN more than in closed loop are
    not put into the march.
    """
    if len(data.bench.samples.runs) < RUNS_OF_A_LAW:
        return SearchOutcome(data=data, latent_inputs=())
    tell("searching for a law of the rest")
    latent_inputs = tuple(data.latent_inputs if latent_inputs is None else latent_inputs)
    choice = choose_law(data, latent_inputs[0], pairs)
    outcome = SearchOutcome(data=data, latent_inputs=latent_inputs, choice=choice)
    enough = DESCRIBED_BY_LAW * choice.possible
    rise = [WITHIN + LOOP * s.gain for s in choice.judged]
    more = [replace(s, gain=s.gain + r, score=s.score + r) for s, r in zip(choice.judged, rise, strict=True)]
    to_first_order = laws_of_the_encoder(choice, latent_inputs[0])
    if choice.best.gain < enough or not (to_first_order or matters(more)):
        return outcome
    best, close = best_in_march(data, choice, latent_inputs[0], enough)
    return replace(outcome, best=best, close=close)


LAWS = 12  # that are compared in the linear range


@dataclass(frozen=True)
class LawSearch:
    """The search for laws as a diagnosis asks for it; tell: hears what is being done; spectra: as in ``latent_inputs``;
    begun: the data and latent inputs beside sets of effects that only add to the readings, for a law may be asked for
    beside these."""

    tell: Callable[[str], None] = lambda text: None
    spectra: Spectra = field(default_factory=dict)
    begun: dict[frozenset[str], tuple[SearchData, list[LatentInput]]] = field(default_factory=dict)

    def evidence_of_unknown(self, bench: Workbench, fit: Fit, among: Sequence[str] = ()) -> UnknownEvidence:
        """What is seen beside a fit in the linear range."""
        data = search_data_of(bench, fit, among, self.spectra)
        found, latent_inputs = unknown_evidence(data)
        data.forget_inputs()
        data.design.cache_clear()  # a law is seldom asked for
        if all(c.is_additive() for c in bench.forward.classes if c.id in fit.ids):
            self.begun[frozenset(fit.ids)] = data, latent_inputs
        return found

    def law(self, bench: Workbench, fit: Fit, matters: Matters = lambda laws: True, most: float = np.inf) -> LawResult:
        """The law of what is seen beside a fit, with its joint fit; matters, most: as in ``LawFinder``."""
        data, latent_inputs = self.begun.pop(frozenset(fit.ids), (None, None))
        if data is None or data.bench is not bench or data.fit is not fit:
            data, latent_inputs = search_data_of(bench, fit, spectra=self.spectra), None
        pair = LawEvidence(gain=most, cost=TERM, sizes=2)
        outcome = search_law(
            data, self.tell, latent_inputs=latent_inputs, pairs=matters([pair]),
            matters=lambda some: matters([*map(law_evidence, some)]),
        )  # fmt: skip
        data.forget_inputs()
        if (made := outcome.best) is None:
            return LawResult(outcome)
        law = law_evidence(ScoredLaw(made.scored.law, made.gain, made.worth))
        return LawResult(outcome, law=law, fit=made.fit, bench=made.bench)


def unknown_evidence(data: SearchData) -> tuple[UnknownEvidence, list[LatentInput]]:
    """The evidence of latent inputs and of laws of one term, in the linear range; and these inputs, by evidence.

    A latent input at one sensor that differs from run to run is no law: it is that instrument's wander.
    """
    by_kind = [data]
    if has_many_readings(data.bench):  # what a kind of place needs is dropped before the next
        kinds = groupby(data.places, key=lambda place: (place.kind, place.is_carried))
        by_kind = [replace(data, places=tuple(some)) for _, some in kinds]
    ranked, latent_inputs = list[RankedLaws](), list[LatentInput]()
    for some in by_kind:
        ranked.append(single_term_laws(some))
        latent_inputs += some.latent_inputs
    together = (np.concatenate([getattr(r, name) for r in ranked]) for name in ("gain", "score"))
    ones = RankedLaws([table for r in ranked for table in r.tables], *together)
    latent_gains = [c.gain for c in latent_inputs if not (c.place.kind == "sensor" and c.pool == "each run")]
    evidence = UnknownEvidence(
        ids=frozenset(data.fit.ids),
        courses=np.array(latent_gains),
        laws=tuple(law_evidence(s) for s in distinct_families(ones, LAWS)),
        tried=max(len(ones.gain) / len(exponents_of(data)), 1.0),
    )
    return evidence, sorted(latent_inputs, key=lambda c: -c.gain)


def law_evidence(scored: ScoredLaw) -> LawEvidence:
    """A law as the table of evidence has it."""
    sizes = sum(t.sizes for t in scored.law.terms)
    return LawEvidence(gain=scored.gain, cost=scored.gain - scored.score, sizes=sizes)
