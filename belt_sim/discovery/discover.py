"""Discovery from end to end: where is what is left, what is it, which law, said in a sentence, written as a file."""

from collections.abc import Callable
from dataclasses import dataclass

from belt_sim.discovery.choose import Choice, choose
from belt_sim.discovery.evidence import Course
from belt_sim.discovery.marched import Close, marched
from belt_sim.discovery.refit import Refit
from belt_sim.discovery.survey import Survey

FEWEST = 3  # runs, below which no law is guessed
DESCRIBED = 0.7  # of what a free course explains; a law that explains less does not describe it


@dataclass(frozen=True, kw_only=True)
class Discovered:
    """survey: of the search; courses: none where nothing was sought; course: of the greatest evidence; choice and
    refit: None where nothing is missing, or no law describes it; close: laws that cannot be told from it."""

    survey: Survey
    courses: tuple[Course, ...]
    choice: Choice | None = None
    refit: Refit | None = None
    close: tuple[Close, ...] = ()

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

    def _at(self, name: str) -> Course:
        return next(c for c in self.courses if c.place.name == name)


def discover(survey: Survey, tell: Callable[[str], None] = lambda text: None) -> Discovered:
    """What is missing beside the fit of a survey; something is."""
    if len(survey.bench.samples.runs) < FEWEST:
        return Discovered(survey=survey, courses=())
    tell("looking for the law of what is left")
    courses = tuple(survey.courses())
    choice = choose(survey, courses[0])
    enough = DESCRIBED * choice.possible
    if choice.best.gain < enough:
        return Discovered(survey=survey, courses=courses, choice=choice)
    best, close = marched(survey, choice, courses[0], enough)
    return Discovered(survey=survey, courses=courses, choice=choice, refit=best, close=close)
