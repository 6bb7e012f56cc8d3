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
from belt_sim.campaign.folder import COUNTED, RATES, REPEAT_TOLERANCE, RUN_NUMBERS, UNKNOWN_RUN_IN
from belt_sim.campaign.quality import SPIKE, few_spikes, reading_at_yaw, resolution, scatter
from belt_sim.campaign.types import SteadyRate, did_you_mean, shortlist
from belt_sim.errors import InputError
from belt_sim.importing.columns import Column, LoggedTable, Note
from belt_sim.importing.mapping import DAY, MappingEntry, Question, RunEntry, ask, zone_seconds
from belt_sim.importing.travel import FEWEST_ROWS, GOES_ON, RESTART, count_on, running_speeds, travel_of, usual_speeds
from belt_sim.units import DEGREE, N_PER_MM2, UNITS, number_of, plain_minus, quantity, round_digits, size_of

#: Column of the time [s] in a record; all others are signals.
TIME_COLUMN = "time_s"
#: What tells a speed that follows from travel and time.
BY_TRAVEL = "travel over time"
#: Share by which a speed that is stated or logged may differ from travel over time.
SPEEDS_APART = 0.1
#: What tells a direction that no column or mapping does.
BY_SIGN = "the sign of travel or speed"
#: What tells where a yaw was set that a column shows.
YAW_STEP = "the step"
#: setting -> its range, in the unit that a number without one has
RANGES = {name: bounds for name, bounds, _ in RUN_NUMBERS.values()}
#: Settings without which a run says nothing.
NEEDED = ("tension", "yaw")
#: A yaw that moves by less than this share of its largest value stands still.
STILL_YAW = 0.05
#: A logged yaw that comes back moved if it was this far off [rad]; less is taken for noise of a gauge at rest.
YAW_MOVED = 1e-4
#: Settings that are nothing below as much [rad, m]; share of a record by which two of one counter may begin apart.
FAINT, SAME_BEGINNING = ("yaw", "yaw_head", "y0"), 1e-3
#: Parts of a run over which a logged tension is averaged, and the sigmas of such a mean by which they must differ.
TENTHS, MOVING_SIGMAS = 10, 6.0
#: Quantile of the steps of a signal or a clock, of which it makes fewer than GOES_ON where it goes on.
USUAL_STEP = 0.95
#: Decimals of a travel [m] at which rows of two files are one.
PLACE_DECIMALS = 9
#: Digits that a logged setting is rounded to, and those of a place on the belt, of up to 20000 m.
LOGGED_DIGITS, START_DIGITS = 4, 7


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


LoggedSettings = dict[str, Setting]


class Section(NamedTuple):
    """Area [m2] and thickness [m] of the belt, nan where not known yet: a force or a force per width as a stress."""

    area: float
    thickness: float

    def stress(self, value: Any, dimension: str) -> Any:
        return value / {"force": self.area, "line load": self.thickness}.get(dimension, 1.0)


@dataclass(frozen=True, kw_only=True)
class AssembledRun:
    """One run as far as it is known: key, its name in the mapping; entry: what the mapping says of it; record: time and
    signals over the travel; speeds: what tells its speed -> this [m/s]; started: date and time of day of its first row,
    "" where only seconds were logged; half_digits: signal -> half of its last digit [SI]; counts: the columns
    that tell its travel, or else its time; direction: 1, or -1 as its travel or speed is counted."""

    key: str
    entry: RunEntry
    record: pd.DataFrame
    settings: LoggedSettings
    speeds: dict[str, float]
    file: str
    started: str
    half_digits: dict[str, float]
    counts: tuple[Column, ...]
    direction: float
    notes: tuple[str, ...]


@dataclass(frozen=True)
class FoundRuns:
    """recorded: runs with a record; rated: runs of tables of steady rates, and steady: their rates; questions: on what
    nothing tells."""

    recorded: list[AssembledRun] = field(default_factory=list)
    rated: list[Run] = field(default_factory=list)
    steady: list[SteadyRate] = field(default_factory=list)
    questions: list[Question] = field(default_factory=list)


