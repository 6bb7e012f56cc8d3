"""The search for unknown laws as a test of every verdict (``belt_sim.diagnosis.left_over.unknown``)."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.left_over.unknown import InTheMarch, OneLaw, Together, Unknown
from belt_sim.discovery.discover import Discovered, asked, discovered, unknown_columns
from belt_sim.discovery.gate import DRAWS, Gate
from belt_sim.discovery.rival import lead_by_chance, one_law, together
from belt_sim.discovery.search import Scored
from belt_sim.discovery.survey import Survey, survey_of
from belt_sim.discovery.words import formula

LEADS = 4  # times as many campaigns, in which an effect is at work: of these the tail counts itself


@dataclass(frozen=True)
class Seen:
    """What a search beside a fit has seen; left: another test has shown already that something is there; known: a law
    that was found beside other effects.

    The gate is asked at once, which law it is only where somebody wants to know.
    """

    survey: Survey
    gate: Gate
    left: bool
    tell: Callable[[str], None]
    known: tuple[Scored, ...] = ()

    @property
    def failed(self) -> tuple[str, ...]:
        """The law that explains more than chance, if one does."""
        if not self.gate.failed:
            return ()
        law = self.gate.best[0].law
        return (f"a law beyond the library ({law.terms[0].place.words}: {formula(law)})",)

    @cached_property
    def discovered(self) -> Discovered:
        """What it is."""
        return discovered(self.survey, self.gate, failed=self.left, tell=self.tell, known=self.known)

    def columns(self) -> np.ndarray:
        """Shapes (k, R, S, n) of what was discovered."""
        if self.discovered.found:
            return unknown_columns(self.discovered)
        return np.empty((0, *self.survey.bench.samples.y.shape))

    def law(self) -> InTheMarch | None:
        """The law that describes it, in the march; None where none does."""
        made = self.discovered.refit
        if made is None:
            return None
        return InTheMarch(made.bench, made.fit, made.written.cls.id, len(made.scored.law.terms))


@dataclass(frozen=True)
class Looking:
    """The test with its settings; draws: campaigns simulated with nothing missing."""

    seed: int
    draws: int = DRAWS
    tell: Callable[[str], None] = lambda text: None

    def __call__(self, bench: Workbench, fit: Fit, failed: bool, known: Unknown | None = None) -> Seen:
        """What is seen beside ``fit``; known: what was seen beside other effects, whose law is tried too."""
        made = known.discovered.refit if isinstance(known, Seen) else None
        laws = () if made is None else (made.as_fitted,)
        return Seen(*asked(bench, fit, draws=self.draws, seed=self.seed, tell=self.tell), failed, self.tell, laws)

    def one_law(self, bench: Workbench, fit: Fit, least: float, *, closely: bool = False) -> OneLaw | None:
        """The single law that explains most beside ``fit``; None where none promises a chi2 of ``least``; closely: one
        that changes what it reads is sought as well."""
        self.tell("asking whether one law explains as much")
        return one_law(survey_of(bench, fit), least, closely=closely)

    def together(self, bench: Workbench, fit: Fit) -> Together | None:
        """The single law that explains most beside ``fit``, put beside it; None where none can be."""
        self.tell("asking what is needed beside one law")
        return together(survey_of(bench, fit))

    def lead_by_chance(self, bench: Workbench, base: Fit, effects: Fit) -> np.ndarray:
        """How much more chi2 the best law explains than ``effects`` in campaigns in which these are right, (draws,)."""
        self.tell("asking how far ahead of the right effect one law gets by chance")
        beside = survey_of(bench, effects)
        survey = replace(survey_of(bench, base, like=effects), states=beside.states)
        return lead_by_chance(survey, beside, draws=LEADS * self.draws, seed=self.seed)
