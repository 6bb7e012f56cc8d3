"""A discovery: where the model lacks something that no library holds, what it is, and how sure that is."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from belt_sim.results.display import Display
from belt_sim.results.errors import CampaignLabel, Errors
from belt_sim.results.fields import Array, Free
from belt_sim.results.findings import Estimate


@dataclass(frozen=True, kw_only=True)
class PlaceEvidence:
    """How much likelier the data are with a smooth unknown at a place: gain in log evidence over none, with the way of
    pooling runs (odd or even in yaw, each run by itself) and the length [m] on which it changes."""

    place: str
    words: str
    pool: str
    gain: float
    length: float


@dataclass(frozen=True, kw_only=True)
class UnknownCourse:
    """The unknown u against travel [m] in one group of runs, with one sigma; tension [Pa]; all arrays (k,)."""

    label: str
    tension: float
    travel: Array
    u: Array
    sd: Array


@dataclass(frozen=True, kw_only=True)
class LawPoints:
    """The unknown against the variable of its law, as the data show it: points of one tension [Pa]; arrays (k,)."""

    tension: float
    x: Array
    u: Array


@dataclass(frozen=True, kw_only=True)
class FoundLaw:
    """A law that was found: formula as people read it, its variable and unit, parity in yaw, exponent of tension with
    one sigma (None where one tension was run), parameters, the share of the residual's chi2 that it explains, how often
    it would come first if all was measured again, what it looks like."""

    formula: str
    place: str
    variable: str
    variable_unit: str
    parity: str
    exponent: Estimate | None
    parameters: Mapping[str, Estimate]
    share: float
    frequency: float
    looks_like: str


@dataclass(frozen=True, kw_only=True)
class RivalLaw:
    """A law that the data cannot tell from the found one: chi2 by which it explains less, numbers paid for."""

    formula: str
    place: str
    less: float


@dataclass(frozen=True, kw_only=True, repr=False)
class Discovery(Display):
    """What was discovered, if anything.

    found: whether something is missing; probability: of that; law: None where no generic law describes it; unit: of u;
    limits: what these runs cannot show; law_file: text of found_law.yaml.
    """

    base_model: str
    campaign: CampaignLabel
    beside: tuple[str, ...]
    found: bool
    probability: float
    sentence: str
    places: tuple[PlaceEvidence, ...]
    unit: str = ""
    courses: tuple[UnknownCourse, ...] = ()
    law: FoundLaw | None = None
    rivals: tuple[RivalLaw, ...] = ()
    against: tuple[LawPoints, ...] = ()
    curve: LawPoints | None = None
    error: Errors | None = None
    limits: tuple[str, ...] = ()
    law_file: str = ""
    provenance: Free = field(default_factory=dict)

    def lines(self) -> list[str]:
        """The sentence, the places, what cannot be told apart and what cannot be known."""
        lines = [self.sentence]
        if self.found:
            lines += [f"{p.words}: log evidence {p.gain:.0f} ({p.pool})" for p in self.places[:4]]
        lines += [f"not told apart from: {r.formula} ({r.place})" for r in self.rivals]
        if self.error is not None and self.error.held_out is not None:
            change = self.error.held_out
            lines.append(f"held-out error {change.before * 1e3:.3f} -> {change.after * 1e3:.3f} mm")
        return lines + list(self.limits)