def find_runs(tables: list[LoggedTable], mapping: MappingEntry, section: Section) -> FoundRuns:
    """The runs of all tables; section: of the belt. Raises InputError for a run of the mapping that no file has, and
    for what cannot be."""
    found = FoundRuns()
    names = [name for t in tables if t.kind == "rates" for name in _find_rated(t, mapping, section, found)]
    listed = table_settings([t for t in tables if t.kind == "settings"], section)
    names += listed
    made, lacks_speed = dict[str, AssembledRun](), False
    for block in [b for t in tables if t.kind == "record" for b in _split_runs(t, mapping, found.questions)]:
        names.append(block.name)
        if mapping.runs.get(block.name, RunEntry()).skip:
            continue
        run = _assemble(block, mapping, listed, section, found.questions)
        lacks_speed |= run is None
        if run is not None:
            made[block.name] = _joined(made[block.name], run, block) if block.name in made else run
    strange = next((name for name in mapping.runs if name not in names), None)
    if strange is not None and not lacks_speed:
        raise InputError(f"runs.{strange}", strange, "", f"no file has such a run; {did_you_mean(strange, names)}")
    found.recorded.extend(made.values())
    if lacks_speed:
        found.questions.append(ask("speed"))
    lacking = [(run, key) for run in found.recorded for key in NEEDED if key not in run.settings]
    found.questions.extend(ask(key, run=run.key, file=run.file) for run, key in lacking)
    return found


def _joined(first: AssembledRun, run: AssembledRun, block: LoggedTable) -> AssembledRun:
    """One run from two of its parts, the later from ``block``: of each setting the first that has it.

    Raises CampaignError where they have other readings of one sensor, or a setting by columns that contradict. The same
    readings in other units, or fewer rows of them, are a copy.
    """
    both = [p.record.groupby(np.round(p.record.index, PLACE_DECIMALS)).last() for p in (first, run)]
    shared, others = both[0].columns.intersection(both[1].columns), list[str]()
    for name in shared.drop(TIME_COLUMN, errors="ignore"):
        one, other = (record[name].dropna() for record in both)
        at = one.index.intersection(other.index)
        rounding = 1.01 * (first.half_digits[name] + run.half_digits[name])
        rounding = min(rounding, SAME_SETTING * float(np.ptp(other)))
        if len(at) < min(len(one), len(other)) or not np.allclose(one[at], other[at], rtol=1e-9, atol=rounding):
            others.append(str(name))
    if others:
        remedy = f"stands already in {first.file} with other readings of {' and '.join(others)}; join them if the run"
        remedy += " goes on, else give every run its own name, or import each by itself"
        raise block.refuse(0, "run", block.label, "", remedy)
    ways = [p.settings.get("direction") for p in (first, run)]
    if first.direction != run.direction and not all(way and way.source != BY_SIGN for way in ways):
        remedy = f"its travel or speed has another sign than in {first.file}; mend one, or state the direction"
        raise block.refuse(0, "direction", f"{run.direction:g}", "", remedy)
    for before, count in ((c, d) for c in first.counts for d in run.counts if c.name == d.name):  # of one counter
        earlier, later = (np.unique(c.si()[np.isfinite(c.si())]) for c in (before, count))
        late, step = float(later[0] - earlier[0]), min(float(np.median(np.diff(x))) for x in (earlier, later))
        if abs(late) > max(1.01 * step, SAME_BEGINNING * float(np.ptp(earlier))):
            far, side = abs(late / count.factor), "behind" if late > 0.0 else "before"
            text = f"{far:.6g} {count.unit} {side} the first of {first.file}"
            remedy = f"{text}; begin both at one place, or name the columns apart if each counts for itself"
            raise block.refuse(0, count.name, "begins", "", remedy)
    if TIME_COLUMN in shared:
        clocks = [record[TIME_COLUMN].dropna() for record in both]
        far = min(float(clock.index[-1]) for clock in clocks)
        lasted, also_lasted = (float(np.interp(far, clock.index, clock)) for clock in clocks)
        if abs(also_lasted - lasted) > SPEEDS_APART * lasted:
            remedy = f"{far:.4g} m last {lasted:.4g} s in {first.file}; mend one"
            raise block.refuse(0, "time", f"{also_lasted:.4g}", "s", remedy)
    steps = [p.settings["yaw_at"] for p in (first, run) if "yaw_at" in p.settings]
    of_one = any(all(s.source.startswith(f"{YAW_STEP} of {key},") for s in steps) for key in ("yaw", "yaw_head"))
    if len(steps) == 2 and of_one:
        seen, also = steps
        within = 1.001 * math.sqrt(3.0) * sum(p.settings["yaw_at_u"].value for p in (first, run))
        if abs(also.value - seen.value) > within + 10.0**-PLACE_DECIMALS:
            remedy = f"{first.file} shows the step at {seen.value:.6g} m; begin both files at one place of the belt"
            raise block.refuse(0, "yaw_at", f"{also.value:.6g}", "m", remedy)
    for key, new in run.settings.items():
        old = first.settings.get(key, new)
        apart = abs(new.value - old.value) > (1e-6 if key in COUNTED else SAME_SETTING) * abs(new.value)
        apart &= key not in FAINT or max(abs(new.value), abs(old.value)) > YAW_MOVED
        if apart and new.source.endswith("its column") and old.source.endswith("its column"):
            says = f"{first.file} says {setting_text(key, old.value)} of run {block.label}"
            raise block.refuse(
                0, key, setting_text(key, new.value), "", f"{says}; mend one, or state it in the mapping"
            )
    record = both[1].combine_first(both[0])
    for name in shared.drop(TIME_COLUMN, errors="ignore"):  # of two copies the one with more digits
        if first.half_digits[name] < run.half_digits[name]:
            record[name] = both[0][name].combine_first(both[1][name])
    return replace(
        first,
        record=record if TIME_COLUMN in shared else record.drop(columns=TIME_COLUMN, errors="ignore"),
        settings=run.settings | first.settings,
        file=", ".join(dict.fromkeys([*first.file.split(", "), run.file])),
        counts=first.counts + run.counts,
        half_digits={k: min(p.half_digits.get(k, math.inf) for p in (first, run)) for k in record.columns},
        notes=tuple(dict.fromkeys(first.notes + run.notes)),
    )


