"""A check: what is wrong with a campaign, what it can tell, and what not."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field, PlainSerializer, computed_field

from belt_sim.results import words
from belt_sim.results.errors import ShortLabel
from belt_sim.results.estimates import Free, MachineSizes, display_unit, file_field
from belt_sim.results.words import Display, Table

SHOWN_PAIRS = 15
WELL = 0.1  # of the largest plausible size


@dataclass(frozen=True, kw_only=True)
class Visible:
    """The smallest size of an effect that would show, in SI; None where none does.

    parameter: the one of its numbers that shows best; share: that size over the largest that a machine could have.
    """

    effect: str
    parameter: str
    unit: str
    meaning: Annotated[str, Field(exclude=True)]
    smallest: float | None
    largest_plausible: float
    share: Annotated[float, Field(exclude=True)]

    @computed_field(alias="seen")  # type: ignore[prop-decorator]
    @property
    def word(self) -> str:
        if self.smallest is None:
            return "not at all"
        return "well" if self.share < WELL else "when large" if self.share < 1.0 else "not at a plausible size"


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two effects that could not be told apart: sigma apart at a size that is plain to see; what further run tells
    them apart, and sigma with it (None where none does, or none was looked for)."""

    effects: tuple[str, str]
    sigma: float
    action: Annotated[str | None, file_field("best_further_run")] = None
    sigma_after: Annotated[float | None, file_field("sigma_with_it")] = None


@dataclass(frozen=True, kw_only=True)
class Doubt:
    """Something in the data that looks like a slip, or in the plan that a diagnosis will miss."""

    kind: str
    sentence: str
    stops: bool = False


@dataclass(frozen=True, kw_only=True, repr=False)
class Check(Display):
    """What a campaign can tell of what ``base_model`` may lack; planned: whether its runs are still to be measured.

    runs: names of those that it is judged by; missing: of those that are still to be measured where others are.
    """

    campaign: ShortLabel
    base_model: str
    planned: bool
    runs: Annotated[tuple[str, ...], PlainSerializer(len, return_type=int)]
    missing: tuple[str, ...] = ()
    noise: str
    doubts: tuple[Doubt, ...]
    visible: tuple[Visible, ...]
    pairs: Annotated[tuple[Pair, ...], file_field("not_told_apart")]
    provenance: Free
    machine: Annotated[MachineSizes | None, Field(exclude=True)] = None

    def lines(self) -> Sequence[str]:
        """What is wrong, and what can be seen, in sentences."""
        many = f"{len(self.runs)} run{'' if len(self.runs) == 1 else 's'}"
        state = f"is planned, {many}, without readings yet" if self.planned else f"is a valid campaign, {many}"
        if self.missing:
            of = len(self.runs) + len(self.missing)
            there, still = ", ".join(self.runs), ", ".join(self.missing)
            state = f"{len(self.runs)} of {of} runs are there ({there}), which what follows is about; "
            state += f"still missing: {still}"
        said = [f"{self.campaign.title}: {state}.", self.noise, *(f"{d.kind}: {d.sentence}" for d in self.doubts)]
        if self.visible:
            seen = sum(v.share < 1.0 for v in self.visible)
            said.append(f"{seen} of {len(self.visible)} effects would show at a size that is plausible on a machine.")
        if self.visible and not self.pairs:
            said.append("Any two of them can be told apart where both are plain to see.")
        elif self.visible:
            helped = sum(p.action is not None for p in self.pairs)
            more = f"; one more run would separate {helped} of them" if helped else ""
            many = "1 pair of effects looks" if len(self.pairs) == 1 else f"{len(self.pairs)} pairs of effects look"
            said.append(f"{many} alike in these runs, even at a plain size (12 sigma){more}.")
        return said

    def tables(self) -> Sequence[Table]:
        """The smallest size of every effect that would show, as people at a machine measure it; pairs look alike."""
        tables, rows = [], []
        for v in self.visible:
            factor, unit = display_unit(v.effect, v.parameter, v.unit, self.machine)
            sizes = [words.number(s and factor * s, 2) for s in (v.smallest, v.largest_plausible)]
            rows.append((f"{v.effect}.{v.parameter}", *sizes, unit, v.word.removeprefix("when ").split(" ")[0]))
        if self.visible:
            columns: tuple[str, ...] = ("number of an effect", "shows from", "up to", "unit", "seen")
            left = ("number of an effect", "unit", "seen")
            hidden = [k for k, v in enumerate(self.visible) if v.share >= 1.0]
            title = "Smallest size that shows in 9 of 10 cases, and the largest plausible size"
            tables.append(Table(title, columns, rows, left=left, marked=hidden))
        if self.pairs:  # the most alike first, and the best further run for each
            rows = []
            for p in self.pairs[:SHOWN_PAIRS]:
                further = p.action or words.NO_NUMBER, words.number(p.sigma_after, 2)
                rows.append((" - ".join(p.effects), words.number(p.sigma, 2), *further))
            more = f" ({SHOWN_PAIRS} of {len(self.pairs)} shown)" if len(self.pairs) > SHOWN_PAIRS else ""
            columns = ("pair", "sigma apart", "best further run", "sigma with it")
            tables.append(Table(f"Pairs these runs cannot separate{more}", columns, rows, left=columns[::2]))
        return tables

    def to_pandas(self) -> Any:
        """A row an effect, in SI."""
        import pandas as pd

        return pd.DataFrame([vars(v) for v in self.visible])
