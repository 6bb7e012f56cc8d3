"""Runs with their settings: by the mapping, by columns, by a table of runs, or by the name of the file."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from enum import Enum
from typing import Any

import numpy as np
import pandas as pd

from belt_sim.campaign import Run, plausible
from belt_sim.campaign.csv_tables import NUMBERS, RATES, REPEAT_TOLERANCE
from belt_sim.campaign.problems import did_you_mean
from belt_sim.campaign.quality.record import spike_mask
from belt_sim.campaign.types import SteadyRate
from belt_sim.errors import InputError
from belt_sim.importing.mapping import MappingEntry, RunEntry
from belt_sim.importing.roles import DAY, UsedColumn
from belt_sim.importing.travel import FEWEST, TIME, LoggedBlock, Travel, blocks_of, merge_records, run_name, travel_of
from belt_sim.importing.types import LoggedTable, Question
from belt_sim.importing.units import UNITS, quantity
from belt_sim.si import DEGREE, N_PER_MM2, round_digits

#: setting -> its range, in the unit that a number without one has
RANGES = {name: bounds for name, bounds, _ in NUMBERS.values()} | {"yaw_at_time": plausible.TIME}
#: A yaw that moves by less than this share of its largest value stands still.
STILL = 0.05
#: Digits that a logged setting is rounded to; and those of one setting, within SAME of each other in several runs.
DIGITS, SAME_DIGITS, SAME = 4, 3, 0.01
START_DIGITS = 7  # of up to 20000 m
_NAMED = {
    "tension": re.compile(r"(\d+(?:[.,]\d+)?) ?_?(N_?(?:/|p|per)?_?mm-?[2²]|MPa)", re.IGNORECASE),
    "yaw": re.compile(r"([+-]?(?<![\d.,])\d+(?:[.,]\d+)?) ?_?(mrad|urad|mdeg|deg|grad|°)", re.IGNORECASE),
    "speed": re.compile(r"(\d+(?:[.,]\d+)?) ?_?(m_?(?:/|p|per)_?s|m_?(?:/|p|per)_?min)(?![a-z0-9])", re.IGNORECASE),
}


class Origin(Enum):
    """Where a setting of a run comes from."""

    MAPPING = "the mapping"
    TABLE = "the table of runs"
    NAME = "its name"
    COLUMN = "its column"
    MEAN = "the mean of its column"
    STEP = "the step of the yaw"
    SIGN = "the sign of travel or speed"
    PACE = "travel over time"
    YAW_TIME = "the time of the yaw"


#: What is read off the record again when the import is repeated.
READ_AGAIN = {Origin.COLUMN, Origin.MEAN, Origin.STEP, Origin.SIGN, Origin.PACE}


@dataclass(frozen=True, kw_only=True)
class Setting:
    """value [SI]; text: as it goes into the mapping; words: where it comes from."""

    value: float
    text: str
    origin: Origin
    words: str = ""

    def __str__(self) -> str:
        return self.words or self.origin.value


Settings = dict[str, Setting]


def _setting(key: str, value: float, origin: Origin, words: str = "") -> Setting:
    """A setting that nobody has written down, its text in the usual unit."""
    unit = RANGES[key].unit
    text = f"{value / UNITS[unit][1]:.6g} {unit}".strip()
    return Setting(value=value, text=text, origin=origin, words=words)


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
    tables: list[tuple[LoggedTable, tuple[UsedColumn, ...]]], mapping: MappingEntry, section: float
) -> tuple[list[AssembledRun], list[Question], list[str]]:
    """Runs of all records, questions, and all names that the mapping may speak of; section [m2] of the belt."""
    records = [(t, u) for t, u in tables if t.kind == "record"]
    listed = _table_settings([(t, u) for t, u in tables if t.kind == "settings"], section)
    questions: list[Question] = []
    found: dict[str, list[AssembledRun]] = {}
    for table, used in records:
        for columns, run in _views(used):
            blocks = blocks_of(table, columns)
            if run is not None:
                rows = np.arange(len(table.lines))
                blocks = [LoggedBlock(table=table, used=columns, rows=rows, name=run_name(run), text=run)]
            for block in blocks:
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


def _views(used: tuple[UsedColumn, ...]) -> list[tuple[tuple[UsedColumn, ...], str | None]]:
    """The columns of each run of a table whose columns belong to different runs, or have travels of their own."""
    own = [u for u in used if u.entry.run or u.entry.against]
    travels = {u.entry.against for u in own if u.entry.against}
    base = tuple(u for u in used if u not in own and u.column.name not in travels)
    found: list[tuple[tuple[UsedColumn, ...], str | None]] = []
    for u in own:
        shared = tuple(b for b in base if b.role != "signal")
        if u.entry.against:
            along = next((v for v in used if v.column.name == u.entry.against), None)
            if along is None:
                raise InputError(f"columns.{u.column.name}.against", u.entry.against, "", "names no column of its file")
            shared = (*(b for b in shared if b.role not in ("time", "travel")), along)
        found.append(((*shared, u), u.entry.run))
    return [*found, (base, None)] if not own or any(b.role == "signal" for b in base) else found


def _assemble(
    block: LoggedBlock, mapping: MappingEntry, listed: Mapping[str, Mapping[str, float]], section: float
) -> AssembledRun | None:
    """One run; None where its travel takes a speed that nobody has told. The first source of a setting counts."""
    entry = mapping.runs.get(block.name, RunEntry())
    known = _mapping_settings(entry, f"runs.{block.name}", section)
    for key, value in listed.get(block.name, {}).items():
        known.setdefault(key, _setting(key, value, Origin.TABLE))
    known = _mapping_settings(mapping.all_runs, "all_runs", section) | known
    named = _name_settings(block.text, section)
    speed = (named | known).get("speed")
    travel = travel_of(block, speed.value if speed else None)
    if travel is None:
        return None
    if len(travel.keep) < FEWEST:
        raise block.refuse(0, "rows", len(travel.keep), "", f"run {block.name} has too few rows with time or travel")
    known = _column_settings(block, travel, section, known) | known
    known = _travel_settings(travel) | named | known
    if "yaw_at_time" in known and travel.time is not None and "yaw_at" not in known:
        where = float(np.interp(known["yaw_at_time"].value, travel.time, travel.travel))
        known["yaw_at"] = _setting("yaw_at", where, Origin.YAW_TIME)
    notes = (*travel.notes, f"yaw_at is {known['yaw_at']}") if "yaw_at" in known else travel.notes
    signals = {u.name: u.si(block.rows[travel.keep]) for u in block.used if u.role == "signal"}
    signals = {n: y for n, y in signals.items() if np.isfinite(y).any()}
    if mapping.spikes == "leave_out":
        signals, said = _leave_out_spikes(block, travel.keep, signals)
        notes = (*notes, *said)
    timed = {} if travel.time is None else {TIME: travel.time}
    record = pd.DataFrame(timed | signals, index=travel.travel)
    file = block.table.file.name
    started = _clock_time(block, int(travel.keep[0]))
    return AssembledRun(
        key=block.name, entry=entry, record=record, settings=known, file=file, started=started, notes=notes
    )


def _leave_out_spikes(
    block: LoggedBlock, keep: np.ndarray, signals: dict[str, np.ndarray]
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Signals with single readings that jump away and back blanked, and a remark that names their lines."""
    out, said = dict(signals), []
    for name, y in signals.items():
        mask = spike_mask(y)
        if mask.any():
            lines = [block.line(int(keep[k])) for k in np.flatnonzero(mask)]
            shown = ", ".join(map(str, lines[:5])) + (" ..." if len(lines) > 5 else "")
            what = f"{len(lines)} readings jump" if len(lines) > 1 else "a reading jumps"
            said.append(f"{name}: {what} away and back, left out (line {shown}); spikes: keep would keep them")
            out[name] = np.where(mask, np.nan, y)
    return out, said