# ---- which rows and columns of a table are one run


def _split_runs(table: LoggedTable, mapping: MappingEntry, open_questions: list[Question]) -> list[LoggedTable]:
    """The runs of a table; its columns may belong to different runs, or have travels of their own."""
    table = replace(table, notes=())  # those of the whole file are told already
    own = [c for c in table.columns if c.entry.run or c.entry.against]
    travels: dict[str, Column | None] = {c.entry.against: None for c in own if c.entry.against}
    travels |= {c.name: c for c in table.columns if c.name in travels}
    base = tuple(c for c in table.columns if not (c.entry.run or c.entry.against) and c.name not in travels)
    shared = tuple(c for c in base if c.role != "signal")
    found: list[LoggedTable] = []
    for column in own:
        columns, run, against = (*shared, column), column.entry.run, column.entry.against
        if against:
            if (along := travels[against]) is None:
                raise InputError(f"columns.{column.name}.against", against, "", "names no column of its file")
            columns = (*(c for c in shared if c.role not in ("time", "travel")), along, column)
        part = replace(table, columns=columns)
        one = replace(part, name=run_name(run or part.name), label=run or part.label)
        found += [one] if run is not None else _split_rows(part, mapping, open_questions)
    if not own or len(shared) < len(base):
        found += _split_rows(replace(table, columns=base), mapping, open_questions)
    return found


def _split_rows(table: LoggedTable, mapping: MappingEntry, open_questions: list[Question]) -> list[LoggedTable]:
    """The runs of one table: by its run column, else where the file begins anew, or its time or travel falls back to
    where it began. Where the readings go on over such a fall, whether a new run began is asked."""
    run, rows = table.column("run"), np.arange(len(table.lines))
    if run is not None:
        of_row = np.array(run.labels, dtype=object)
        if (blank := np.flatnonzero(of_row == "")).size:
            text = f"{run.name} is blank in line {shortlist(table.lines[blank])}: left out, as of no run"
            table = replace(table, notes=(*table.notes, Note("", text)))
        labels = dict.fromkeys(label for label in run.labels if label)
        return [replace(table.select_rows(of_row == n), name=run_name(n), label=n) for n in labels]
    table = count_on(replace(table, name=run_name(table.name), label=table.name))
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
            # whether signals go on as they do elsewhere, and beside a travel the clock
            roles, asked = ("signal", "time") if table.column("travel") else ("signal",), row not in table.starts
            moving = [c for c in table.columns if c.role in roles and not c.is_text]
            asked = asked and any(c.role == "signal" for c in moving)
            for readings in (c.values for c in moving if asked):
                rows_there = np.flatnonzero(np.isfinite(readings))
                moves, at = np.abs(np.diff(readings[rows_there])), int(np.searchsorted(rows_there, row)) - 1
                if 0 <= at < len(moves) and moves[at] > GOES_ON * float(np.quantile(moves, USUAL_STEP)):
                    asked = False
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


