"""Tables of steady rates (one row a run, as published tables and digitised figures are) -> runs and steady rates."""

from dataclasses import dataclass, field

import numpy as np

from belt_sim.campaign.types import Run, SteadyRate
from belt_sim.intake.mapping import MappingEntry, RunEntry
from belt_sim.intake.nouns import LoggedTable
from belt_sim.intake.proposal import Question
from belt_sim.intake.roles import Used
from belt_sim.intake.split import run_name
from belt_sim.intake.stated import Settings, from_entry, of_tables, questions
from belt_sim.intake.units import quantity

RATES = ("rate1", "rate2", "rate3", "rate4")


@dataclass(frozen=True, kw_only=True)
class Rated:
    """runs and their rates; names: of the runs in the mapping."""

    runs: tuple[Run, ...] = ()
    steady: tuple[SteadyRate, ...] = ()
    missing: list[Question] = field(default_factory=list)
    names: tuple[str, ...] = ()


def rates_of(tables: list[tuple[LoggedTable, tuple[Used, ...]]], mapping: MappingEntry, section: float | None) -> Rated:
    """Everything that tables of rates state."""
    runs: list[Run] = []
    steady: list[SteadyRate] = []
    missing: list[Question] = []
    keys: list[str] = []
    for table, used in tables:
        stated = of_tables([(table, used)], section)
        u, question = _spread(used)
        missing += [question] if question else []
        for row, key in enumerate(stated):
            entry = mapping.runs.get(key, RunEntry())
            settings = from_entry(entry, f"runs.{key}", section, Settings())
            for name, value in stated[key].items():
                settings = settings.with_(name, value, "", "its column")
            settings = from_entry(mapping.all_runs, "all_runs", section, settings)
            keys.append(key)
            missing += questions(key, settings.numbers, table.file.name)
            if entry.skip or {"tension", "yaw"} - set(settings.numbers):
                continue
            numbers = {k: v for k, v in settings.numbers.items() if k not in ("yaw_at", "yaw_at_u", "yaw_at_time")}
            name = entry.name or run_name(key)
            runs.append(Run(name=name, use=entry.use or "fit", **numbers))  # type: ignore[arg-type]
            rates = np.array([_one(used, rate, row) for rate in RATES])
            steady.append(SteadyRate(run=name, rates=rates, u=float(u[row]) if u is not None else 0.0))
    return Rated(runs=tuple(runs), steady=tuple(steady), missing=missing, names=tuple(keys))


def _one(used: tuple[Used, ...], role: str, row: int) -> float:
    found = next((u for u in used if u.role == role), None)
    return float("nan") if found is None else float(found.si(np.array([row]))[0])


def _spread(used: tuple[Used, ...]) -> tuple[np.ndarray | None, Question | None]:
    """One sigma [m/m] of the rates, row by row."""
    column = next((u for u in used if u.role == "u_rate"), None)
    if column is not None:
        return column.si(np.arange(len(column.column.values))), None
    rate = next(u for u in used if u.role in RATES)
    if rate.entry.white is not None:
        value, _, _ = quantity(rate.entry.white, ("angle",), "mm/m", f"columns.{rate.column.name}.white")
        return np.full(len(rate.column.values), value * 1e-3), None
    if rate.entry.axis is not None:
        (p0, p1), (v0, v1) = rate.entry.axis.pixel, rate.entry.axis.value
        u = abs((v1 - v0) / (p1 - p0)) * rate.entry.axis.u * rate.factor
        return np.full(len(rate.column.values), u), None
    return None, Question(
        path=("columns", rate.column.name, "white"),
        text="how well are the rates known (one sigma)?",
        example="0.002 mm/m",
    )
