"""Discovery from end to end: is something left, where, what is it, which law, said in a sentence, written as a file."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.discovery.choose import Choice, choose
from belt_sim.discovery.evidence import Course, prior_modes
from belt_sim.discovery.gate import DRAWS, LEVEL, Gate, judged
from belt_sim.discovery.marched import Close, marched
from belt_sim.discovery.refit import Refit
from belt_sim.discovery.search import Scored
from belt_sim.discovery.survey import Survey, survey_of

FEWEST = 3  # runs, below which no law is guessed
DESCRIBED = 0.7  # of what a free course explains; a law that explains less does not describe it
SUGGESTIVE = 0.05  # p of the gate, above which what other tests have seen is not given a place either


@dataclass(frozen=True, kw_only=True)
class Discovered:
    """survey and gate of the search; courses: none where nothing is seen; course: of the greatest evidence; choice and
    refit: None where nothing is missing, or no law describes it; close: laws that cannot be told from it; left: another
    test has shown already that something is left."""

    survey: Survey
    gate: Gate
    courses: tuple[Course, ...]
    choice: Choice | None = None
    refit: Refit | None = None
    close: tuple[Close, ...] = ()
    left: bool = False

    @property
    def found(self) -> bool:
        """Whether something is missing."""
        return self.choice is not None

    @property
    def course(self) -> Course:
        """The course of greatest evidence; where a law was found, of those at its place."""
        if self.refit is None:
            return self.courses[0]
        place = self.refit.scored.law.terms[0].place
        return self.survey.courses_at(place)[0] if place.carried else self._at(place.name)

    @property
    def alike(self) -> Course:
        """The same; of what the belt carries as if both pulleys met it at once."""
        place = self.course.place
        return self._at(f"{place.kind}_both") if place.carried else self.course

    def _at(self, name: str) -> Course:
        return next(c for c in self.courses if c.place.name == name)


def discover(
    bench: Workbench,
    fit: Fit,
    *,
    draws: int = DRAWS,
    seed: int = 0,
    level: float = LEVEL,
    failed: bool = False,
    tell: Callable[[str], None] = lambda text: None,
) -> Discovered:
    """What ``fit`` lacks, as an unknown.

    draws: campaigns simulated with nothing missing; level: false discoveries when nothing is; failed: another test
    has shown already that something is left.
    """
    return discovered(*asked(bench, fit, draws=draws, seed=seed, level=level, tell=tell), failed=failed, tell=tell)


def asked(
    bench: Workbench, fit: Fit, *, draws: int, seed: int, level: float = LEVEL, tell: Callable[[str], None]
) -> tuple[Survey, Gate]:
    """What ``fit`` leaves, and whether any generic law explains more of it than chance."""
    tell("testing what is left against generic laws")
    survey = survey_of(bench, fit)
    return survey, judged(survey, draws=draws, seed=seed, level=level)[0]


def discovered(
    survey: Survey, gate: Gate, *, failed: bool, tell: Callable[[str], None], known: Sequence[Scored] = ()
) -> Discovered:
    """The same of a survey whose gate is known; known: laws found elsewhere, which are put into the march as well."""
    seen = gate.failed or (failed and gate.p < SUGGESTIVE)
    if not seen or len(survey.bench.samples.runs) < FEWEST:
        return Discovered(survey=survey, gate=gate, courses=(), left=failed)
    tell("looking for the law of what is left")
    courses = tuple(survey.courses())
    choice = choose(survey, courses[0])
    enough = DESCRIBED * choice.possible
    if choice.best.gain < max(enough, gate.threshold) and not known:
        return Discovered(survey=survey, gate=gate, courses=courses, choice=choice, left=failed)
    best, close = marched(survey, choice, courses[0], enough, known)
    return Discovered(survey=survey, gate=gate, courses=courses, choice=choice, refit=best, close=close, left=failed)


def unknown_columns(found: Discovered, modes: int = 12) -> np.ndarray:
    """Shapes (k, R, S, n) of what was discovered, to refit effects beside it: the strongest modes of the unknown's
    course and, where a law describes it, that law's own parameters in closed loop. A law is seldom the very one that is
    at work; what it misses has the same place, and is no effect of the library. Of what the belt carries a free course
    would be: it does what a weld or an edge does.
    """
    course = course_columns(found.survey, found.alike, modes)
    if found.refit is None:
        return course
    fit, cls = found.refit.fit, found.refit.written.cls
    own = [k for k, p in enumerate(fit.free) if p in found.refit.bench.forward.index(cls.id)]
    return np.concatenate([fit.slopes[own], course])


def course_columns(survey: Survey, course: Course, modes: int) -> np.ndarray:
    """The strongest modes of a course's prior as shapes (k, R, S, n) of the readings."""
    grid = survey.ops.grid
    rows = prior_modes(course, modes)
    inputs = [weights[:, None] * np.interp(grid, course.knots, row)[None] for weights in course.weights for row in rows]
    return survey.readings(course.place, np.stack(inputs))
