"""A comparison: one model, with or without effects, against a campaign."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Annotated, Any

from pydantic import Field, computed_field

from belt_sim.results import words
from belt_sim.results.display import Display, Table
from belt_sim.results.drawings import Drawings, Drift
from belt_sim.results.errors import Errors, RunError, ShortLabel, SteadyError, Where, error_grid
from belt_sim.results.fields import Free, StoredEffect, file_field, is_empty

STEADY_K = 2.0  # a steady rate is off when it lies further than so many u from the stated one


@dataclass(frozen=True, kw_only=True, repr=False)
class Comparison(Display):
    """Error of every run and signal of ``base_model``, before and after ``effects``, and where the model fails.

    where: None when the campaign states steady rates only; steady: those rates, point by point; error: None without a
    lateral signal; beyond: limits of its validity that the model is used beyond, a sentence each.
    """

    base_model: str
    campaign: ShortLabel
    effects: tuple[StoredEffect, ...]
    error: Annotated[Errors | None, file_field("error", omit_empty=True)]
    where: Annotated[Where | None, file_field("where", omit_empty=True)]
    per_run: Annotated[tuple[RunError, ...], file_field("per_run", omit_empty=True)]
    steady: tuple[SteadyError, ...]
    provenance: Free
    drawings: Annotated[Drawings, Field(exclude=True)] = field(default_factory=Drawings)
    beyond: Annotated[tuple[str, ...], file_field("beyond_validity", omit_empty=True)] = ()

    @computed_field(exclude_if=is_empty)  # type: ignore[prop-decorator]
    @property
    def drift(self) -> list[Drift]:
        """Return the drifts of all fitted parameters, before and after effects were added."""
        return [d for pair in self.drawings.drifts for d in pair if d is not None]

    @property
    def final_model(self) -> str:
        return " + ".join([self.base_model, *(e.id for e in self.effects)])

    def lines(self) -> Sequence[str]:
        """Where the model fails; with effects, how the error changed and what got worse."""
        said = [f"{self.final_model} against {self.campaign.title}"]
        if self.where is not None:
            said += [self.where.sentence, self.where.boundary_sentence, *self.changes()]
        said += self.beyond
        return said

    def changes(self) -> list[str]:
        """What the effects changed; nothing when there are none."""
        if not self.effects:
            return []
        said, names = [], ", ".join(e.id for e in self.effects)
        if self.error is not None:
            for name, row in self.error.rows().items():
                said.append(f"{name}: rms {words.column(row.before)} -> {words.column(row.after)} mm with {names}")
            said.append(f"noise floor {words.column(self.error.noise_floor)} mm")
        worse = [f"{r.run} {r.signal}" for r in self.per_run if r.worse]
        return [*said, f"got worse: {', '.join(worse)}" if worse else "no run got worse"]

    def tables(self) -> Sequence[Table]:
        return [*([steady_table(self)] if self.steady else []), *([runs_table(self)] if self.per_run else [])]

    def to_pandas(self) -> Any:
        """A row a run and signal in SI; of a campaign of steady rates, a row a run and point."""
        import pandas as pd

        return pd.json_normalize([asdict(r) for r in self.per_run or self.steady], sep="_")

    def to_xarray(self) -> Any:
        """rms before and after of every run and signal, in SI."""
        return error_grid(self.per_run)


def runs_table(c: Comparison) -> Table:
    """Error of every run and signal, and the late rates that people compare."""
    settings = ("run", "signal", "N/mm2", "yaw deg", "use", "unit")
    columns = (*settings, "rms", "with effects", "floor", "late rate", "measured")
    rows = []
    for r in c.per_run:
        after = words.column(r.after) if c.effects else "-"
        errors = (words.column(r.before), after, words.column(r.floor))
        rates = [words.column(f.late_rate, sign=True) for f in (r.modelled, r.measured)]
        rows.append((r.run, r.signal, words.tension(r.tension), words.yaw(r.yaw), r.use, r.unit, *errors, *rates))
    marked = [k for k, r in enumerate(c.per_run) if r.worse]
    return Table(f"{c.base_model} against {c.campaign.title}", columns, rows, marked=marked)


def steady_table(c: Comparison) -> Table:
    """Measured and modelled late rates of steady.csv; marked where the model is off."""
    columns = ("run", "point", "N/mm2", "measured", "u", "modelled", "|E|/u")
    rows = []
    for r in c.steady:
        rates = [words.column(v) for v in (r.measured, r.u, r.modelled)]
        rows.append((r.run, str(r.point), words.tension(r.tension), *rates, words.decimal(r.ratio, 1)))
    marked = [k for k, r in enumerate(c.steady) if r.ratio > STEADY_K]
    return Table(f"steady rates in mm per m, {c.final_model}", columns, rows, marked=marked)
