"""Runs of tables of steady rates: one row a run, as published tables and digitised figures are."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from belt_sim.campaign import Run
from belt_sim.campaign.run_tables import RATES
from belt_sim.campaign.types import SteadyRate
from belt_sim.importing.blocks import run_name
from belt_sim.importing.columns import UsedTable
from belt_sim.importing.mapping import MappingEntry, RunEntry
from belt_sim.importing.settings import questions, stated_settings, table_settings
from belt_sim.importing.types import Question
from belt_sim.importing.units import UNITS, quantity


@dataclass(frozen=True, kw_only=True)
class RatedRuns:
    """runs and their rates; names: of the runs in the mapping."""

    runs: list[Run] = field(default_factory=list)
    steady: list[SteadyRate] = field(default_factory=list)
    missing: list[Question] = field(default_factory=list)
    names: list[str] = field(default_factory=list)


def rates_of(tables: list[UsedTable], mapping: MappingEntry, section: float) -> RatedRuns:
    """Everything that tables of rates state."""
    found = RatedRuns()
    for table in (t for t in tables if t.logged.kind == "rates"):
        rates = {u.role: u.si() for u in table.columns if u.role in RATES}
        u, question = _rate_spread(table)
        found.missing.extend([question] if question else [])
        for row, (key, listed) in enumerate(table_settings([table], section).items()):
            entry = mapping.runs.get(key, RunEntry())
            settings = stated_settings(mapping, key, listed, section)
            found.names.append(key)
            found.missing.extend(questions(key, settings, table.logged.file.name))
            if entry.skip or {"tension", "yaw"} - set(settings):
                continue
            numbers: dict[str, Any] = {k: s.value for k, s in settings.items() if not k.startswith("yaw_at")}
            name = entry.name or run_name(key)
            found.runs.append(Run(name=name, use=entry.use or "fit", **numbers))
            own = np.array([rates[r][row] if r in rates else np.nan for r in RATES])
            found.steady.append(SteadyRate(run=name, rates=own, u=0.0 if u is None else float(u[row])))
    return found


def _rate_spread(table: UsedTable) -> tuple[np.ndarray | None, Question | None]:
    """One sigma [m/m] of the rates, row by row."""
    column = table.column("u_rate")
    if column is not None:
        return column.si(), None
    rate = next(u for u in table.columns if u.role in RATES)
    u = rate.by_hand
    if rate.entry.white is not None:
        value, _, unit = quantity(rate.entry.white, ("angle",), "mm/m", f"columns.{rate.column.name}.white")
        u = value * UNITS[unit][1]
    if u is not None:
        return np.full(len(rate.column.values), u), None
    text = "how well are the rates known (one sigma)?"
    return None, Question(path=("columns", rate.column.name, "white"), text=text, example="0.002 mm/m")