# ---- one run


def _assemble(
    block: LoggedTable,
    mapping: MappingEntry,
    listed: dict[str, LoggedSettings],
    section: Section,
    asked: list[Question],
) -> AssembledRun | None:
    """One run; None where its travel takes a speed that nobody has told. listed: settings by tables of runs; asked:
    open questions, to which those on this run are added."""
    block, stated = count_on(block), stated_settings(mapping, block.name, listed, section)
    # settings that the name of the file or run states: lauf3_10Nmm2_-0,042grad -> tension and yaw
    named: LoggedSettings = {}
    for key, pattern in _NAMED.items():
        if (seen := pattern.search(plain_minus(block.label))) is None:
            continue
        try:
            number, unit = f"{number_of(seen.group(1)):.15g}", seen.group(2).lower()
        except InputError:
            continue  # 10,125 has two readings
        unit = "m/min" if "min" in unit else unit if unit in ("mrad", "urad", "mdeg") else RANGES[key].unit
        text = f"{number} {unit}"
        named[key] = Setting(_number(text, key, key, section), f"the name {block.label}", text)
    speed = (named | stated).get("speed")
    way = travel_of(block, speed.value if speed else None, mapping.format.standstill, asked)
    if way is None:
        return None
    if len(way.keep) < FEWEST_ROWS:
        raise block.refuse(0, "rows", len(way.keep), "", f"run {block.name} has too few rows with time or travel")
    if lost := np.delete(block.lines, way.keep).tolist():
        way.notes.append(f"{len(lost)} rows without time or travel were left out (line {shortlist(lost)})")
    block = block.select_rows(way.keep)
    moved = {} if way.speed is None else {"speed": Setting(round_digits(way.speed, LOGGED_DIGITS), BY_TRAVEL)}
    moved |= {"direction": Setting(-1.0, BY_SIGN)} if way.direction < 0.0 else {}
    logged = logged_settings(block, way.travel, moved, stated, section)
    known = moved | named | logged | stated  # of each the last that has it
    counted, at = block.values("travel"), known.get("yaw_at")
    of_all = at and at.source == "the mapping" and at.text == mapping.all_runs.yaw_at  # whatever each counter shows
    if at and not of_all and counted is not None and counted[0] != 0.0 and not at.source.startswith(YAW_STEP):
        up = np.sign(counted[-1] - counted[0])  # as the column of travel counts, where it has that place
        if up * counted[0] <= up * at.value <= up * counted[-1]:
            place = round(float(np.interp(up * at.value, up * counted, way.travel)), PLACE_DECIMALS)
            known["yaw_at"] = replace(at, value=place, source=f"{place:g} m behind the first row, by {at.source}")
    tellers = (BY_TRAVEL, *(c.name for c in block.columns if c.role == "speed"))
    speeds = dict(zip(tellers, usual_speeds(way, block.values("speed")), strict=False))
    speeds |= {speed.source: abs(speed.value)} if speed else {}
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
        day, started = moment.isoformat(timespec="seconds").split("T")
        zone = clock.zone or mapping.format.zone or ""
        if seconds >= 2.0 * DAY:
            started = f"{day}T{started}{'+00:00' if zone in ('Z', 'UTC', 'GMT') else zone}"
    timed = {} if way.time is None else {TIME_COLUMN: way.time}
    return AssembledRun(
        key=block.name,
        entry=mapping.runs.get(block.name, RunEntry()),
        record=pd.DataFrame(timed | signals, index=way.travel),
        settings=known,
        speeds=speeds,
        file=block.file.name,
        started=started,
        half_digits={c.signal: c.half_digit for c in block.columns if c.role == "signal"},
        counts=tuple(c for c in [block.column("travel") or block.column("time")] if c and not c.is_text),
        direction=way.direction,
        notes=tuple(notes),
    )


