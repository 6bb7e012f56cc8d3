"""The search for unknown laws, as a diagnosis asks for it (``belt_sim.diagnosis.evidence``)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from belt_sim.diagnosis.decision.table import LawEvidence, UnknownEvidence
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.discovery.describe import describe
from belt_sim.discovery.discover import Discovered, discover
from belt_sim.discovery.search import Scored, distinct, exponents_of, singles
from belt_sim.discovery.survey import Survey, survey_of
from belt_sim.discovery.words import formula
from belt_sim.results.discovery import Discovery

LAWS = 12  # that are compared in the linear range


@dataclass(frozen=True)
class MarchedLaw:
    """What a search has found beside a fit."""

    discovered: Discovered

    @property
    def law(self) -> LawEvidence | None:
        """The law as the march has it; None where none describes what is there."""
        made = self.discovered.refit
        return None if made is None else _law(Scored(made.scored.law, made.gain, made.worth))

    @property
    def fit(self) -> Fit | None:
        """The joint fit with the law; None where there is no law."""
        made = self.discovered.refit
        return None if made is None else made.fit

    @property
    def bench(self) -> Workbench:
        """The workbench of that fit."""
        made = self.discovered.refit
        return self.discovered.survey.bench if made is None else made.bench

    def describe(self, probability: float, config: Any = None) -> Discovery:
        """The result; probability: that something unknown is there."""
        return describe(self.discovered, probability, config=config)


@dataclass(frozen=True)
class LawSearch:
    """The search; tell: hears what is being done."""

    tell: Callable[[str], None] = lambda text: None

    def evidence_of_unknown(self, bench: Workbench, fit: Fit, among: Sequence[str] = ()) -> UnknownEvidence:
        """What is seen beside a fit in the linear range."""
        return unknown_evidence(survey_of(bench, fit, among))

    def law(self, bench: Workbench, fit: Fit) -> MarchedLaw:
        """The law of what is seen beside a fit."""
        return MarchedLaw(discover(survey_of(bench, fit), self.tell))


def unknown_evidence(survey: Survey) -> UnknownEvidence:
    """The evidence of free courses and of single laws.

    A course at one sensor that is another in every run is no law: it is that instrument's wander.
    """
    ones = singles(survey)
    courses = [c.gain for c in survey.courses() if not (c.place.kind == "sensor" and c.pool == "each run")]
    return UnknownEvidence(
        beside=frozenset(survey.fit.ids),
        courses=np.array(courses),
        laws=tuple(_law(s) for s in distinct(ones, LAWS)),
        tried=max(len(ones) / len(exponents_of(survey)), 1.0),
    )


def _law(scored: Scored) -> LawEvidence:
    terms = scored.law.terms
    return LawEvidence(
        words=f"{terms[0].place.words}: {formula(scored.law)}",
        gain=scored.gain,
        cost=scored.gain - scored.score,
        sizes=sum(t.sizes for t in terms),
    )
