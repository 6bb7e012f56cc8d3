"""Tables and a mapping -> the campaign, the questions that are still open, and the folder with the mapping as used."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from belt_sim.campaign import Campaign, CampaignError, write_campaign
from belt_sim.campaign.quality import off_the_pulleys
from belt_sim.campaign.types import BeltSheet, Machine, Source, kind_at, shortlist
from belt_sim.case import Rig
from belt_sim.errors import InputError
from belt_sim.importing.columns import (
    Column,
    LoggedTable,
    LoggedTables,
    Note,
    column_questions,
    resolve_columns,
    span_of,
)
from belt_sim.importing.mapping import MAPPING_FILE, MAPPING_SCHEMA, MappingEntry, Question, ask, flow_text, mapping_of
from belt_sim.importing.runs import (
    BY_TRAVEL,
    RANGES,
    SPEEDS_APART,
    TIME_COLUMN,
    AssembledRun,
    FoundRuns,
    Section,
    find_runs,
    runs_on_one_grid,
)
from belt_sim.importing.sheets import NoiseRead, machine_and_belt, settings_of, sheet_text, signals_of
from belt_sim.units import MM, N_PER_MM2, NAMES, UNITS, readings_of


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
    missing, unknown = column_questions(tables)
    machine, belt, remarks, about_sheet = machine_and_belt(entry.machine, entry.belt)
    settings, of_settings = settings_of(entry)
    missing += about_sheet
    width, thickness = (belt.width.value, belt.thickness.value) if belt else (float("nan"), float("nan"))
    section = Section(width * thickness, thickness)
    unreadable = any(q.path[-1] in ("role", "unit") or q.path[0] in ("format", "use") for q in missing)
    found = FoundRuns() if unreadable else find_runs(tables, entry, section)
    missing += found.questions
    made = found.recorded
    asked: list[Question] = []
    if machine and belt and not missing:
        missing += (asked := doubts(made, tables, entry, machine, belt))
    if not (found.rated or missing or any(set(run.record) - {TIME_COLUMN} for run in made)):
        remedy = "no column of a signal holds numbers"
        if any(t.file.suffix.lower() == ".xlsx" for t in tables):
            remedy += "; a workbook keeps those of its formulas only if it was saved with them"
        raise InputError("files", "no signal", "", remedy)
    notes = [n for t in tables for n in t.notes]
    changed = (
        c for c in used if c.stated_unit and c.entry.unit and c.unit and UNITS.get(c.stated_unit) != UNITS[c.unit]
    )
    told = "the file says {0.stated_unit}, the mapping {0.unit}; the mapping is taken"
    notes += dict.fromkeys(Note(c.name, told.format(c)) for c in changed)
    notes += [Note(m.key, n) for m in made for n in m.notes]
    middles = {c.signal: c.middle for c in used if c.middle is not None}
    runs, more, step = runs_on_one_grid([] if asked else made, entry, middles)
    far = [] if entry.is_trusted("y0") else off_the_pulleys(runs, width)
    for run in far[:1]:
        what = f"y0 {(run.y0 or 0.0) / MM:.4g} mm in run {run.name}, more than half the belt's width off the middle"
        missing.append(ask("trust", role="y0", what=f"{what} of the pulleys", it="y0, or middle,"))
    signals, noise, of_signals = signals_of(runs, used, machine.centre_distance.value if machine else 10.0)
    campaign = None
    if not missing and machine is not None and belt is not None:
        campaign = Campaign(
            title=entry.title or f"imported from {shortlist(dict.fromkeys(t.file.name for t in logged))}",
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
        comments=remarks | of_settings | of_signals,
        notes=tuple(notes + more),
    )


#: Revolutions of the belt, and part of a span, that a record is likely to travel; likely settings in SI.
REVOLUTIONS, PART_OF_SPAN = 50.0, 0.02
#: Spans that a yawed belt must have run to be judged by its movement, and the share of yaw times travel that it moves
#: at least; share by which a tension may move within a run.
SPANS, STILL_TENSION, RAMP = 2.0, 2e-3, 0.04
LIKELY_SETTINGS = {"tension": (3e5, 8e8), "speed": (2e-3, 15.0), "yaw": (-0.035, 0.035), "yaw_head": (-0.035, 0.035)}


def doubts(
    made: list[AssembledRun], tables: list[LoggedTable], entry: MappingEntry, machine: Machine, belt: BeltSheet
) -> list[Question]:
    """Questions on imported numbers that this machine hardly has: travel and wandering of runs, and their settings.

    Each asks for the unit of a column that has none in the mapping, else whether it is so (trust).
    """
    rig = Rig(**{name: quantity.value for name, quantity in vars(machine).items()})
    columns = [c for table in tables for c in table.columns]
    found: dict[tuple[str, ...], Question] = {}

    def doubt(role: str, names: tuple[str, ...], what: str) -> None:
        if entry.is_trusted(role):
            return
        open_units = [c for c in columns if (c.role in names or c.signal in names) and not c.entry.unit and not c.stamp]
        question = ask("trust", role=role, what=what, it="the number")
        if (column := next((c for c in open_units if c.unit), None)) is not None:
            units = [u for u in NAMES if UNITS[u][0] == UNITS[column.unit][0]]
            words = {"name": column.name, "unit": column.unit, "span": span_of(column)}
            question = ask("unit_odd", units, column.unit, what=what, **words)
        found.setdefault(question.path, question)

    for run in made:
        travel = run.record.index.to_numpy()
        far = float(travel[-1] - travel[0])
        if not PART_OF_SPAN * rig.span_length <= far <= REVOLUTIONS * rig.belt_length:
            words = f"{far:.4g} m of travel in run {run.key}, {far / rig.belt_length:.2g} revolutions of the belt"
            own = {c.role for c in columns}
            doubt("travel", ("travel",) if "travel" in own else ("speed", "time"), words)
        by_travel = run.speeds.get(BY_TRAVEL, 0.0)
        for told, speed in run.speeds.items() if by_travel > 0.0 and not entry.is_trusted("speed") else ():
            if abs(speed - by_travel) > SPEEDS_APART * by_travel:
                lasted = float(np.ptp(run.record[TIME_COLUMN]))
                words = f"run {run.key} travels {far:.4g} m in {lasted:.4g} s, at {by_travel:.4g} m/s"
                question = ask("contradiction", what=f"{words}, but {told} says {speed:.4g} m/s")
                found.setdefault(question.path, question)
        for signal in (name for name in run.record.columns if name != TIME_COLUMN):
            if kind_at(next(c for c in columns if c.signal == signal).at) != "lateral":
                continue
            moved = float(np.ptp(np.nanpercentile(run.record[signal], [5.0, 95.0])))  # beside a few spikes
            words = f"{signal} moves by {1e3 * moved:.4g} mm in run {run.key}"
            if moved > belt.width.value:
                doubt("y", (signal,), f"{words}, more than the belt's width")
            yaw = abs(run.settings["yaw"].value) if "yaw" in run.settings else 0.0
            if far > SPANS * rig.span_length and moved < STILL_TENSION * yaw * far:
                share = f"{moved / (yaw * far):.1g}"
                doubt("y", (signal,), f"{words}, {share} of yaw times travel (a belt: 0.05 to 0.4)")
        for key, (low, high) in LIKELY_SETTINGS.items():
            setting = run.settings.get(key)
            with_unit = setting is not None and setting.text and not readings_of(setting.text)
            if setting is not None and not (with_unit or low <= setting.value <= high or setting.value == 0.0):
                unit = RANGES[key].unit
                words = f"{key} {setting.value / UNITS[unit][1]:.4g} {unit} in run {run.key}"
                doubt(key, (key,), words)
        tension = run.settings.get("tension")
        if tension is not None and tension.high - tension.low > RAMP * abs(tension.value):
            low, high, mean = (x / N_PER_MM2 for x in (tension.low, tension.high, tension.value))
            words = f"the tension moves from {low:.4g} to {high:.4g} N/mm2 within run {run.key}, which counts as at its"
            doubt("steady_tension", (), f"{words} mean, {mean:.4g}, throughout")
    return list(found.values())


def write(proposal: Proposal, folder: str | Path, *, overwrite: bool = False) -> Campaign:
    """Write campaign.yaml (commented), runs.csv, signals.csv or steady.csv, and mapping.yaml; all of it or nothing.

    Returns the campaign as the loader reads it back. Raises CampaignError for answers that are missing and for what
    the loader refuses, InputError for a folder that is not empty.
    """
    campaign = proposal.complete()
    instead = {"campaign.yaml": sheet_text(campaign, proposal.comments), MAPPING_FILE: mapping_text(proposal.mapping)}
    return write_campaign(campaign, folder, overwrite=overwrite, instead=instead)


# ---- the mapping as it was used

_STATED: dict[str, Any] = {"mode": "json", "by_alias": True, "exclude_unset": True, "exclude_none": True}


def mapping_used(
    entry: MappingEntry, used: tuple[Column, ...], made: list[AssembledRun], step: float
) -> dict[str, Any]:
    """The mapping with all that was recognised, so that the import can be repeated: plain data for ``understand``."""
    stated = entry.model_dump(**_STATED)
    columns: dict[str, Any] = {}
    for u in used:
        name = u.signal if u.at else ""
        seen = {"role": u.role, "unit": u.unit, "at": u.at, "name": name}
        own = {k: v for k, v in seen.items() if v} | u.entry.model_dump(**_STATED)
        columns.setdefault(u.name, own)
    runs: dict[str, Any] = {}
    for run in made:
        known = {k: s.text for k, s in run.settings.items() if s.text and getattr(entry.all_runs, k, None) is None}
        runs[run.key] = known | run.entry.model_dump(**_STATED)
    for name, run_entry in stated.get("runs", {}).items():
        runs.setdefault(name, run_entry)
    out = {"schema": MAPPING_SCHEMA} | stated | {"columns": columns, "runs": {k: own for k, own in runs.items() if own}}
    if step > 0.0:
        out["step_m"] = f"{step:g}"
    order = [name.rstrip("_") for name in MappingEntry.model_fields]
    return {k: out[k] for k in order if k in out and out[k] not in (None, {})}


_HEAD = """\
# How the logger's files were understood; belt-sim import FILES mapping=THIS_FILE does the same again.
"""


def mapping_text(mapping: dict[str, Any]) -> str:
    """The mapping as YAML, one column or run a line."""
    lines = []
    for key, value in ((k, v) for k, v in mapping.items() if v not in (None, {})):
        if key in ("columns", "runs"):
            lines += [f"{key}:", *(f"  {flow_text(str(k))}: {flow_text(v)}" for k, v in value.items())]
        else:
            text = yaml.safe_dump({key: value}, sort_keys=False, allow_unicode=True, width=10_000)
            lines += text.rstrip("\n").split("\n")
    return _HEAD + "\n".join([*lines, ""])
