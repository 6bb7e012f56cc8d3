"""Runs in a logger's tables: their rows, travel, settings, and their records on one grid, counted from the yaw."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from belt_sim.campaign import Run
from belt_sim.campaign.folder import RATES, REPEAT_TOLERANCE, RUN_NUMBERS, UNKNOWN_RUN_IN
from belt_sim.campaign.quality import SPIKE, few_spikes, reading_at_yaw, resolution, scatter
from belt_sim.campaign.types import SteadyRate, did_you_mean, shortlist
from belt_sim.errors import InputError
from belt_sim.importing.columns import LoggedTable, Note
from belt_sim.importing.mapping import DAY, MappingEntry, Question, RunEntry, ask, zone_seconds
from belt_sim.units import DEGREE, N_PER_MM2, UNITS, number_of, plain_minus, quantity, round_digits, size_of

#: Column of the time [s] in a record; all others are signals.
TIME_COLUMN = "time_s"
#: A run begins anew where time or travel falls back to within this share of where the file began.
RESTART = 0.05
FEWEST_ROWS = 3  # rows of a run
#: A travel that falls back by less than this share of the record is jitter of the encoder.
JITTER = 2e-3
#: Share of the speed's median beyond which a speed of the other sign is a reversal.
REVERSAL = 0.2
#: setting -> its range, in the unit that a number without one has
RANGES = {name: bounds for name, bounds, _ in RUN_NUMBERS.values()}
#: Settings without which a run says nothing.
NEEDED = ("tension", "yaw")
#: A yaw that moves by less than this share of its largest value stands still.
STILL = 0.05
#: A logged yaw that comes back moved if it was this far off [rad]; less is taken for noise of a gauge at rest.
YAW_MOVED = 1e-4
#: Parts of a run over which a logged tension is averaged, and the sigmas of such a mean by which they must differ.
TENTHS, MOVES = 10, 6.0
#: Speed [m/s] below which the belt stands.
STOPPED = 1e-3
#: Share of a run's usual speed below which the travel stands, or creeps as a counter does that has come loose.
CREEPS = 0.01
#: Steps of a counter within which it must go on where it rolls over, and the numbers [its unit] at which counters do.
GOES_ON, FULL = 3.0, (*(10.0**k for k in range(1, 8)), *(2.0**k for k in range(8, 33)), 65.536, 32.768)
#: Usual steps of the clock that are a gap.
GAP_OF_CLOCK = 20.0
#: Steps of the travel beyond which a last row is no reading, but a total.
LAST_ROW_STEPS = 100.0
#: Quantile of the steps of a signal or a clock, of which it makes fewer than GOES_ON where it goes on.
USUAL_STEP = 0.95
#: Digits that a logged setting is rounded to, and those of a place on the belt, of up to 20000 m.
DIGITS, START_DIGITS = 4, 7


@dataclass(frozen=True)
class Setting:
    """value [SI]; source: where it comes from, in words; text: as it goes into the mapping, "" of one that was logged,
    which is read off the record again when the import is repeated; low, high [SI]: of the means over tenths of the run,
    where it moves by more than its scatter."""

    value: float
    source: str
    text: str = ""
    low: float = math.nan
    high: float = math.nan


Settings = dict[str, Setting]


class Section(NamedTuple):
    """Area [m2] and thickness [m] of the belt, nan where not known yet: a force or a force per width as a stress."""

    area: float
    thickness: float

    def stress(self, value: float, dimension: str) -> float:
        return value / {"force": self.area, "line load": self.thickness}.get(dimension, 1.0)


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


@dataclass(frozen=True)
class FoundRuns:
    """recorded: runs with a record; rated: runs of tables of steady rates, and steady: their rates; questions: on what
    nothing tells."""

    recorded: list[AssembledRun] = field(default_factory=list)
    rated: list[Run] = field(default_factory=list)
    steady: list[SteadyRate] = field(default_factory=list)
    questions: list[Question] = field(default_factory=list)


def find_runs(tables: list[LoggedTable], mapping: MappingEntry, section: Section, *, only_rates: bool) -> FoundRuns:
    """The runs of all tables, or of the tables of rates alone; section: of the belt.

    Raises InputError for a run of the mapping that no file has, and for what cannot be.
    """
    found = FoundRuns()
    names = [name for t in tables if t.kind == "rates" for name in _find_rated(t, mapping, section, found)]
    if only_rates:
        return found
    listed = table_settings([t for t in tables if t.kind == "settings"], section)
    names += listed
    files: dict[str, list[AssembledRun]] = {}
    lacks_speed = False
    records = [t for t in tables if t.kind == "record"]
    for block in [block for t in records for block in _split_runs(t, mapping, found.questions)]:
        names.append(block.name)
        entry = mapping.runs.get(block.name, RunEntry())
        if entry.skip:
            continue
        stated = stated_settings(mapping, block.name, listed, section)
        run = _assemble(block, entry, stated, mapping, section, found.questions)
        if run is None:
            lacks_speed = True
        else:
            files.setdefault(block.name, []).append(run)
    strange = next((name for name in mapping.runs if name not in names), None)
    if strange is not None and not lacks_speed:
        raise InputError(f"runs.{strange}", strange, "", f"no file has such a run; {did_you_mean(strange, names)}")
    for parts in files.values():  # one run from several files: of each setting the first that has it
        settings = {k: s for p in reversed(parts) for k, s in p.settings.items()}
        record = parts[0].record
        if len(parts) > 1:
            record = pd.concat([p.record for p in parts]).groupby(level=0).last()
            if not all(TIME_COLUMN in p.record for p in parts):
                record = record.drop(columns=TIME_COLUMN, errors="ignore")
        notes = tuple(dict.fromkeys(n for p in parts for n in p.notes))
        file = ", ".join(dict.fromkeys(p.file for p in parts))
        found.recorded.append(replace(parts[0], record=record, settings=settings, notes=notes, file=file))
    if lacks_speed:
        found.questions.append(ask("speed"))
    lacking = [(run, key) for run in found.recorded for key in NEEDED if key not in run.settings]
    found.questions.extend(ask(key, run=run.key, file=run.file) for run, key in lacking)
    return found


# ---- which rows and columns of a table are one run


def _split_runs(table: LoggedTable, mapping: MappingEntry, open_questions: list[Question]) -> list[LoggedTable]:
    """The runs of a table; its columns may belong to different runs, or have travels of their own."""
    table = replace(table, notes=())  # those of the whole file are told already
    own = [c for c in table.columns if c.entry.run or c.entry.against]
    travels = {c.entry.against for c in own if c.entry.against}
    base = tuple(c for c in table.columns if not (c.entry.run or c.entry.against or c.name in travels))
    shared = tuple(c for c in base if c.role != "signal")
    found: list[LoggedTable] = []
    for column in own:
        columns, run, against = (*shared, column), column.entry.run, column.entry.against
        if against:
            along = next((c for c in table.columns if c.name == against), None)
            if along is None:
                raise InputError(f"columns.{column.name}.against", against, "", "names no column of its file")
            columns = (*(c for c in shared if c.role not in ("time", "travel")), along, column)
        part = replace(table, columns=columns)
        one = replace(part, name=run_name(run or part.name), label=run or part.label)
        found += [one] if run is not None else _split_rows(part, mapping, open_questions)
    if not own or len(shared) < len(base):
        found += _split_rows(replace(table, columns=base), mapping, open_questions)
    return found


def _count_on(table: LoggedTable) -> LoggedTable:
    """The table with its travel mended, and told of it: blank where the counter reads one far-off number (0, 1500) for
    some rows and then goes on from where it was; counted on where it rolls over. A fall to where the file began is a
    new run."""
    column = table.column("travel")
    values = column.values.astype(float) if column is not None and not column.is_text else np.empty(0)
    there = np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[there])
    if column is None or len(steps) < FEWEST_ROWS or np.mean(steps < 0.0) > 0.5 or not np.any(steps > 0.0):
        return table
    usual, notes, lost = float(np.median(steps[steps > 0.0])), list(table.notes), list[int]()
    begins = values[there][1:] <= values[there[0]] + RESTART * np.ptp(values[there])
    least = JITTER * float(np.ptp(values[there]))
    away = (begins & (steps < -least)) | (steps > GOES_ON * usual)
    for k in np.flatnonzero(away).tolist():
        before, later = values[there[k]], values[there[k + 1 :]]
        rows = int(np.argmax(later != later[0]))
        returns = later[0] < before or later[0] - later[rows] > least
        if rows and returns and 0.0 <= later[rows] - before <= GOES_ON * usual * (rows + 1):
            lost += (gone := there[k + 1 : k + 1 + rows].tolist())
            lines, way = shortlist(table.lines[gone]), "drops" if later[0] < before else f"jumps to {later[0]:.6g}"
            notes.append(Note("", f"{column.name} {way} and comes back: left out (line {lines})"))
    if steps[-1] > LAST_ROW_STEPS * usual:
        lost.append(int(there[-1]))
        notes.append(Note("", f"{column.name} is {values[lost[-1]]:.6g} in the last row, far off all others: left out"))
    if lost:
        values = values.copy()
        values[lost] = np.nan
        there = np.setdiff1d(there, lost)
        steps = np.diff(values[there])
    falls, most = np.flatnonzero(steps < 0.0), values[there].max()
    at_full = (f for f in FULL if most <= f and len(falls) and np.all(abs(steps[falls] + f - usual) <= GOES_ON * usual))
    full = next(at_full, 0.0)
    if full and values[there[0]] - values[there[falls + 1]].max() > GOES_ON * usual:
        for row in there[falls + 1].tolist():
            values = values + full * (np.arange(len(values)) >= row)
            where = f"rolls over at {full:g} {column.unit} (line {table.lines[row]})"
            notes.append(Note("", f"{column.name} {where}: counted on there"))
    columns = tuple(replace(c, values=values) if c is column else c for c in table.columns)
    return replace(table, columns=columns, notes=tuple(notes))


def _split_rows(table: LoggedTable, mapping: MappingEntry, open_questions: list[Question]) -> list[LoggedTable]:
    """The runs of one table: by its run column, else where the file begins anew, or its time or travel falls back to
    where it began. Where the readings go on over such a fall, whether a new run began is asked."""
    run, rows = table.column("run"), np.arange(len(table.lines))
    if run is not None:
        of_row = np.array(run.labels, dtype=object)
        labels = dict.fromkeys(label for label in run.labels if label)
        return [replace(table.select_rows(of_row == n), name=run_name(n), label=n) for n in labels]
    table = _count_on(replace(table, name=run_name(table.name), label=table.name))
    column, restarts, notes = table.column("travel") or table.column("time"), list[int](), list(table.notes)
    values = np.empty(0) if column is None or column.is_text else column.si()
    there = np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[there])
    if column is not None and len(there) >= FEWEST_ROWS and np.mean(steps < 0.0) <= 0.5:  # else it falls throughout
        reach = RESTART * float(np.ptp(values[there]))
        back = (steps < -reach) & (values[there][1:] <= values[there][0] + reach)
        for k in np.flatnonzero(back).tolist():
            row, unit = int(there[k + 1]), UNITS[column.unit][1]
            ends = " to ".join(f"{values[there[j]] / unit:.6g}" for j in (k, k + 1))
            fall = f"{column.name} falls from {ends} {column.unit} (line {table.lines[row]})"
            asked = row not in table.starts and _readings_go_on(table, row)
            if asked and mapping.format.counter is None:
                counter = "clock" if column.role == "time" else "counter"
                open_questions.append(ask("counter", fall=fall, counter=counter))
            if asked and mapping.format.counter == "goes_on":
                more = (values[there[k]] - values[row] + float(np.median(steps[steps > 0.0]))) / column.factor
                later = np.arange(len(values)) >= row
                goes_on = replace(column, values=column.values + more * later)
                table = replace(table, columns=tuple(goes_on if c is column else c for c in table.columns))
                column = goes_on
                notes.append(Note("", f"{fall}: counted on there, as format: {{counter: goes_on}} says"))
            elif row not in table.starts:
                restarts.append(row)
                notes.append(Note("", f"{fall}: a new run begins there"))
    whole = replace(table, notes=tuple(notes))
    parts = [p for p in np.split(rows, sorted({*table.starts, *restarts})) if len(p) >= FEWEST_ROWS]
    if len(parts) < 2:
        return [whole]
    return [replace(whole.select_rows(part), name=f"{whole.name}_{k}") for k, part in enumerate(parts, start=1)]


def _readings_go_on(table: LoggedTable, row: int) -> bool:
    """Whether signals and clock of a table go on over a row as they do elsewhere; the clock beside a travel only."""
    roles = ("signal", "time") if table.column("travel") else ("signal",)
    moving = [c for c in table.columns if c.role in roles and not c.is_text]
    for values in (c.values for c in moving):
        there = np.flatnonzero(np.isfinite(values))
        steps, at = np.abs(np.diff(values[there])), int(np.searchsorted(there, row)) - 1
        if 0 <= at < len(steps) and steps[at] > GOES_ON * float(np.quantile(steps, USUAL_STEP)):
            return False
    return any(c.role == "signal" for c in moving)


# ---- one run


def _assemble(
    block: LoggedTable,
    entry: RunEntry,
    stated: Settings,
    mapping: MappingEntry,
    section: Section,
    open_questions: list[Question],
) -> AssembledRun | None:
    """One run; None where its travel takes a speed that nobody has told. stated: settings by the mapping."""
    block = _count_on(block)
    named = name_settings(block.label, section)
    speed = (named | stated).get("speed")
    way = travel_of(block, speed.value if speed else None, mapping.format.standstill, open_questions)
    if way is None:
        return None
    if len(way.keep) < FEWEST_ROWS:
        raise block.refuse(0, "rows", len(way.keep), "", f"run {block.name} has too few rows with time or travel")
    block = block.select_rows(way.keep)
    logged = yaw_settings(block, way.travel, stated) | column_settings(block, section)
    known = way.settings | named | logged | stated  # of each the last that has it
    notes = [*(n.text for n in block.notes), *way.notes]
    if "yaw_at" in known:
        notes.append(f"yaw_at is {known['yaw_at'].source}")
    signals = {c.signal: c.si() for c in block.columns if c.role == "signal"}
    signals = {name: y for name, y in signals.items() if np.isfinite(y).any()}
    for name, y in signals.items() if mapping.spikes == "leave_out" else ():
        there = np.flatnonzero(np.isfinite(y))
        spikes = there[few_spikes(y[there], resolution(y[there]), lone=SPIKE)]
        if len(spikes):
            y[spikes] = np.nan
            what = f"{len(spikes)} readings jump" if len(spikes) > 1 else "a reading jumps"
            lines = shortlist(block.lines[spikes])
            notes.append(f"{name}: {what} away and back, left out (line {lines}); spikes: keep would keep them")
    clock, started = next((c for c in block.columns if c.role == "time" and c.stamp), None), ""
    if clock is not None and np.isfinite(seconds := float(clock.si()[0])):  # date and time of day of the first row
        moment = datetime(1970, 1, 1) + timedelta(seconds=seconds + zone_seconds(clock.zone))
        zone = clock.zone or mapping.format.zone or ""
        zone = "+00:00" if zone in ("Z", "UTC", "GMT") else zone
        is_day = seconds >= 2.0 * DAY
        started = moment.isoformat(timespec="seconds") + zone if is_day else moment.time().isoformat("seconds")
    timed = {} if way.time is None else {TIME_COLUMN: way.time}
    record, file = pd.DataFrame(timed | signals, index=way.travel), block.file.name
    own: dict[str, Any] = {"key": block.name, "entry": entry, "record": record, "settings": known}
    return AssembledRun(**own, file=file, started=started, notes=tuple(notes))


# ---- how far the belt has travelled: as logged, or from time and speed


class Travel(NamedTuple):
    """keep: rows of the run that are used; travel [m] and time [s] (None where not logged) at these, from 0 on;
    settings: direction and speed as they show in these."""

    keep: np.ndarray
    travel: np.ndarray
    time: np.ndarray | None
    settings: Settings
    notes: list[str]


def travel_of(
    block: LoggedTable, speed: float | None, standstill: str | None, open_questions: list[Question]
) -> Travel | None:
    """The travel of one run; None when it takes a speed that nobody has told. speed [m/s]: where none was logged;
    standstill: what the mapping says of a travel that stands while the time goes on."""
    time, notes = _time(block)
    logged, speeds, sign, stood = block.values("travel"), block.values("speed"), 1.0, np.zeros(2)
    if logged is not None:
        keep, way, sign = _logged_travel(block, logged, time, notes)
        way, stood = _over_standstills(block, keep, way, time, standstill, notes, open_questions)
    elif time is None:
        return None
    else:
        keep = np.flatnonzero(np.isfinite(time))
        if speeds is not None:  # by the trapezoidal rule
            there = np.flatnonzero(np.isfinite(speeds))
            pace = np.interp(keep, there, speeds[there])
            usual = float(np.median(pace[pace != 0.0])) if np.any(pace) else 0.0
            if usual == 0.0:
                remedy = "the belt stands still throughout; give a record of a running belt"
                raise block.refuse(0, "speed", 0.0, "m/s", remedy)
            other = np.flatnonzero(pace * np.sign(usual) < -REVERSAL * abs(usual))
            if len(other):
                remedy = "the belt reverses within a run; cut the record there, one run a direction"
                raise block.refuse(keep[other[0]], "speed", float(pace[other[0]]), "m/s", remedy)
            steps = 0.5 * (pace[1:] + pace[:-1]) * np.diff(time[keep])
            way, sign = np.concatenate([[0.0], np.cumsum(np.abs(steps))]), float(np.sign(usual))
            notes.append("travel was integrated from time and speed")
        elif speed is None:
            return None
        else:
            way = abs(speed) * (time[keep] - time[keep[0]])
            notes.append(f"travel was taken as time x {abs(speed):g} m/s")
    steps = np.diff(time[keep]) if time is not None and logged is None else np.empty(0)
    if len(steps) and steps.max() > GAP_OF_CLOCK * np.median(steps):
        k = int(np.argmax(steps))
        far = f"{steps[k]:.4g} s behind line {block.lines[keep[k]]}, over which the belt is taken to have run on"
        notes.append(f"no rows for {far} ({way[k + 1] - way[k]:.4g} m)")
    settings = {"direction": Setting(-1.0, "the sign of travel or speed")} if sign < 0.0 else {}
    own = None if time is None else time[keep] - time[keep[0]]
    if own is not None and len(own) and own[-1] > 0.0 and way[-1] > 0.0:
        far, lasted = np.array([way[-1], own[-1]]) - stood
        settings["speed"] = Setting(round_digits(float(far / lasted), DIGITS), "travel over time")
    return Travel(keep, way, own, settings, notes)


def _time(block: LoggedTable) -> tuple[np.ndarray | None, list[str]]:
    """Time [s], strictly rising; repeated stamps are spread evenly. Raises CampaignError where it runs backwards."""
    time = block.values("time")
    if time is None:
        return None, []
    there = np.flatnonzero(np.isfinite(time))
    steps = np.diff(time[there])
    back = np.flatnonzero(steps < 0.0)
    if len(back):
        k = there[back[0] + 1]
        remedy = f"time runs backwards; the row before has {time[there[back[0]]]:.15g}; mend or cut the record there"
        raise block.refuse(k, "time", float(time[k]), "s", remedy)
    if np.all(steps > 0.0):
        return time, []
    first = there[np.concatenate([[True], steps > 0.0])]
    if len(first) < 2:
        raise block.refuse(0, "time", float(time[there[0]]), "s", "time stands still; give a column that rises")
    spread = np.interp(there, first, time[first])
    last = there > first[-1]
    rate = (time[first[-1]] - time[first[0]]) / (first[-1] - first[0])
    spread[last] = time[first[-1]] + rate * (there[last] - first[-1])
    out = np.full(len(time), np.nan)
    out[there] = spread
    return out, ["several rows have one time stamp: they were spread evenly"]


def _logged_travel(
    block: LoggedTable, travel: np.ndarray, time: np.ndarray | None, notes: list[str]
) -> tuple[np.ndarray, np.ndarray, float]:
    """Rows with travel, and it at these as logged, from 0 on and rising whichever way the belt runs, and its sign; rows
    where it stands still fall together."""
    there = np.isfinite(travel) if time is None else np.isfinite(travel) & np.isfinite(time)
    keep = np.flatnonzero(there)
    if len(keep) < 2 or np.ptp(travel[keep]) == 0.0:
        raise block.refuse(0, "travel", None, "", "travel stands still; give a column that rises")
    sign = 1.0 if travel[keep[-1]] >= travel[keep[0]] else -1.0
    way = sign * (travel[keep] - travel[keep[0]])
    highest = np.maximum.accumulate(way)
    fallen = np.flatnonzero(highest - way > JITTER * way.max())
    if len(fallen):
        k = keep[fallen[0]]
        before = travel[keep[fallen[0] - 1]]
        remedy = f"travel runs backwards; before it was {before:.15g} m; mend or cut the record there"
        raise block.refuse(k, "travel", float(travel[k]), "m", remedy)
    if np.any(way < highest):
        notes.append("the encoder jitters: where travel falls back a little it was held")
    if sign < 0.0:
        notes.append(
            "travel was counted downwards: direction -1 (or is the newest row first? then turn the rows round)"
        )
    return keep, highest, sign


def _over_standstills(
    block: LoggedTable,
    keep: np.ndarray,
    way: np.ndarray,
    logged_time: np.ndarray | None,
    standstill: str | None,
    notes: list[str],
    open_questions: list[Question],
) -> tuple[np.ndarray, np.ndarray]:
    """The travel of the rows ``keep``, carried on over stretches in which it stands or creeps and the time goes on, if
    the belt ran: by a column of speed, or by ``standstill``, which is asked once where the readings move on by more
    than scatter; and the travel [m] and the time [s] (2,) in which the belt stood."""
    time, steps, usual = np.zeros(len(way)), np.diff(way), 0.0
    paces, stood = steps, np.zeros(2)
    if logged_time is not None:
        time = logged_time[keep]
        paces = steps / np.diff(time)
        usual = float(np.median(paces[steps > 0.0]))
    ends = np.flatnonzero(np.append(paces > CREEPS * usual, True))  # the last row of each travel
    begins, found = np.concatenate([[0], ends[:-1] + 1]), way.astype(float)
    speeds = block.values("speed")
    for k in np.flatnonzero(ends - begins >= FEWEST_ROWS + 2 * np.median(ends - begins)):
        begin, end = int(begins[k]), int(ends[k])
        rows, lasted, pace = slice(begin, end + 1), time[begin : end + 1] - time[begin], usual
        crept = way[rows] - way[begin]
        lines = f"line {block.lines[keep[begin]]} to {block.lines[keep[end]]}"
        how = f"creeps on by {crept[-1]:.2g} m" if crept[-1] > 0.0 else "stands still"
        stands = f"travel {how} at {way[begin]:.6g} m in {end - begin + 1} rows ({lines})"
        stands += f" while the time goes on by {lasted[-1]:.4g} s" if usual else ""
        ran = standstill == "belt_ran" and usual > 0.0
        if usual and speeds is not None:
            pace = float(np.median(np.abs(np.nan_to_num(speeds[keep[rows]]))))
            ran = pace > STOPPED
        elif usual and standstill is None and not any(q.path[-1] == "standstill" for q in open_questions):
            for y in (c.si()[keep] for c in block.columns if c.role == "signal"):
                before, after = map(np.nanmedian, np.array_split(y[rows], 2))
                there = y[np.isfinite(y)]
                if abs(after - before) > GOES_ON * max(scatter(there), resolution(there)):
                    open_questions.append(ask("standstill", stands=stands))
                    break
        if not ran:
            stood += crept[-1], lasted[-1]
            left = "taken as counted" if crept[-1] > 0.0 else "one row is left, their mean"
            notes.append(f"{stands}: {left}" + ("" if usual else "; cut it there if the belt ran on"))
            continue
        notes.append(f"{stands}: carried on at {pace:.4g} m/s, as the belt ran")
        found[rows] += pace * lasted - crept
        later = slice(end + 1, None)
        if not np.any(way[later]) or way[end + 1] - way[end] < 0.5 * pace * (time[end + 1] - time[begin]):
            found[later] += pace * lasted[-1] - crept[-1]  # it goes on from where it stood, and has not caught up
    return found, stood


# ---- settings that are stated: by the mapping, by a table of runs, by a name


def stated_settings(mapping: MappingEntry, run: str, listed: dict[str, Settings], section: Section) -> Settings:
    """Settings of a run by all_runs, ``listed`` (tables of runs) and its own entry; of each the last that has it."""
    found: Settings = {}
    for entry, where in ((mapping.all_runs, "all_runs"), (mapping.runs.get(run, RunEntry()), f"runs.{run}")):
        texts = {key: getattr(entry, key) for key in RANGES if getattr(entry, key) is not None}
        found |= {k: Setting(_number(t, k, f"{where}.{k}", section), "the mapping", t) for k, t in texts.items()}
        found |= listed.get(run, {}) if where == "all_runs" else {}
    return found


def table_settings(tables: list[LoggedTable], section: Section) -> dict[str, Settings]:
    """Run -> settings that tables of runs state, one row a run."""
    found: dict[str, Settings] = {}
    for table in tables:
        run = table.column("run")
        labels = [f"r{k}" for k in range(1, len(table.lines) + 1)] if run is None else run.labels
        columns = [(c, c.si()) for c in table.columns if c.role in RANGES]
        for row, label in enumerate(labels):
            own = found.setdefault(run_name(label), {})
            for column, values in columns:
                if np.isfinite(values[row]):
                    value = section.stress(float(values[row]), column.dimension)
                    unit = RANGES[column.role].unit
                    text = f"{value / UNITS[unit][1]:.6g} {unit}".strip()
                    own[column.role] = Setting(value, "the table of runs", text)
    return found


def run_name(text: str) -> str:
    """A name that a run may have in a campaign: letters, digits, blanks and _ . + - only, beginning with a letter."""
    kept = "".join(c if c.isalnum() or c in "_.+- " else "_" for c in text).strip(" .+-")
    kept = " ".join(kept.split())[:60].strip()
    return f"r{kept}" if kept[:1].isdigit() or not kept else kept


_NAMED = {
    "tension": re.compile(r"(\d+(?:[.,]\d+)?) ?_?(N_?(?:/|p|per)?_?mm-?[2²]|MPa)", re.IGNORECASE),
    "yaw": re.compile(r"([+-]?(?<![\d.,])\d+(?:[.,]\d+)?) ?_?(mrad|urad|mdeg|deg|grad|°)", re.IGNORECASE),
    "speed": re.compile(r"(\d+(?:[.,]\d+)?) ?_?(m_?(?:/|p|per)_?s|m_?(?:/|p|per)_?min)(?![a-z0-9])", re.IGNORECASE),
}


def name_settings(name: str, section: Section) -> Settings:
    """Settings that the name of a file or run states: ``lauf3_10Nmm2_-0,042grad`` -> tension and yaw."""
    found: Settings = {}
    for key, pattern in _NAMED.items():
        seen = pattern.search(plain_minus(name))
        if seen:
            try:
                number, unit = f"{number_of(seen.group(1)):.15g}", seen.group(2).lower()
            except InputError:
                continue  # 10,125 has two readings
            unit = "m/min" if "min" in unit else unit if unit in ("mrad", "urad", "mdeg") else RANGES[key].unit
            text = f"{number} {unit}"
            found[key] = Setting(_number(text, key, key, section), f"the name {name}", text)
    return found


def _number(text: str, key: str, where: str, section: Section) -> float:
    """A setting [SI]; raises InputError for what cannot be."""
    bounds = RANGES[key]
    if key == "run_in" and text.strip().lower() == UNKNOWN_RUN_IN:
        return math.nan
    kinds = ("stress", "force", "line load") if key == "tension" else (bounds.dimension,)
    value, _, unit = quantity(text, kinds, bounds.unit or "1", where)
    dimension, scale = UNITS[unit]
    if dimension != bounds.dimension:
        return section.stress(value * scale, dimension)
    si = bounds.check(value, unit, name=where)
    if key == "direction" and abs(value) != 1.0:
        raise InputError(where, f"{value:g}", "", "must be 1 (upper span runs from head to tail) or -1")
    return si


# ---- settings that the record shows


def yaw_settings(block: LoggedTable, travel: np.ndarray, known: Settings) -> Settings:
    """The yaw that columns hold, and the place of its step where ``known`` has none; travel [m], shape (n,)."""
    found: Settings = {}
    for key in ("yaw", "yaw_head"):
        values = block.values(key)
        if values is None:
            continue
        there = np.flatnonzero(np.isfinite(values))
        y = values[there]
        ends = max(1, len(y) // 50)
        before, level, at, begun = float(np.median(y[:ends])), float(np.median(y[-ends:])), 0, 0
        moves = abs(level - before) > STILL * np.abs(y).max()
        beyond = (y - before) / (level - before) > 0.5 if moves else np.zeros(len(y), bool)
        step = int(np.argmax(beyond))
        if moves:
            other = np.where(np.arange(len(y)) < step, np.abs(y - before) > 0.5 * abs(level - before), ~beyond)
        else:
            level = float(np.median(y))
            other = np.abs(y - level) > max(0.5 * np.abs(y).max(), YAW_MOVED)
        if key not in known and other.sum() >= max(2, 0.02 * beyond.sum()):
            again = int(np.argmax(other))
            remedy = "the yaw moves more than once; cut the record into runs, one yaw step each"
            raise block.refuse(there[again], key, float(y[again] / DEGREE), "deg", remedy)
        if moves:
            if key not in known and abs(before) > STILL * abs(level):
                given = f"runs: {{{block.name}: {{{key}: ...}}}}"
                remedy = f"the yaw is not zero before its step; begin a run at zero yaw, or state {given}"
                raise block.refuse(there[0], key, float(before / DEGREE), "deg", remedy)
            part = (y - before) / (level - before)
            at, begun = int(there[step]), int(there[max(step - 1, 0)])
            low, high = np.flatnonzero(part[: step + 1] < 0.1), step + np.flatnonzero(part[step:] > 0.9)
            if len(low) and len(high):
                begun, at = int(there[low[-1]]), int(there[high[0]])
        found[key] = Setting(round_digits(level, DIGITS), "its column")
        if at and "yaw_at" not in known | found:
            earlier, later = travel[begun], travel[at]
            words = f"the step of {key}, somewhere within {later - earlier:.2g} m"
            u = round_digits((later - earlier) / np.sqrt(12.0), DIGITS)
            found |= {"yaw_at": Setting(0.5 * (earlier + later), words), "yaw_at_u": Setting(u, words)}
    return found


def column_settings(block: LoggedTable, section: Section) -> Settings:
    """The mean tension, the direction, where the run starts on the belt and across it, of columns that hold them."""
    found: Settings = {}
    tension, start, direction, y0 = (block.values(k) for k in ("tension", "start", "direction", "y0"))
    if y0 is not None:
        found["y0"] = Setting(float(y0[np.isfinite(y0)][0]), "its column")
    if tension is not None:
        there = tension[np.isfinite(tension)]
        tenths, error = [float(part.mean()) for part in np.array_split(there, min(TENTHS, len(there)))], scatter(there)
        moves = np.ptp(tenths) > MOVES * error * math.sqrt(len(tenths) / len(there))
        levels = [float(there.mean()), *((min(tenths), max(tenths)) if moves else ())]
        mean, *ends = (section.stress(x, block.column("tension").dimension) for x in levels)  # type: ignore[union-attr]
        found["tension"] = Setting(round_digits(mean, DIGITS), "the mean of its column", "", *ends)
    if start is not None:
        found["start"] = Setting(round_digits(float(start[np.isfinite(start)][0]), START_DIGITS), "its column")
    if direction is not None:
        found["direction"] = Setting(float(np.sign(np.nanmedian(direction))) or 1.0, "its column")
    return found


# ---- tables of steady rates: one row a run, as published tables and digitised figures are


def _find_rated(table: LoggedTable, mapping: MappingEntry, section: Section, found: FoundRuns) -> list[str]:
    """Put the runs of a table of rates, with one sigma of the rates [m/m], into ``found``; returns the names of all."""
    columns = {c.role: c for c in table.columns if c.role in RATES}
    rates, u = {role: c.si() for role, c in columns.items()}, table.values("u_rate")
    if u is None:
        first = next(iter(columns.values()))
        one = first.by_hand
        if first.entry.white is not None:
            value, _, unit = quantity(first.entry.white, ("angle",), "mm/m", f"columns.{first.name}.white")
            one = value * UNITS[unit][1]
        u = np.full(len(table.lines), one or 0.0)
        if one is None:
            found.questions.append(ask("rates", name=first.name))
    listed = table_settings([table], section)
    for row, name in enumerate(listed):
        entry, settings = mapping.runs.get(name, RunEntry()), stated_settings(mapping, name, listed, section)
        lacking = [key for key in NEEDED if key not in settings]
        found.questions.extend(ask(key, run=name, file=table.file.name) for key in lacking)
        if entry.skip or lacking:
            continue
        numbers: dict[str, Any] = {k: s.value for k, s in settings.items() if not k.startswith("yaw_at")}
        run = Run(name=entry.name or name, use=entry.use or "fit", **numbers)
        found.rated.append(run)
        own = np.array([rates[r][row] if r in rates else np.nan for r in RATES])
        found.steady.append(SteadyRate(run=run.name, rates=own, u=float(u[row])))
    return list(listed)


YAW_FROM_START = "the yaw is taken to act from the first reading on; else state where it was set: "
YAW_FROM_START += "all_runs: {yaw_at: 5 m}"
#: Samples a run that are aimed at, and the fewest that a step may leave.
AIMED, LEFT = 600, 60
#: Travel from time and speed is a little uneven; a step this share below twice the spacing still has two rows.
UNEVEN = 0.95
#: Decimals of a reading in SI that are kept.
DECIMALS = 10
#: Digits of one setting that was logged, within SAME of each other in several runs.
SAME_DIGITS, SAME = 3, 0.01


def runs_on_one_grid(
    made: list[AssembledRun], entry: MappingEntry, middles: Mapping[str, float]
) -> tuple[list[Run], list[Note], float]:
    """Runs on one grid, their readings counted from the yaw, repeats recognised; remarks; the step [m].

    middles: signal -> its reading [SI] with the belt in the middle of the pulleys, by which y0 of a run is known.
    """
    if not made:
        return [], [], 0.0
    notes: list[Note] = []
    step = size_of(entry.step_m, "m", "step_m") if entry.step_m else _step_for([m.record for m in made])
    records = [_resample(m.record, step) for m in made]
    for m, record in zip(made, records, strict=True):
        if step == 0.0 and len(record) < len(m.record):
            text = f"{len(m.record)} rows stand at {len(record)} travels: rows of one travel were averaged"
            notes.append(Note(m.key, text))
    if step > 0.0:
        rows, left = (sum(map(len, some)) for some in ([m.record for m in made], records))
        notes.append(Note("", f"{rows} rows were averaged over steps of {step:g} m: {left} rows"))
    runs = _snap_settings([_run(m) for m in made], [m.settings for m in made])
    unset = (r.name for r, m in zip(runs, made, strict=True) if r.yaw and "yaw_at" not in m.settings)
    notes += [Note(name, YAW_FROM_START) for name in unset]
    stated = [m.entry.repeat_of is not None for m in made]
    runs = _mark_repeats(runs, stated)
    found = [r for r, is_stated in zip(runs, stated, strict=True) if r.repeat_of and not is_stated]
    notes += [Note(r.name, f"repeats {r.repeat_of}, same settings") for r in found]
    blank = [r.name for r in runs if r.start is None]
    if counted := [r.name for r in runs if r.start is not None] if blank else []:
        told = f"not known, but that of {shortlist(counted)} is; state it of every run, or of none"
        raise InputError(f"runs.{blank[0]}.start", None, "m", told)
    names = dict.fromkeys(n for record in records for n in record if n != TIME_COLUMN)
    for m, record in zip(made, records, strict=True):
        if blank := [str(n) for n in names if n not in record]:
            text = f"has no {' and no '.join(blank)}, which other runs have; is its column called otherwise there?"
            notes.append(Note(m.key, text))
    off = []  # of every run: signal -> its reading at the yaw
    for record, run in zip(records, runs, strict=True):
        travel = record.index.to_numpy() - run.yaw_at
        off.append({str(n): _reading_at_yaw(travel, record[n].to_numpy()) for n in record if n != TIME_COLUMN})
    if entry.start == "yaw":
        pairs = zip(records, off, strict=True)
        records = [r.assign(**{n: np.round(r[n] - y, DECIMALS) for n, y in starts.items()}) for r, starts in pairs]
        of_signal = {n: [1e3 * starts[n] for starts in off if n in starts] for starts in off for n in starts}
        off_by = [f"{n} {min(x):.4g} to {max(x):.4g}" for n, x in of_signal.items() if max(map(abs, x)) > 1e-3]
        if off_by:
            text = f"readings are 0 at the yaw; subtracted: {', '.join(off_by)} (mm or mrad)"
            more = "" if middles else "; middle: 150 mm of a column (its reading of a centred belt) keeps the place"
            notes.append(Note("", text + more))
    out, stood = [], []
    for run, record, starts in zip(runs, records, off, strict=True):
        if run.y0 is None and (known := middles.keys() & starts):
            y0 = round_digits(float(np.mean([starts[n] - middles[n] for n in known])), DIGITS)
            run = replace(run, y0=y0)
            stood.append(1e3 * y0)
        time = record[TIME_COLUMN].to_numpy() if TIME_COLUMN in record else None
        signals = {n: record[n].to_numpy() for n in starts}
        way, yaw_at = record.index.to_numpy() + run.counted_from, run.yaw_at + run.counted_from
        if yaw_at < 0.0:
            remedy = "is before the record: state run_in too, how far the belt had run from a straight start by then"
            raise InputError(f"runs.{run.name}.yaw_at", run.yaw_at, "m", remedy)
        start = None if run.start is None else run.start - run.counted_from
        out.append(replace(run, travel=way, yaw_at=yaw_at, start=start, time=time, signals=signals))
    if stood:
        text = f"y0 by middle: {min(stood):.4g} to {max(stood):.4g} mm off the middle of the pulleys"
        notes.append(Note("", text))
    return out, notes, step


def _run(made: AssembledRun) -> Run:
    """The run of settings that are known, each checked against its range, without its record."""
    for key, setting in made.settings.items():
        bounds = RANGES[key]
        if np.isfinite(setting.value) and not bounds.holds(setting.value):
            shown = f"{setting.value / UNITS[bounds.unit][1]:.6g}"
            remedy = f"must be {bounds.low:g} to {bounds.high:g} {bounds.unit}; it came from {setting.source}"
            raise InputError(f"runs.{made.key}.{key}", shown, bounds.unit, remedy)
    values: dict[str, Any] = {"tension": np.nan, "yaw": np.nan} | {k: s.value for k, s in made.settings.items()}
    values |= {"name": made.entry.name or made.key, "use": made.entry.use or "fit"}
    return Run(repeat_of=made.entry.repeat_of, started=made.started, **values)


def _step_for(records: list[pd.DataFrame]) -> float:
    """A step [m], 1, 2 or 5 times a power of ten, that keeps some hundred samples a run; 0 where records are so sparse
    that they stay as they are, or stand at the same travels already."""
    spacing = [float(np.median(np.diff(s))) for record in records if len(s := np.unique(record.index)) > 2]
    first = max(records, key=len).index
    alike = (r.index.is_unique and np.allclose(r.index, first[: len(r)], atol=1e-6) for r in records)
    if not spacing or (len(first) <= 4 * AIMED and all(alike)):
        return 0.0
    longest = max(float(record.index[-1]) for record in records)
    least = max(longest / AIMED, UNEVEN * 2.0 * max(spacing))
    power = 10.0 ** math.floor(math.log10(least))
    step = float(next(f"{f * power:.6g}" for f in (1.0, 2.0, 5.0, 10.0) if f * power >= least * (1.0 - 1e-9)))
    return step if step <= longest / LEFT else 0.0


def _resample(record: pd.DataFrame, step: float) -> pd.DataFrame:
    """Averages over bins of ``step`` [m] about its multiples; with step 0 only rows of one travel fall together."""
    travel = record.index.to_numpy()
    means = record.groupby(np.rint(travel / step) * step if step > 0.0 else travel).mean()
    means.index = np.round(means.index, 9)
    hardly_begun = step > 0.0 and len(means) > 2 and travel[-1] < means.index[-1] - 0.25 * step
    return means.iloc[:-1] if hardly_begun else means


def _reading_at_yaw(travel: np.ndarray, y: np.ndarray) -> float:
    """Reading [SI] at the yaw, travel (n,) from there [m]: as the checks take it, or a line through the first readings
    after it where fewer than three stand before it."""
    there = np.isfinite(y)
    if (there & (travel < 0.0)).sum() >= 3:
        return reading_at_yaw(travel, y)
    s, values = travel[there], y[there]
    if not len(s):
        return 0.0
    near = s <= max(0.01 * (s[-1] - s[0]), 4.0 * float(np.median(np.diff(s))) if len(s) > 4 else 0.0)
    if near.sum() < 4:
        return float(values[0])
    return float(np.polynomial.Polynomial.fit(s[near], values[near], 1)(0.0))


# ---- runs at one setting


def _snap_settings(runs: list[Run], settings: list[Settings]) -> list[Run]:
    """Runs with settings that were logged and are meant to be the same (within SAME in size) brought to their mean."""
    found = list(runs)
    for key, unit in (("tension", N_PER_MM2), ("yaw", DEGREE), ("yaw_head", DEGREE), ("speed", 1.0)):
        own = [k for k, s in enumerate(settings) if key in s and not s[key].text]
        values = np.array([getattr(found[k], key) for k in own])
        order = np.argsort(np.abs(values))
        size = np.abs(values[order])
        for group in np.split(order, np.flatnonzero(np.diff(size) > SAME * size[1:]) + 1):
            for k in group:
                value = float(np.sign(values[k]) * np.mean(np.abs(values[group])))
                change: dict[str, Any] = {key: round_digits(value / unit, SAME_DIGITS) * unit}
                found[own[k]] = replace(found[own[k]], **change)
    return found


def _mark_repeats(runs: list[Run], stated: list[bool]) -> list[Run]:
    """Runs at one setting as repeats of the first, with its settings; stated: whether the mapping says of which."""
    out: list[Run] = []
    for run, is_stated in zip(runs, stated, strict=True):
        for twin in out:
            near = [(getattr(twin, k), getattr(run, k)) for k in ("tension", "yaw", "yaw_head", "speed")]
            apart = any(abs(x - y) > 0.5 * REPEAT_TOLERANCE * abs(x) for x, y in near)
            late = abs(twin.yaw_at - run.yaw_at) > 0.05 * max(twin.yaw_at, 0.0)
            if is_stated or twin.repeat_of is not None or apart or late or twin.direction != run.direction:
                continue
            run = replace(run, repeat_of=twin.name, tension=twin.tension, yaw=twin.yaw, yaw_head=twin.yaw_head)
            u = math.hypot(run.yaw_at_u, run.yaw_at - twin.yaw_at)  # taken to be where the first run's was
            run = replace(run, speed=twin.speed, yaw_at=twin.yaw_at, yaw_at_u=u)
            break
        out.append(run)
    return out
