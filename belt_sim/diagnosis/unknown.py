"""What a search for laws beyond the library hands to the diagnosis: the diagnosis does not import the search."""

from collections.abc import Sequence
from typing import Protocol

from belt_sim.diagnosis.decision.table import Beyond, LawEvidence
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.results.discovery import Discovery


class LawFinding(Protocol):
    """What a search has found beside a fit: perhaps a law."""

    @property
    def law(self) -> LawEvidence | None:
        """The law as the march has it; None where none describes what is there."""

    @property
    def fit(self) -> Fit | None:
        """The joint fit with the law; None where there is no law."""

    @property
    def bench(self) -> Workbench:
        """The workbench of that fit."""

    def described(self, probability: float, config: object = None) -> Discovery:
        """The result; probability: that something unknown is there."""


class LawFinder(Protocol):
    """A search for laws beyond the library."""

    def beyond(self, bench: Workbench, fit: Fit, among: Sequence[str] = ()) -> Beyond:
        """What is seen beside a fit in the linear range; among: effects of all fits that are looked at."""

    def law(self, bench: Workbench, fit: Fit) -> LawFinding:
        """The law of what is seen beside a fit."""