def _clock_time(block: LoggedBlock, row: int) -> str:
    """Date and time of day of a row of the run."""
    seconds = next((u.si(block.rows)[row] for u in block.used if u.role == "time" and u.column.stamp), np.nan)
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


# ---- settings


def _mapping_settings(entry: RunEntry, where: str, section: float) -> Settings:
    """Settings that the mapping states; section [m2]: of the belt, for a tension given as a force."""
    texts = {key: getattr(entry, key) for key in RANGES if getattr(entry, key) is not None}
    return {
        k: Setting(value=_number(t, k, f"{where}.{k}", section), text=t, origin=Origin.MAPPING)
        for k, t in texts.items()
    }


def _name_settings(name: str, section: float) -> Settings:
    """Settings that the name of a file or run states: ``lauf3_10Nmm2_-0,042grad`` -> tension and yaw."""
    found: Settings = {}
    for key, pattern in _NAMED.items():
        seen = pattern.search(name)
        if seen:
            number, unit = seen.group(1).replace(",", "."), seen.group(2).lower()
            usual = RANGES[key].unit
            if key == "yaw":
                unit = unit if unit in ("mrad", "urad", "mdeg") else usual
            else:
                unit = "m/min" if "min" in unit else usual
            text = f"{number} {unit}"
            value = _number(text, key, key, section)
            found[key] = Setting(value=value, text=text, origin=Origin.NAME, words=f"the name {name}")
    return found


