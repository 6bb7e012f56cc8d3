"""Runs of all records, each with its settings."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

import numpy as np
import pandas as pd

from belt_sim.campaign.problems import did_you_mean, shortlist
from belt_sim.campaign.quality.bad_readings import SPIKE, few_spikes
from belt_sim.campaign.quality.record import resolution
from belt_sim.errors import InputError
from belt_sim.importing.blocks import FEWEST, LoggedBlock, blocks_of
from belt_sim.importing.columns import UsedTable
from belt_sim.importing.mapping import MappingEntry, RunEntry
from belt_sim.importing.records import TIME, merge_records
from belt_sim.importing.roles import DAY
from belt_sim.importing.settings import (
    Settings,
    column_settings,
    name_settings,
    stated_settings,
    table_settings,
    travel_settings,
    yaw_settings,
    yaw_time_settings,
)
from belt_sim.importing.travel import travel_of
from belt_sim.importing.types import Question


@dataclass(frozen=True, kw_only=True)
class AssembledRun:
    """One run as far as it is known: key, its name in the mapping; entry: what the mapping says of it; record: time and
    signals over the travel; started: date and time of day of its first row, "" where only seconds were logged."""

    key: str
    entry: RunEntry
    record: pd.DataFrame
    settings: Settings
    file: str
    started: str
    notes: tuple[str, ...]


def assemble_runs(
    tables: list[UsedTable], mapping: MappingEntry, section: float
) -> tuple[list[AssembledRun], list[Question], list[str]]:
    """Runs of all records, questions, and all names that the mapping may speak of; section [m2] of the belt."""
    listed = table_settings([t for t in tables if t.logged.kind == "settings"], section)
    blocks = [b for t in tables if t.logged.kind == "record" for b in blocks_of(t)]
    missing: list[Question] = []
    parts: dict[str, list[AssembledRun]] = {}
    for block in blocks:
        entry = mapping.runs.get(block.name, RunEntry())
        made = None if entry.skip else _assemble(block, entry, mapping, listed, section)
        if made is not None:
            parts.setdefault(block.name, []).append(made)
        elif not entry.skip:
            missing = [_SPEED]
    return [_join_files(p) for p in parts.values()], missing, [*dict.fromkeys(b.name for b in blocks), *listed]


_SPEED = Question(
    path=("all_runs", "speed"),
    text="the files have time but neither travel nor speed; how fast did the belt run?",
    example="0.5 m/s",
)


def _assemble(
    block: LoggedBlock, entry: RunEntry, mapping: MappingEntry, listed: Mapping[str, Settings], section: float
) -> AssembledRun | None:
    """One run; None where its travel takes a speed that nobody has told. entry: what the mapping says of it."""
    stated = stated_settings(mapping, block.name, listed.get(block.name, {}), section)
    named = name_settings(block.text, section)
    speed = (named | stated).get("speed")
    travel = travel_of(block, speed.value if speed else None)
    if travel is None:
        return None
    if len(travel.keep) < FEWEST:
        raise block.refuse(0, "rows", len(travel.keep), "", f"run {block.name} has too few rows with time or travel")
    logged = yaw_settings(block, travel, stated) | column_settings(block, travel, section)
    known = travel_settings(travel) | named | logged | stated  # of each the last that has it
    known |= yaw_time_settings(travel, known)
    notes = (*travel.notes, f"yaw_at is {known['yaw_at'].source}") if "yaw_at" in known else travel.notes
    signals = {u.name: u.si(block.rows[travel.keep]) for u in block.table.columns if u.role == "signal"}
    signals = {n: y for n, y in signals.items() if np.isfinite(y).any()}
    if mapping.spikes == "leave_out":
        signals, said = _leave_out_spikes(block, travel.keep, signals)
        notes = (*notes, *said)
    timed = {} if travel.time is None else {TIME: travel.time}
    record = pd.DataFrame(timed | signals, index=travel.travel)
    file, started = block.table.logged.file.name, _clock_time(block, int(travel.keep[0]))
    return AssembledRun(
        key=block.name, entry=entry, record=record, settings=known, file=file, started=started, notes=notes
    )


def _leave_out_spikes(
    block: LoggedBlock, keep: np.ndarray, signals: dict[str, np.ndarray]
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Signals with single readings that jump away and back blanked, and a remark that names their lines."""
    out, said = dict(signals), []
    for name, y in signals.items():
        there = np.flatnonzero(np.isfinite(y))
        spikes = there[few_spikes(y[there], resolution(y[there]), lone=SPIKE)]
        if len(spikes):
            lines = [block.line(int(keep[k])) for k in spikes]
            what = f"{len(lines)} readings jump" if len(lines) > 1 else "a reading jumps"
            said.append(
                f"{name}: {what} away and back, left out (line {shortlist(lines)}); spikes: keep would keep them"
            )
            out[name] = y.copy()
            out[name][spikes] = np.nan
    return out, said


def _clock_time(block: LoggedBlock, row: int) -> str:
    """Date and time of day of a row of the run."""
    times = (u for u in block.table.columns if u.role == "time" and u.column.stamp)
    seconds = next((u.si(block.rows)[row] for u in times), np.nan)
    if not np.isfinite(seconds):
        return ""
    moment = datetime(1970, 1, 1) + timedelta(seconds=float(seconds))
    return (moment if seconds > DAY else moment.time()).isoformat(timespec="seconds")


def _join_files(parts: list[AssembledRun]) -> AssembledRun:
    """One run from several files: its records on all their travels; settings of the first that has them."""
    settings = {k: s for p in reversed(parts) for k, s in p.settings.items()}
    notes = tuple(dict.fromkeys(n for p in parts for n in p.notes))
    files = ", ".join(dict.fromkeys(p.file for p in parts))
    return replace(
        parts[0], record=merge_records([p.record for p in parts]), settings=settings, notes=notes, file=files
    )


def check_run_names(mapping: MappingEntry, names: list[str]) -> None:
    """Raises InputError for a run of the mapping that no file has."""
    for name in mapping.runs:
        if name not in names:
            raise InputError(f"runs.{name}", name, "", f"no file has such a run; {did_you_mean(name, names)}")
