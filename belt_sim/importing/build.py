"""Tables and a mapping -> the campaign, the mapping as it was used, and the questions that are still open."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from pydantic import BaseModel

from belt_sim.campaign import Campaign, CampaignError
from belt_sim.campaign.types import Source
from belt_sim.errors import InputError
from belt_sim.importing.columns import Column, LoggedTables, Note, column_questions, other_units, resolve_columns
from belt_sim.importing.mapping import SCHEMA, MappingEntry, Question, mapping_of
from belt_sim.importing.noise import NoiseRead
from belt_sim.importing.records import runs_on_one_grid
from belt_sim.importing.runs import AssembledRun, find_runs
from belt_sim.importing.sheets import belt_of, machine_of, settings_of, signals_of


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """missing: questions without an answer yet; unknown: questions about columns that are left out as long as nobody
    answers; campaign: None while an answer is missing that it cannot do without; mapping: everything that was used, so
    that the import can be repeated; noise: signal -> what was read off; comments: key of campaign.yaml -> remark to be
    written beside it; notes: what was done.
    """

    columns: tuple[Column, ...]
    missing: tuple[Question, ...]
    campaign: Campaign | None
    mapping: dict[str, Any]
    unknown: tuple[Question, ...] = ()
    noise: dict[str, NoiseRead] = field(default_factory=dict)
    comments: dict[str, str] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()

    def complete(self) -> Campaign:
        """The campaign; raises CampaignError with one line for every answer that is missing."""
        if self.campaign is None:
            raise CampaignError([q.problem for q in self.missing])
        return self.campaign


def understand(logged: LoggedTables, mapping: Any = None) -> Proposal:
    """What the files mean, given a mapping (plain data, a YAML file, or None).

    Raises CampaignError or InputError for what cannot be; what is merely not known becomes a question.
    """
    entry = mapping_of(mapping)
    tables = resolve_columns(logged, entry)
    used = tuple(c for table in tables for c in table.columns)
    missing, unknown = column_questions(logged, tables)
    machine, remarks, of_machine = machine_of(entry)
    belt, of_belt, about_belt = belt_of(entry)
    missing += of_machine + about_belt
    section = belt.width.value * belt.thickness.value if belt else float("nan")
    unreadable = any(q.path[-1] in ("role", "unit") for q in missing)
    found = find_runs(tables, entry, section, only_rates=unreadable)
    missing += found.questions
    made = found.recorded
    if not (made or found.rated or missing):
        raise InputError("files", "no run", "", "no run was found in them; is the right column the run or the travel?")
    notes = [n for t in tables for n in t.notes] + other_units(tables) + [Note(m.key, n) for m in made for n in m.notes]
    runs, more, step = runs_on_one_grid(made, entry)
    signals, noise, of_signals = signals_of(runs, used, machine.centre_distance.value if machine else 10.0)
    settings, of_settings = settings_of(entry)
    campaign = None
    if not missing and machine is not None and belt is not None:
        campaign = Campaign(
            title=entry.title or f"imported from {_names_in_order(t.file.name for t in logged.tables)}",
            source=Source(**entry.source.model_dump()),
            machine=machine,
            belt=belt,
            signals=signals,
            settings=settings,
            runs=(*runs, *found.rated),
            steady=tuple(found.steady),
        )
    return Proposal(
        columns=used,
        missing=tuple(dict.fromkeys(missing)),
        unknown=tuple(unknown),
        campaign=campaign,
        mapping=mapping_used(entry, used, made, step),
        noise=noise,
        comments=remarks | of_belt | of_signals | of_settings,
        notes=tuple(notes + more),
    )


def _names_in_order(names: Iterable[str]) -> str:
    """The first few names, T2 before T10, and how many more there are."""
    known = sorted(set(names), key=lambda n: [(w, int(d or 0)) for w, d in re.findall(r"(\D*)(\d*)", n.lower())])
    return ", ".join(known[:4]) + (f" and {len(known) - 4} more" if len(known) > 4 else "")


# ---- the mapping as it was used


def mapping_used(
    entry: MappingEntry, used: tuple[Column, ...], made: list[AssembledRun], step: float
) -> dict[str, Any]:
    """The mapping with all that was recognised, so that the import can be repeated: plain data for ``understand``."""
    stated = _plain(entry)
    columns: dict[str, Any] = {}
    for u in used:
        name = u.signal if u.at else ""
        seen = {"role": u.role, "unit": "" if u.unit_is_guess else u.unit, "at": u.at, "name": name}
        own = {k: v for k, v in seen.items() if v} | _plain(u.entry)
        columns.setdefault(u.name, own)
    runs: dict[str, Any] = {}
    for run in made:
        known = {k: s.text for k, s in run.settings.items() if s.text and getattr(entry.all_runs, k, None) is None}
        runs[run.key] = known | _plain(run.entry)
    for name, run_entry in stated.get("runs", {}).items():
        runs.setdefault(name, run_entry)
    runs = {name: run_entry for name, run_entry in runs.items() if run_entry}
    out = {"schema": SCHEMA} | stated | {"columns": columns, "runs": runs}
    if step > 0.0:
        out["step_m"] = f"{step:g}"
    order = [name.rstrip("_") for name in MappingEntry.model_fields]
    return {k: out[k] for k in order if k in out and out[k] not in (None, {})}


def _plain(entry: BaseModel) -> dict[str, Any]:
    return entry.model_dump(mode="json", by_alias=True, exclude_unset=True, exclude_none=True)