def _number(text: str, key: str, where: str, section: float) -> float:
    """A setting [SI]; raises InputError for what cannot be."""
    bounds = RANGES[key]
    kinds = (bounds.dimension, "force") if key == "tension" else (bounds.dimension,)
    value, _, unit = quantity(text, kinds, bounds.unit or "1", where)
    dimension, scale = UNITS[unit]
    if dimension == "force":
        return _stress(value * scale, section, where)
    si = bounds.check(value, unit, name=where)
    if key == "direction" and abs(value) != 1.0:
        raise InputError(where, f"{value:g}", "", "must be 1 (upper span runs from head to tail) or -1")
    return si


def _stress(force: float, section: float, where: str) -> float:
    """Tension [Pa] of a force [N] in one strand."""
    if not section:
        raise InputError(where, f"{force:g}", "N", "a force needs the belt's width and thickness; state belt")
    return force / section


def _table_settings(
    tables: list[tuple[LoggedTable, tuple[UsedColumn, ...]]], section: float
) -> dict[str, dict[str, float]]:
    """Run -> settings [SI] that tables of runs state."""
    found: dict[str, dict[str, float]] = {}
    for table, used in tables:
        run = next((u for u in used if u.role == "run"), None)
        labels = [f"r{k}" for k in range(1, len(table.lines) + 1)] if run is None else run.labels
        for row, label in enumerate(labels):
            own = found.setdefault(run_name(label), {})
            for u in used:
                value = float(u.si()[row]) if u.role in RANGES else np.nan
                if np.isfinite(value):
                    own[u.role] = _stress(value, section, u.column.name) if UNITS[u.unit][0] == "force" else value
    return found


def _column_settings(block: LoggedBlock, travel: Travel, section: float, known: Settings) -> Settings:
    """Settings that columns of the record hold: the mean tension, the direction, the yaw with the place of its
    step, where on the belt the run starts."""
    found: Settings = {}
    keep, s = travel.keep, travel.travel

    def logged_values(role: str) -> np.ndarray | None:
        values = block.values(role)
        return None if values is None or not np.isfinite(values[keep]).any() else values[keep]

    for key in ("yaw", "yaw_head"):
        values = logged_values(key)
        if values is None:
            continue
        level, at = _step(block, key, values, keep, key in known)
        found[key] = _setting(key, round_digits(level, DIGITS), Origin.COLUMN)
        if at and not {"yaw_at", "yaw_at_time"} & {*known, *found}:
            where, apart = 0.5 * (s[at - 1] + s[at]), s[at] - s[at - 1]
            words = f"the step of {key}, somewhere within {apart:.2g} m"
            found["yaw_at"] = _setting("yaw_at", where, Origin.STEP, words)
            found["yaw_at_u"] = _setting("yaw_at_u", round_digits(apart / np.sqrt(12.0), DIGITS), Origin.STEP, words)
    values = logged_values("tension")
    if values is not None:
        mean = float(np.nanmean(values))
        if any(u.role == "tension" and UNITS[u.unit][0] == "force" for u in block.used):
            mean = _stress(mean, section, "tension")
        found["tension"] = _setting("tension", round_digits(mean, DIGITS), Origin.MEAN)
    values = logged_values("start")
    if values is not None:
        first = round_digits(float(values[np.isfinite(values)][0]), START_DIGITS)
        found["start"] = _setting("start", first, Origin.COLUMN)
    values = logged_values("direction")
    if values is not None:
        sign = float(np.sign(np.nanmedian(values))) or 1.0
        found["direction"] = _setting("direction", sign, Origin.COLUMN)
    return found


def _travel_settings(travel: Travel) -> Settings:
    """Direction and speed as the record of travel shows them."""
    found = {"direction": _setting("direction", -1.0, Origin.SIGN)} if travel.direction < 0.0 else {}
    if travel.speed > 0.0:
        found["speed"] = _setting("speed", round_digits(travel.speed, DIGITS), Origin.PACE)
    return found