# ---- settings that are stated: by the mapping, by a table of runs, by a name


def stated_settings(
    mapping: MappingEntry, run: str, listed: dict[str, LoggedSettings], section: Section
) -> LoggedSettings:
    """Settings of a run by all_runs, ``listed`` (tables of runs) and its own entry; of each the last that has it."""
    found: LoggedSettings = {}
    for entry, where in ((mapping.all_runs, "all_runs"), (mapping.runs.get(run, RunEntry()), f"runs.{run}")):
        for key, text in ((k, t) for k in RANGES if (t := getattr(entry, k)) is not None):
            found[key] = Setting(_number(text, key, f"{where}.{key}", section), "the mapping", text)
        found |= listed.get(run, {}) if where == "all_runs" else {}
    return found


def table_settings(tables: list[LoggedTable], section: Section) -> dict[str, LoggedSettings]:
    """Run -> settings that tables of runs state, one row a run; refused where two tables contradict by more than their
    digits are rounded; else the finer one counts."""
    found, places = dict[str, LoggedSettings](), dict[tuple[str, str], tuple[str, float]]()
    for table in tables:
        run = table.column("run")
        labels = [f"r{k}" for k in range(1, len(table.lines) + 1)] if run is None else run.labels
        names = [run_name(label) for label in labels]
        for row, name in enumerate(names):
            if (first := names.index(name)) < row:
                remedy = f"stands already in line {table.lines[first]}; give every run its own name"
                raise table.refuse(row, "run", labels[row], "", remedy)
        found = {name: {} for name in names} | found
        for column in (c for c in table.columns if c.role in RANGES):
            values, rounding = (section.stress(x, column.dimension) for x in (column.si(), column.half_digit))
            for row in np.flatnonzero(np.isfinite(values)).tolist():
                name, role, value = names[row], column.role, float(values[row])
                text, before = setting_text(role, value), found[name].get(role)
                place, coarse = places.get((name, role), ("", math.inf))
                may_differ = min(1.01 * (rounding + coarse), SAME_ROUNDED * abs(value))
                if before is not None and abs(value - before.value) > may_differ:
                    remedy = f"{place} says {before.text} of run {name}; mend one, or name the runs apart"
                    raise table.refuse(row, role, text, "", remedy)
                if rounding <= coarse:
                    found[name][role] = Setting(value, "the table of runs", text)
                    places[name, role] = f"{table.file.name}:{table.lines[row]}", rounding
    return found


def setting_text(setting: str, value: float) -> str:
    """A setting [SI] in the unit that it has without one: 10 N/mm2."""
    unit, digits = RANGES[setting].unit, 9 if setting in COUNTED else 6
    return f"{value / UNITS[unit][1]:.{digits}g} {unit}".strip()


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


