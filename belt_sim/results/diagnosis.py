"""A diagnosis: what the model lacks, how sure that is, and what to measure next."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, InstanceOf, PlainSerializer

from belt_sim.campaign.quality.record import Suspicion
from belt_sim.results import words
from belt_sim.results.discovery import Discovery
from belt_sim.results.display import Display, Table, frame
from belt_sim.results.drawings import Drawings
from belt_sim.results.errors import CampaignLabel, Errors, RunError, Where, error_grid
from belt_sim.results.fields import Free, file_field
from belt_sim.results.findings import Candidate, Confusable, Explanation, FoundEffect, NextRun, NoiseLevels, Unknown
from belt_sim.results.words import join_words


class Verdict(StrEnum):
    """What a diagnosis says of the base model."""

    ADEQUATE = "adequate"
    EXPLAINED = "explained"
    PARTLY = "partly"
    NONE_KNOWN = "none_known"
    CANNOT_SAY = "cannot_say"

    @property
    def headline(self) -> str:
        return _HEADLINES[self]

    @property
    def rejects_model(self) -> bool:
        """True when even the final model fails, so that its fitted values are no physical constants."""
        return self not in (Verdict.ADEQUATE, Verdict.EXPLAINED)

    def sentence(self, model: str, effects: Sequence[str], damage: str = "") -> str:
        """The verdict as people would say it; damage: what looks wrong in the data."""
        return _SENTENCES[self].format(model=model, effects=join_words(effects), damage=damage)


_HEADLINES = {
    Verdict.ADEQUATE: "Nothing is missing",
    Verdict.EXPLAINED: "Explained",
    Verdict.PARTLY: "Explained in part",
    Verdict.NONE_KNOWN: "Something unknown is missing",
    Verdict.CANNOT_SAY: "This campaign cannot say",
}
_SENTENCES = {
    Verdict.ADEQUATE: "Nothing is missing from model {model} that these measurements could show.",
    Verdict.EXPLAINED: "Model {model} lacks {effects}; with it, nothing is left that these measurements could show.",
    Verdict.PARTLY: "Model {model} lacks {effects}, and something else that is not in the library.",
    Verdict.NONE_KNOWN: "Model {model} is wrong here, and no effect of the library explains how.",
    Verdict.CANNOT_SAY: "The data look damaged, or the sheet is wrong, so no effect is named: {damage}; "
    "if you have checked it and it is right, give checked=true.",
}


def other_model(model: str, better: str) -> str:
    """The sentence where another base model of the house explains what this one does not."""
    return f"Model {model} is wrong here, and model {better} explains what it does not: use model={better}."


SHOWN_ACTIONS = 3


def _read_suspicion(row: Any) -> Suspicion:
    """Return a suspicion; in a file the two signals of some kinds stand in one text, "y1 and y4"."""
    signal, of_two = row["signal"], row["kind"] in ("swapped", "same_place")
    signals = tuple(signal.split(" and ", 1) if of_two else [signal]) if signal else ()
    return Suspicion(**{k: row[k] for k in ("run", "kind", "sentence", "severity")}, signals=signals)


StoredSuspicion = Annotated[
    InstanceOf[Suspicion],
    BeforeValidator(_read_suspicion),
    PlainSerializer(
        lambda s: {n: getattr(s, n) for n in ("run", "signal", "kind", "sentence", "severity")},
        return_type=dict[str, Any],
    ),
]


@dataclass(frozen=True, kw_only=True, repr=False)
class Diagnosis(Display):
    """What was found, with everything that was tried.

    sentence: the verdict as people say it; ranking: every candidate by itself, likeliest first; considered: the table
    of evidence, a row an explanation, likeliest first; per_run: base model and final model, run by run; admitted: what
    the admission test said of effects of one's own; drawings: what a report draws; beyond: where the final model is
    used beyond its validity, a sentence a limit; discovery: the search for laws that no effect of the library is,
    beside the effects that were found (None where it was not made).
    """

    base_model: str
    campaign: CampaignLabel
    verdict: Verdict
    sentence: str
    effects: tuple[FoundEffect, ...]
    ranking: tuple[Candidate, ...]
    considered: tuple[Explanation, ...]
    error: Errors
    where: Where
    confusables: tuple[Confusable, ...]
    next_runs: tuple[NextRun, ...]
    unknown: Unknown | None
    noise: NoiseLevels
    suspicions: tuple[StoredSuspicion, ...]
    per_run: tuple[RunError, ...]
    provenance: Free
    admitted: Annotated[tuple[str, ...], file_field("admitted", omit_empty=True)] = ()
    drawings: Annotated[Drawings, Field(exclude=True)] = field(default_factory=Drawings)
    beyond: Annotated[tuple[str, ...], file_field("beyond_validity", omit_empty=True)] = ()
    discovery: Annotated[Discovery | None, Field(exclude=True)] = None

    @property
    def law_instead(self) -> bool:
        """Whether what was found is a law, and no effect was named."""
        return not self.effects and self.discovery is not None and self.discovery.law is not None

    @property
    def final_model(self) -> str:
        found = ["the discovered law"] if self.law_instead else [e.id for e in self.effects]
        return " + ".join([self.base_model, *found])

    def lines(self) -> Sequence[str]:
        """The verdict, where the base model fails, the effects, and how the error fell."""
        said = [f"{self.verdict}: {self.sentence}", self.where.sentence, *map(str, self.effects)]
        said += _fall(self.error)
        if self.discovery is not None and self.discovery.found:
            said.append(self.discovery.sentence)
        return [*said, *self.beyond, *(str(n) for n in self.next_runs[:1])]

    def tables(self) -> Sequence[Table]:
        return [ranking_table(self.ranking), error_table(self.error)]

    def to_pandas(self) -> Any:
        """The candidates, best first: gain, threshold, held-out rms [m], and their notes."""
        names = ("id", "gain", "threshold", "held_out_rms", "plausible", "probability", "note")
        return frame([{n: getattr(c, n) for n in names} for c in self.ranking])

    def to_xarray(self) -> Any:
        """rms before and after of every run and signal, in SI."""
        return error_grid(self.per_run)


def _fall(error: Errors) -> list[str]:
    """How the error on held-out conditions fell, beside each run's own zero and settings where that is known."""
    change, floor, beside = error.held_out, error.noise_floor, ""
    if error.own is not None:
        change, floor, beside = error.own, error.own.floor, ", each run's zero and settings taken off"
    if change is None:
        return []
    before, after, least = (words.thousandths(x) for x in (change.before, change.after, floor))
    said = [f"error on held-out conditions{beside} {before} -> {after} mm, noise floor {least} mm"]
    worse = [f"{n} {words.thousandths(c.before)} -> {words.thousandths(c.after)} mm" for n, c in error.worse().items()]
    return [*said, f"left out and predicted, these got worse: {', '.join(worse)}"] if worse else said


def ranking_table(ranking: Sequence[Candidate]) -> Table:
    columns = ("effect", "chi2 gain", "threshold", "held-out rms mm", "plausible", "probability", "note")
    rows = []
    for c in ranking:
        gains = words.decimal(c.gain, 1), words.decimal(c.threshold, 1), words.column(c.held_out_rms)
        rows.append((c.id, *gains, "yes" if c.plausible else "no", words.decimal(c.probability, 3), c.note))
    return Table("candidates", columns, rows, left=("effect", "note"))


def error_table(error: Errors) -> Table:
    changes = error.rows() | error.left_out()
    rows = [(name, words.column(row.before), words.column(row.after)) for name, row in changes.items()]
    title = f"error (noise floor {words.decimal(1e3 * error.noise_floor, 3)} mm)"
    return Table(title, ("rms in mm", "before", "after"), rows)