def _step(block: LoggedBlock, key: str, values: np.ndarray, keep: np.ndarray, stated: bool) -> tuple[float, int]:
    """Level of a yaw after its step, and the row of the step (0: it stood there from the beginning)."""
    there = np.flatnonzero(np.isfinite(values))
    y = values[there]
    ends = max(1, len(y) // 50)
    before, after = float(np.median(y[:ends])), float(np.median(y[-ends:]))
    change = after - before
    if abs(change) <= STILL * np.abs(y).max():
        return float(np.median(y)), 0
    beyond = (y - before) / change > 0.5
    at = int(np.argmax(beyond))
    if not stated and np.mean(beyond[at:]) < 0.98:
        again = at + int(np.argmin(beyond[at:]))
        remedy = "the yaw moves more than once; cut the record into runs, one yaw step each"
        raise block.refuse(int(keep[there[again]]), key, float(y[again] / DEGREE), "deg", remedy)
    if not stated and abs(before) > STILL * abs(after):
        given = f"runs: {{{block.name}: {{{key}: ...}}}}"
        remedy = f"the yaw is not zero before its step; begin a run at zero yaw, or state {given}"
        raise block.refuse(int(keep[there[0]]), key, float(before / DEGREE), "deg", remedy)
    return after, int(there[at])


def questions(name: str, settings: Settings, file: str) -> list[Question]:
    """Questions on settings of a run that nothing tells."""
    asked = {
        "tension": (f"at which tension was run {name} ({file})?", "10 N/mm2"),
        "yaw": (
            f"to which yaw was the tail pulley turned in run {name} ({file}; 0 for a run without yaw)?",
            "-0.042 deg",
        ),
    }
    return [Question(path=("runs", name, k), text=t, example=e) for k, (t, e) in asked.items() if k not in settings]


def check_run_names(mapping: MappingEntry, names: list[str]) -> None:
    """Raises InputError for a run of the mapping that no file has."""
    for name in mapping.runs:
        if name not in names:
            raise InputError(f"runs.{name}", name, "", f"no file has such a run; {did_you_mean(name, names)}")


# ---- repeats


def snap_settings(runs: list[Run], settings: list[Settings]) -> list[Run]:
    """Runs with settings that were logged and are meant to be the same brought together."""
    for key, unit in (("tension", N_PER_MM2), ("yaw", DEGREE), ("yaw_head", DEGREE), ("speed", 1.0)):
        logged = {Origin.COLUMN, Origin.MEAN, Origin.PACE}
        own = [k for k, s in enumerate(settings) if key in s and s[key].origin in logged]
        values = _group_values(np.array([getattr(runs[k], key) for k in own]))
        for k, value in zip(own, values, strict=True):
            change: dict[str, Any] = {key: round_digits(value / unit, SAME_DIGITS) * unit}
            runs = [*runs[:k], replace(runs[k], **change), *runs[k + 1 :]]
    return runs


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


def rates_of(
    tables: list[tuple[LoggedTable, tuple[UsedColumn, ...]]], mapping: MappingEntry, section: float
) -> RatedRuns:
    """Everything that tables of rates state."""
    found = RatedRuns()
    for table, used in tables:
        rates = {u.role: u.si() for u in used if u.role in RATES}
        u, question = _rate_spread(used)
        found.missing.extend([question] if question else [])
        for row, (key, stated) in enumerate(_table_settings([(table, used)], section).items()):
            entry = mapping.runs.get(key, RunEntry())
            settings = {k: _setting(k, v, Origin.COLUMN) for k, v in stated.items()}
            settings = _mapping_settings(mapping.all_runs, "all_runs", section) | settings
            settings |= _mapping_settings(entry, f"runs.{key}", section)
            found.names.append(key)
            found.missing.extend(questions(key, settings, table.file.name))
            if entry.skip or {"tension", "yaw"} - set(settings):
                continue
            numbers: dict[str, Any] = {k: s.value for k, s in settings.items() if not k.startswith("yaw_at")}
            name = entry.name or run_name(key)
            found.runs.append(Run(name=name, use=entry.use or "fit", **numbers))
            own = np.array([rates[r][row] if r in rates else np.nan for r in RATES])
            found.steady.append(SteadyRate(run=name, rates=own, u=0.0 if u is None else float(u[row])))
    return found


def _rate_spread(used: tuple[UsedColumn, ...]) -> tuple[np.ndarray | None, Question | None]:
    """One sigma [m/m] of the rates, row by row."""
    column = next((u for u in used if u.role == "u_rate"), None)
    if column is not None:
        return column.si(), None
    rate = next(u for u in used if u.role in RATES)
    u = rate.by_hand
    if rate.entry.white is not None:
        value, _, unit = quantity(rate.entry.white, ("angle",), "mm/m", f"columns.{rate.column.name}.white")
        u = value * UNITS[unit][1]
    if u is not None:
        return np.full(len(rate.column.values), u), None
    text = "how well are the rates known (one sigma)?"
    return None, Question(path=("columns", rate.column.name, "white"), text=text, example="0.002 mm/m")