def logged_settings(
    block: LoggedTable, travel: np.ndarray, moved: LoggedSettings, known: LoggedSettings, section: Section
) -> LoggedSettings:
    """The settings that columns hold, and the place of a step of the yaw where ``known`` has none; travel [m], (n,);
    moved: settings that follow from the travel."""
    # direction, speed, where the run starts on the belt and across it, and where its yaw was set
    firsts = {
        "y0": lambda y: y[0],
        "start": lambda y: round_digits(float(y[0]), START_DIGITS),
        "yaw_at": lambda y: y[0],
    }
    firsts["direction"] = lambda y: np.sign(np.median(y)) or 1.0
    found: LoggedSettings = {}
    for key, of in firsts.items():
        if (values := block.values(key)) is not None:
            found[key] = Setting(float(of(values[np.isfinite(values)])), "its column")
    if "speed" not in moved and (values := block.values("speed")) is not None:
        ran = np.abs(running_speeds(values, travel))
        found["speed"] = Setting(round_digits(float(np.median(ran)), LOGGED_DIGITS) if len(ran) else 0.0, "its column")
    if "direction" in found.keys() - known.keys() and (values := block.values("direction")) is not None:
        runs = np.flatnonzero(np.nan_to_num(values))
        turned = runs[values[runs] * values[runs[:1]] < 0.0]
        if len(turned):
            remedy = "the belt reverses within a run; cut the record there, one run a direction"
            raise block.refuse(turned[0], "direction", float(values[turned[0]]), "", remedy)
    for key in ("yaw", "yaw_head"):
        if (values := block.values(key)) is None:
            continue
        there = np.flatnonzero(np.isfinite(values))
        y = values[there]
        ends, largest = max(1, len(y) // 50), float(np.abs(y).max())
        before, level, at, begun = float(np.median(y[:ends])), float(np.median(y[-ends:])), 0, 0
        moves = abs(level - before) > STILL_YAW * largest
        part = (y - before) / (level - before) if moves else np.zeros(len(y))  # 0 before the step, 1 after it
        step = int(np.argmax(part > 0.5))
        level = level if moves else float(np.median(y))
        other = np.where(np.arange(len(y)) < step, np.abs(part) > 0.5, part <= 0.5)
        other = other if moves else np.abs(y - level) > max(0.5 * largest, YAW_MOVED)
        if key not in known and other.sum() >= max(2, 0.02 * np.sum(part > 0.5)):
            again = int(np.argmax(other))
            remedy = "the yaw moves more than once; cut the record into runs, one yaw step each"
            raise block.refuse(there[again], key, float(y[again] / DEGREE), "deg", remedy)
        if moves:
            if key not in known and abs(before) > STILL_YAW * abs(level):
                given = f"runs: {{{block.name}: {{{key}: ...}}}}"
                remedy = f"the yaw is not zero before its step; begin a run at zero yaw, or state {given}"
                raise block.refuse(there[0], key, float(before / DEGREE), "deg", remedy)
            low, high = np.flatnonzero(part[: step + 1] < 0.1), step + np.flatnonzero(part[step:] > 0.9)
            sharp = (low[-1], high[0]) if len(low) and len(high) else (max(step - 1, 0), step)
            begun, at = (int(there[row]) for row in sharp)
        found[key] = Setting(round_digits(level, LOGGED_DIGITS), "its column")
        if at and "yaw_at" not in known | found:
            earlier, later = travel[begun], travel[at]
            words = f"{YAW_STEP} of {key}, somewhere within {later - earlier:.2g} m"
            u = round_digits((later - earlier) / np.sqrt(12.0), LOGGED_DIGITS)
            found |= {"yaw_at": Setting(0.5 * (earlier + later), words), "yaw_at_u": Setting(u, words)}
    if (tension := block.values("tension")) is not None:
        there = tension[np.isfinite(tension)]
        tenths, error = [float(part.mean()) for part in np.array_split(there, min(TENTHS, len(there)))], scatter(there)
        moves = np.ptp(tenths) > MOVING_SIGMAS * error * math.sqrt(len(tenths) / len(there))
        levels = [float(there.mean()), *((min(tenths), max(tenths)) if moves else ())]
        mean, *extremes = (section.stress(x, block.column("tension").dimension) for x in levels)  # type: ignore[union-attr]
        found["tension"] = Setting(round_digits(mean, LOGGED_DIGITS), "the mean of its column", "", *extremes)
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
AIMED, FEWEST_LEFT = 600, 60
#: Travel from time and speed is a little uneven; a step this share below twice the spacing still has two rows.
UNEVEN = 0.95
#: Decimals of a reading in SI that are kept.
DECIMALS = 10
#: Two tables of runs say the same within this share, if their digits allow as much.
SAME_ROUNDED = 5e-3
#: Digits of one setting that was logged, within SAME_SETTING of each other in several runs.
SAME_DIGITS, SAME_SETTING = 3, 0.01


def runs_on_one_grid(
    made: list[AssembledRun], entry: MappingEntry, middles: Mapping[str, float]
) -> tuple[list[Run], list[Note], float]:
    """Runs on one grid, their readings counted from the yaw, repeats recognised; remarks; the step [m].

    middles: signal -> its reading [SI] with the belt in the middle of the pulleys, by which y0 of a run is known.
    """
    if not made:
        return [], [], 0.0
    records, step, notes = _averaged(made, entry.step_m)
    runs = _runs_of(made)
    names = dict.fromkeys(str(n) for record in records for n in record if n != TIME_COLUMN)
    notes += _remarks(made, runs, records, list(names))

    at_yaw = [  # signal -> its reading where the yaw is set, of every run
        {n: _reading_at_yaw(record.index.to_numpy() - run.yaw_at, record[n].to_numpy()) for n in names if n in record}
        for run, record in zip(runs, records, strict=True)
    ]
    out, counts = list[Run](), entry.start == "yaw"
    for run, record, zero in zip(runs, records, at_yaw, strict=True):
        if (yaw_at := run.yaw_at + run.counted_from) < 0.0:
            remedy = "is before the record: state run_in too, how far the belt had run from a straight start by then"
            raise InputError(f"runs.{run.name}.yaw_at", run.yaw_at, "m", remedy)
        y0, start, read = run.y0, run.start, {n: record[n].to_numpy() for n in zero}
        if y0 is None and (known := middles.keys() & zero):
            y0 = round_digits(float(np.mean([zero[n] - middles[n] for n in known])), LOGGED_DIGITS)
        run = replace(run, y0=y0, yaw_at=yaw_at, start=None if start is None else start - run.counted_from)
        time = record[TIME_COLUMN].to_numpy() if TIME_COLUMN in record else None
        signals = {n: np.round(y - zero[n], DECIMALS) for n, y in read.items()} if counts else read
        out.append(replace(run, travel=record.index.to_numpy() + run.counted_from, time=time, signals=signals))

    subtracted = {n: [1e3 * first[n] for first in at_yaw if n in first] for n in names}  # [mm or mrad]
    off_by = [f"{n} {min(x):.4g} to {max(x):.4g}" for n, x in subtracted.items() if max(map(abs, x)) > 1e-3]
    if off_by and counts:
        text = f"readings are 0 at the yaw; subtracted: {', '.join(off_by)} (mm or mrad)"
        more = "" if middles else "; middle: 150 mm of a column (its reading of a centred belt) keeps the place"
        notes.append(Note("", text + more))
    off_middle = [1e3 * r.y0 for r, stated in zip(out, runs, strict=True) if stated.y0 is None and r.y0 is not None]
    if off_middle:
        text = f"y0 by middle: {min(off_middle):.4g} to {max(off_middle):.4g} mm off the middle of the pulleys"
        notes.append(Note("", text))
    return out, notes, step


def _remarks(made: list[AssembledRun], runs: list[Run], records: list[Any], names: list[str]) -> list[Note]:
    """What is told of runs beside one another; raises InputError where only some state their start."""
    blank, counted = ([r.name for r in runs if (r.start is None) == unstated] for unstated in (True, False))
    if blank and counted:
        told = f"not known, but that of {shortlist(counted)} is; state it of every run, or of none"
        raise InputError(f"runs.{blank[0]}.start", None, "m", told)
    unset = (r.name for r, m in zip(runs, made, strict=True) if r.yaw and "yaw_at" not in m.settings)
    notes = [Note(name, YAW_FROM_START) for name in unset]
    for m, record in zip(made, records, strict=True):
        if lacking := [n for n in names if n not in record]:
            text = f"has no {' and no '.join(lacking)}, which other runs have; is its column called otherwise there?"
            notes.append(Note(m.key, text))
    return notes


def _runs_of(made: list[AssembledRun]) -> list[Run]:
    """The runs without their records. Logged settings that are meant to be the same (within SAME in size) are brought
    to their mean; runs at one setting repeat the first of them and have its settings, unless the mapping says which
    repeats which. Raises InputError for a setting beyond its range."""
    runs: list[Run] = []
    for m in made:
        for key, setting in m.settings.items():
            bounds = RANGES[key]
            if np.isfinite(setting.value) and not bounds.holds(setting.value):
                remedy = f"must be {bounds.low:g} to {bounds.high:g} {bounds.unit}; it came from {setting.source}"
                raise InputError(f"runs.{m.key}.{key}", setting_text(key, setting.value), "", remedy)
        values: dict[str, Any] = {"tension": np.nan, "yaw": np.nan} | {k: s.value for k, s in m.settings.items()}
        values |= {"name": m.entry.name or m.key, "use": m.entry.use or "fit"}
        runs.append(Run(repeat_of=m.entry.repeat_of, started=m.started, **values))

    for key, unit in (("tension", N_PER_MM2), ("yaw", DEGREE), ("yaw_head", DEGREE), ("speed", 1.0)):
        own = [k for k, m in enumerate(made) if key in m.settings and not m.settings[key].text]
        logged = np.array([getattr(runs[k], key) for k in own])
        order = np.argsort(np.abs(logged))
        size = np.abs(logged[order])
        for group in np.split(order, np.flatnonzero(np.diff(size) > SAME_SETTING * size[1:]) + 1) if own else ():
            mean = round_digits(float(np.mean(np.abs(logged[group]))) / unit, SAME_DIGITS) * unit
            for k in group:
                change: dict[str, Any] = {key: float(np.sign(logged[k])) * mean}
                runs[own[k]] = replace(runs[own[k]], **change)

    for k, (run, m) in enumerate(zip(runs, made, strict=True)):
        for twin in runs[:k] if m.entry.repeat_of is None else ():
            near = [(getattr(twin, n), getattr(run, n)) for n in ("tension", "yaw", "yaw_head", "speed")]
            apart = any(abs(x - y) > 0.5 * REPEAT_TOLERANCE * abs(x) for x, y in near)
            late = abs(twin.yaw_at - run.yaw_at) > 0.05 * max(twin.yaw_at, 0.0)
            if twin.repeat_of is None and not apart and not late and twin.direction == run.direction:
                u = math.hypot(run.yaw_at_u, run.yaw_at - twin.yaw_at)  # taken to be where the first run's was
                alike = {n: getattr(twin, n) for n in ("tension", "yaw", "yaw_head", "speed", "yaw_at")}
                runs[k] = replace(run, repeat_of=twin.name, yaw_at_u=u, **alike)
                break
    return runs


def _averaged(made: list[AssembledRun], stated: str | None) -> tuple[list[pd.DataFrame], float, list[Note]]:
    """Records averaged over bins about the multiples of one step, remarks, and the step [m]: as stated, else 1, 2 or 5
    times a power of ten that keeps some hundred samples a run. It is 0 where records are so sparse that they stay as
    they are, or stand at the same travels already: then only rows of one travel fall together."""
    records, step = [m.record for m in made], size_of(stated, "m", "step_m") if stated else 0.0
    spacing = [float(np.median(np.diff(s))) for record in records if len(s := np.unique(record.index)) > 2]
    first = max(records, key=len).index
    alike = (r.index.is_unique and np.allclose(r.index, first[: len(r)], atol=1e-6) for r in records)
    if not stated and spacing and not (len(first) <= 4 * AIMED and all(alike)):
        longest = max(float(record.index[-1]) for record in records)
        least = max(longest / AIMED, UNEVEN * 2.0 * max(spacing))
        power = 10.0 ** math.floor(math.log10(least))
        step = float(next(f"{f * power:.6g}" for f in (1.0, 2.0, 5.0, 10.0) if f * power >= least * (1.0 - 1e-9)))
        step = step if step <= longest / FEWEST_LEFT else 0.0

    found, notes = list[pd.DataFrame](), list[Note]()
    for m in made:
        travel = m.record.index.to_numpy()
        means = m.record.groupby(np.rint(travel / step) * step if step > 0.0 else travel).mean()
        means.index = np.round(means.index, 9)
        hardly_begun = step > 0.0 and len(means) > 2 and travel[-1] < means.index[-1] - 0.25 * step
        found.append(means.iloc[:-1] if hardly_begun else means)
        if step == 0.0 and len(means) < len(travel):
            text = f"{len(travel)} rows stand at {len(means)} travels: rows of one travel were averaged"
            notes.append(Note(m.key, text))
    if step > 0.0:
        rows, left = (sum(map(len, some)) for some in (records, found))
        notes.append(Note("", f"{rows} rows were averaged over steps of {step:g} m: {left} rows"))
    return found, step, notes


def _reading_at_yaw(travel: np.ndarray, y: np.ndarray) -> float:
    """Reading [SI] at the yaw, travel (n,) from there [m]: as the checks take it, or a line through the first readings
    after it where fewer than three stand before it."""
    there = np.isfinite(y)
    s, values = travel[there], y[there]
    if (s < 0.0).sum() >= 3 or not len(s):
        return reading_at_yaw(s, values)
    near = s <= max(0.01 * (s[-1] - s[0]), 4.0 * float(np.median(np.diff(s))) if len(s) > 4 else 0.0)
    if near.sum() < 4:
        return float(values[0])
    return float(np.polynomial.Polynomial.fit(s[near], values[near], 1)(0.0))


# ---- runs at one setting
