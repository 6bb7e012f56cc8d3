"""Runs of all records and of tables of rates, each with its settings; repeats among them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from typing import Any

import numpy as np
import pandas as pd

from belt_sim.campaign import Run
from belt_sim.campaign.problems import did_you_mean, shortlist
from belt_sim.campaign.quality.bad_readings import SPIKE, few_spikes
from belt_sim.campaign.quality.record import resolution
from belt_sim.campaign.run_tables import RATES, REPEAT_TOLERANCE
from belt_sim.campaign.types import SteadyRate
from belt_sim.errors import InputError
from belt_sim.importing.columns import UsedTable
from belt_sim.importing.mapping import MappingEntry, RunEntry
from belt_sim.importing.roles import DAY
from belt_sim.importing.settings import (
    Settings,
    column_settings,
    name_settings,
    questions,
    stated_settings,
    table_settings,
    travel_settings,
    yaw_settings,
    yaw_time_settings,
)
from belt_sim.importing.travel import FEWEST, TIME, LoggedBlock, blocks_of, merge_records, run_name, travel_of
from belt_sim.importing.types import Question
from belt_sim.importing.units import UNITS, quantity
from belt_sim.si import DEGREE, N_PER_MM2, round_digits


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
    questions: list[Question] = []
    found: dict[str, list[AssembledRun]] = {}
    for block in (b for t in tables if t.logged.kind == "record" for b in _blocks(t)):
        made = _assemble(block, mapping, listed, section)
        if made is None:
            questions.append(_SPEED)
        elif not made.entry.skip:
            found.setdefault(block.name, []).append(made)
    names = [*dict.fromkeys([*found, *mapping.runs])] if questions else [*found]
    return [_join_files(parts) for parts in found.values()], questions[:1], [*names, *listed]


_SPEED = Question(
    path=("all_runs", "speed"),
    text="the files have time but neither travel nor speed; how fast did the belt run?",
    example="0.5 m/s",
)


def _blocks(table: UsedTable) -> list[LoggedBlock]:
    """The runs of a table; its columns may belong to different runs, or have travels of their own."""
    own = [u for u in table.columns if u.entry.run or u.entry.against]
    travels = {u.entry.against for u in own if u.entry.against}
    base = tuple(u for u in table.columns if u not in own and u.column.name not in travels)
    found: list[LoggedBlock] = []
    for u in own:
        shared = tuple(b for b in base if b.role != "signal")
        if u.entry.against:
            along = next((v for v in table.columns if v.column.name == u.entry.against), None)
            if along is None:
                raise InputError(f"columns.{u.column.name}.against", u.entry.against, "", "names no column of its file")
            shared = (*(b for b in shared if b.role not in ("time", "travel")), along)
        part, run = replace(table, columns=(*shared, u)), u.entry.run
        if run is None:
            found += blocks_of(part)
        else:
            found.append(LoggedBlock(table=part, rows=np.arange(len(table.logged.lines)), name=run_name(run), text=run))
    others = blocks_of(replace(table, columns=base)) if not own or any(b.role == "signal" for b in base) else []
    return found + others


def _assemble(
    block: LoggedBlock, mapping: MappingEntry, listed: Mapping[str, Settings], section: float
) -> AssembledRun | None:
    """One run; None where its travel takes a speed that nobody has told."""
    entry = mapping.runs.get(block.name, RunEntry())
    # of each setting the last source that has it counts
    own = stated_settings(entry, f"runs.{block.name}", section)
    stated = stated_settings(mapping.all_runs, "all_runs", section) | listed.get(block.name, {}) | own
    named = name_settings(block.text, section)
    speed = (named | stated).get("speed")
    travel = travel_of(block, speed.value if speed else None)
    if travel is None:
        return None
    if len(travel.keep) < FEWEST:
        raise block.refuse(0, "rows", len(travel.keep), "", f"run {block.name} has too few rows with time or travel")
    logged = yaw_settings(block, travel, stated) | column_settings(block, travel, section)
    known = travel_settings(travel) | named | logged | stated
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


# ---- repeats

#: Digits of one setting that was logged, within SAME of each other in several runs.
SAME_DIGITS, SAME = 3, 0.01


def snap_settings(runs: list[Run], settings: list[Settings]) -> list[Run]:
    """Runs with settings that were logged and are meant to be the same brought together."""
    found = list(runs)
    for key, unit in (("tension", N_PER_MM2), ("yaw", DEGREE), ("yaw_head", DEGREE), ("speed", 1.0)):
        own = [k for k, s in enumerate(settings) if key in s and not s[key].text]
        values = _group_values(np.array([getattr(found[k], key) for k in own]))
        for k, value in zip(own, values, strict=True):
            change: dict[str, Any] = {key: round_digits(value / unit, SAME_DIGITS) * unit}
            found[k] = replace(found[k], **change)
    return found


def _group_values(values: np.ndarray) -> np.ndarray:
    """Every value as the mean of those within SAME of its neighbours in size, its sign kept."""
    out, order = values.copy(), np.argsort(np.abs(values))
    size = np.abs(values[order])
    ends = np.flatnonzero(np.diff(size) > SAME * size[1:]) + 1
    for group in np.split(order, ends):
        out[group] = np.sign(values[group]) * np.mean(np.abs(values[group])) if len(group) else 0.0
    return out


def mark_repeats(runs: list[Run], stated: list[bool]) -> tuple[list[Run], list[Run]]:
    """Runs at one setting as repeats of the first, with its settings; those that were recognised."""
    out: list[Run] = []
    found: list[Run] = []
    for run, is_stated in zip(runs, stated, strict=True):
        twin = next((f for f in out if not is_stated and f.repeat_of is None and _same(f, run)), None)
        if twin is not None:
            run = replace(run, repeat_of=twin.name, tension=twin.tension, yaw=twin.yaw, yaw_head=twin.yaw_head)
            u = math.hypot(run.yaw_at_u, run.yaw_at - twin.yaw_at)  # taken to be where the first run's was
            run = replace(run, speed=twin.speed, yaw_at=twin.yaw_at, yaw_at_u=u)
            found.append(run)
        out.append(run)
    return out, found


def _same(a: Run, b: Run) -> bool:
    near = all(
        abs(getattr(a, k) - getattr(b, k)) <= 0.5 * REPEAT_TOLERANCE * abs(getattr(a, k))
        for k in ("tension", "yaw", "yaw_head", "speed")
    )
    return near and a.direction == b.direction and abs(a.yaw_at - b.yaw_at) <= 0.05 * max(a.yaw_at, 0.0)


# ---- tables of steady rates (one row a run, as published tables and digitised figures are)


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
            settings = stated_settings(mapping.all_runs, "all_runs", section) | listed
            settings |= stated_settings(entry, f"runs.{key}", section)
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
