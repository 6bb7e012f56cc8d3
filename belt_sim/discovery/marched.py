"""Which laws are put into the march, and which others cannot be told from the one that wins there.

The closed loop of the search is linear at fixed tension. What changes the tension changes the march itself, and what
moves the encoder moves where it is read: of those it sees the first order only, and their laws may be worth much more
in the march. Which of several places it is, too, the march says better than the linear range.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from belt_sim.diagnosis.errors.model_errors import errors_of
from belt_sim.diagnosis.fits.heldout import held_out
from belt_sim.discovery.choose import MODELLED, Choice
from belt_sim.discovery.evidence import Course
from belt_sim.discovery.loop import closed
from belt_sim.discovery.refit import Refit, refits
from belt_sim.discovery.rounds import Loop
from belt_sim.discovery.search import WITHIN, Scored, fitted
from belt_sim.discovery.survey import Survey
from belt_sim.effects.law_terms import STIFFNESS, TENSION, TRAVEL, Form, Law, Term

PROMISE = 0.5  # of the best law's gain, that a law of which the first order is known has to show
LEADING = 5  # laws whose courses are tried for the tension
FAMILIES = 4  # of laws of the travel: against an edge's short waves a long way is not of first order
COURSES = 2  # of the tension that are put into the march: a pull that swings by half is not of first order
ELSEWHERE = 2  # close laws at other places that are put into the march
ANYWHERE = frozenset[str]()
SHOWN = 12  # laws that are told beside the one that won
CERTAIN = 2.0  # sigma that the size of every term must be from zero


@dataclass(frozen=True)
class Close:
    """A law that the readings cannot tell from the one that won, and the chi2 by which it is worth less."""

    scored: Scored
    less: float


@dataclass
class March:
    """Laws in the march, by what they say; None of one that runs away."""

    survey: Survey
    choice: Choice
    enough: float
    tried: dict[tuple, Refit | None] = field(default_factory=dict)

    def put(self, laws: Sequence[Scored]) -> None:
        """Fit laws there that have not been."""
        new: dict[tuple, Scored] = {}
        for s in laws:
            new.setdefault(_key(s.law), s)
        new = {key: s for key, s in new.items() if key not in self.tried}
        self.tried |= dict(zip(new, refits(self.survey, list(new.values())), strict=True))

    def fine(self) -> list[Refit]:
        """Laws that explain enough, every size being known, best first."""
        made = [r for r in self.tried.values() if r is not None and r.gain >= self.enough and r.certain(CERTAIN)]
        return sorted(made, key=lambda r: r.worth, reverse=True)

    def winner(self) -> Refit | None:
        """The law that is worth most."""
        return next(iter(self.fine()), None)

    def that_predicts(self, won: Refit) -> Refit:
        """The law that won, or a close one where what is held out would be predicted worse with it than without."""
        close = [r for r in self.fine() if won.worth - r.worth < margin(won)]
        return next((r for r in close if self.falls(r)), won)

    def falls(self, made: Refit) -> bool:
        """Whether the held-out error does not rise with a law, as it is told."""
        s = self.survey
        error = errors_of(
            made.bench, s.fit, held_out(s.bench, s.fit), made.fit, held_out(made.bench, made.fit)
        ).held_out
        return error is None or error.after <= error.before

    def near(self, won: Refit) -> list[Close]:
        """What cannot be told from a law: of each place the best, then the rest."""
        found: dict[tuple, Close] = {}
        shift = self._shifts()
        for s in (*self.choice.judged, *(r.scored for r in self.tried.values() if r is not None)):
            key, there = _key(s.law), s.score + shift.get(places(s.law), shift[ANYWHERE])
            if key in self.tried:
                made = self.tried[key]
                there = -np.inf if made is None else made.worth
            close = Close(s, max(won.worth - there, 0.0))
            fewer = len(s.law.terms) <= len(won.scored.law.terms)
            if key != _key(won.scored.law) and fewer and close.less < margin(won):
                found.setdefault(key, close)
        ranked = sorted(found.values(), key=lambda c: c.less)
        first = {places(c.scored.law): c for c in reversed(ranked)}
        return sorted(ranked, key=lambda c: (first[places(c.scored.law)] is not c, c.less))

    def _shifts(self) -> dict[frozenset[str], float]:
        """What the march makes of laws at each place, beyond the search: what it made of the last that was put there;
        anywhere else what it made of the first."""
        made = [r for r in self.tried.values() if r is not None]
        found = {places(r.scored.law): r.worth - r.scored.score for r in made}
        return {ANYWHERE: made[0].worth - made[0].scored.score if made else 0.0} | found


def margin(won: Refit) -> float:
    """chi2 within which laws cannot be told from one: what chance makes, and what forms make that are nearly right."""
    return WITHIN + MODELLED * won.gain


def marched(survey: Survey, choice: Choice, likeliest: Course, enough: float) -> tuple[Refit | None, tuple[Close, ...]]:
    """The law that wins in the march, and those that cannot be told from it.

    likeliest: the course of the likeliest place; enough: chi2 that a law has to explain to describe what is there.
    """
    march = March(survey, choice, enough)
    march.put([choice.best, *([choice.simple] if len(choice.best.law.terms) > 1 else [])])
    march.put(of_first_order(survey, choice, likeliest))
    won = march.winner()
    if won is None:
        return None, ()
    march.put(elsewhere(march.near(won), won))
    won = march.that_predicts(march.winner() or won)
    return won, tuple(march.near(won)[:SHOWN])


def elsewhere(near: Sequence[Close], won: Refit) -> list[Scored]:
    """The closest laws at other places, one of each."""
    first: dict[frozenset[str], Scored] = {}
    for c in near:
        first.setdefault(places(c.scored.law), c.scored)
    first.pop(places(won.scored.law), None)
    return list(first.values())[:ELSEWHERE]


def of_first_order(survey: Survey, choice: Choice, likeliest: Course) -> list[Scored]:
    """Laws of the tension and of the encoder's travel of which the linear range may say too little.

    Theirs is the likeliest place, or they explain a good part of what the best law does. A pull that changes is felt as
    a turn where the belt is bent, in proportion: courses of laws that read the state are tried for it too.
    """
    found = []
    for name in (TENSION, TRAVEL, *(p.name for p in survey.places if p.kind in STIFFNESS)):
        own = [s for s in choice.judged if len(s.law.terms) == 1 and s.law.terms[0].place.name == name]
        tried = own[: FAMILIES if name == TRAVEL else 1]
        tried += _courses_of(survey, choice, likeliest)[:COURSES] if name == TENSION else []
        promise = max((s.gain for s in tried), default=0.0)
        if promise >= PROMISE * choice.best.gain or likeliest.place.name == name:
            found += tried
    return found


def _courses_of(survey: Survey, choice: Choice, likeliest: Course) -> list[Scored]:
    """The courses of the leading laws as changes of the tension, fitted in closed loop, best first.

    They begin where the belt is bent as the likeliest course has it: a pull acts where the belt is bent, and a large
    one changes that.
    """
    there = [p for p in survey.places if p.name == TENSION]
    leading = [*choice.judged[:LEADING], *[s for s in choice.judged if _like_a_pull(s.law)][:1]]
    terms = [t for s in leading for t in s.law.terms if t.form.variable != "none" and not t.form.carried]
    forms = {
        f.family: f
        for t in reversed(terms)
        for f in (_course(t.form),)
        if f.course not in ("constant", "decaying_wave")
    }
    laws = [Law((Term(place, form),)) for place, form in product(there, forms.values())]
    loop, read = Loop(survey), survey.informed(likeliest)
    made = [closed(loop, law, fitted(read, read.columns(law))[1]) for law in laws]
    return sorted((c.scored for c in made if c is not None), key=lambda s: -s.score)


def _like_a_pull(law: Law) -> bool:
    """Whether a law turns the belt in proportion to how it is bent at both pulleys, as a change of the tension does."""
    return [t.family[:3] for t in law.terms] == [("turn_both", "kappa", "linear")]


def _course(form: Form) -> Form:
    """The course of a form alone."""
    return Form("none", course=form.course, at=form.at, wide=form.wide, timed=form.timed)


def places(law: Law) -> frozenset[str]:
    """Where a law acts."""
    return frozenset(t.place.name for t in law.terms)


def _key(law: Law) -> tuple:
    """What tells laws apart: what they say, and the lengths of waves to a tenth."""
    lengths = tuple(round(10.0 * float(np.log(t.form.at))) if t.form.is_wave and t.form.at else 0 for t in law.terms)
    return law.family, tuple(t.exponent for t in law.terms), lengths
