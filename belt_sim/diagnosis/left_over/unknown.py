"""The seam for what no effect of the library is: what a search for unknown laws hands to the verdict."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench


class Unknown(Protocol):
    """What is seen beside a fit."""

    @property
    def failed(self) -> tuple[str, ...]:
        """Tests by which something is left that chance does not explain; empty when nothing is."""

    def columns(self) -> np.ndarray:
        """Shapes (k, R, S, n) of what is left, to refit effects beside it; none where nothing was found."""

    def law(self) -> "InTheMarch | None":
        """The law that describes it, in the march; None where none does."""


@dataclass(frozen=True)
class OneLaw:
    """A single law in closed loop: what it says, its predictions (R, S, n), and the chi2 that its numbers (cost), and
    its being the best of so many (searched), had to earn.
    """

    words: str
    values: np.ndarray
    cost: float
    searched: float

    @property
    def price(self) -> float:
        """What it had to earn altogether [chi2]."""
        return self.cost + self.searched


@dataclass(frozen=True)
class InTheMarch:
    """A law in the march beside effects: a workbench that has both, their joint fit, the law's name there, and of how
    many terms it is.
    """

    bench: Workbench
    fit: Fit
    name: str
    terms: int


@dataclass(frozen=True)
class Together:
    """One law in the march beside effects: a workbench that has both, the fit of the law alone, and that of both."""

    bench: Workbench
    law: Fit
    both: Fit


class Look(Protocol):
    """The search for unknown laws."""

    def __call__(self, bench: Workbench, fit: Fit, failed: bool, known: Unknown | None = None) -> Unknown:
        """What is seen beside ``fit``; failed: whether another test has shown already that something is left; known:
        what was seen beside other effects, whose law is tried too."""

    def one_law(self, bench: Workbench, fit: Fit, least: float, *, closely: bool = False) -> OneLaw | None:
        """The single law that explains most beside ``fit``; None where none promises a chi2 of ``least``; closely: one
        that changes what it reads is sought as well."""

    def together(self, bench: Workbench, fit: Fit) -> Together | None:
        """The single law that explains most beside ``fit``, put beside it; None where none can be."""

    def lead_by_chance(self, bench: Workbench, base: Fit, effects: Fit) -> np.ndarray:
        """How much more chi2 the best law explains than ``effects`` in campaigns in which these are right, (draws,)."""
