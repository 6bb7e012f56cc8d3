"""Read runs.csv, signals.csv and steady.csv as runs with their records and rates.

Every wrong cell becomes a ``Problem`` with file, line and remedy.
"""

import datetime
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from belt_sim import plausible
from belt_sim.campaign.problems import Problem, did_you_mean
from belt_sim.campaign.sheet import check_name
from belt_sim.campaign.types import Run, SignalSheet, SteadyRate
from belt_sim.errors import InputError
from belt_sim.plausible import Range
from belt_sim.si import UNITS

#: column -> field of Run, range, value of a blank (None: required)
NUMBERS: dict[str, tuple[str, Range, float | None]] = {
    "tension_N_per_mm2": ("tension", plausible.TENSION, None),
    "yaw_deg": ("yaw", plausible.YAW, None),
    "yaw_head_deg": ("yaw_head", plausible.YAW, 0.0),
    "speed_m_per_s": ("speed", plausible.SPEED, 0.5),
    "direction": ("direction", plausible.DIRECTION, 1.0),
    "yaw_at_m": ("yaw_at", plausible.TRAVEL, 0.0),
    "u_yaw_at_m": ("yaw_at_u", plausible.YAW_AT_U, 0.0),
    "start_m": ("start", plausible.TRAVEL, math.nan),
    "run_in_m": ("run_in", plausible.TRAVEL, 0.0),
    "y0_mm": ("y0", plausible.Y0, math.nan),
}
REQUIRED = ("run", "tension_N_per_mm2", "yaw_deg")
KNOWN = ("run", *NUMBERS, "repeat_of", "use", "started")
RATES = ("rate1", "rate2", "rate3", "rate4")
#: A repeat's stated settings may differ from its first run's by this share: set again, they are read again.
REPEAT_TOLERANCE = 0.05
#: What a repeat need not have alike.
FREE = ("yaw_at_u", "start", "run_in", "y0")


# ---- tables of any kind


@dataclass(frozen=True)
class CsvTable:
    """A table that remembers the line of every row.

    columns: name -> stripped text of every row; lines: line of every row, from 1, ascending; problems: list to which
    wrong cells are appended.
    """

    file: str
    columns: dict[str, list[str]]
    lines: list[int]
    problems: list[Problem]

    def __len__(self) -> int:
        return len(self.lines)

    def texts(self, name: str) -> list[str]:
        """Return the cells of a column, "" where it is blank or left out."""
        return self.columns.get(name, [""] * len(self))

    def numbers(self, name: str, bounds: Range, *, unit: str | None = None, blank: float | None = None) -> np.ndarray:
        """Return a column in SI, shape (rows,).

        A blank cell becomes ``blank``, or a problem if that is None. A wrong cell becomes a problem and nan.
        """
        unit = bounds.unit if unit is None else unit
        cells = self.columns[name]
        written = np.array([_number(cell) for cell in cells])
        with np.errstate(over="ignore"):  # what overflows is refused as implausible
            si = written * UNITS[unit][1]
        for row in np.flatnonzero(~bounds.holds(si)).tolist():
            si[row] = math.nan
            if not cells[row] and blank is not None:
                si[row] = blank
            elif not cells[row]:
                self.refuse(row, name, None, unit, "is blank; state a number")
            elif not math.isfinite(written[row]):
                self.refuse(row, name, cells[row], unit, "must be a finite number, with a decimal point")
            else:
                try:
                    bounds.check(float(written[row]), unit, name=name)
                except InputError as error:
                    self.refuse(row, name, error.value, unit, error.remedy)
        return si

    def refuse(self, row: int, name: str, value: object, unit: str, remedy: str) -> None:
        """Append a problem for one wrong cell."""
        line = self.lines[row]
        self.problems.append(Problem(file=self.file, line=line, name=name, value=value, unit=unit, remedy=remedy))


def _number(cell: str) -> float:
    """Return the number that a cell holds; nan where it holds none (or 1_000, which only Python reads)."""
    try:
        return math.nan if not cell or "_" in cell else float(cell)
    except ValueError:
        return math.nan


def parse_table(
    text: str, file: str, required: tuple[str, ...], known: tuple[str, ...] | None, problems: list[Problem]
) -> CsvTable | None:
    """Split a table into columns; return None if the header or the number of cells in a row is wrong.

    known: all allowed columns (None allows any). Quotes around cells are dropped, blank lines skipped.
    """
    lines = text.replace("\r\n", "\n").replace("\r", "\n").replace('"', "").split("\n")
    header, *rows = ([cell.strip() for cell in line.split(",")] for line in lines)
    filled = {line: row for line, row in enumerate(rows, start=2) if any(row)}
    if not text.strip():
        wrong = [Problem(file=file, remedy=f"the file is empty; begin with the line {','.join(required)}")]
    elif remedies := [*_header_remedies(header, required, known)]:
        wrong = [Problem(file=file, line=1, name=name, remedy=remedy) for name, remedy in remedies]
    elif not filled:
        wrong = [Problem(file=file, remedy="has a header but no rows; add them")]
    else:
        remedy = f"the header has {len(header)}; end the line with commas for blanks, write decimals with a point"
        ragged = {line: len(row) for line, row in filled.items() if len(row) != len(header)}
        wrong = [Problem(file=file, line=n, name="cells", value=many, remedy=remedy) for n, many in ragged.items()]
    if wrong:
        problems.extend(wrong)
        return None
    columns = {name: list(cells) for name, cells in zip(header, zip(*filled.values(), strict=True), strict=True)}
    return CsvTable(file, columns, [*filled], problems)


def _header_remedies(
    header: list[str], required: tuple[str, ...], known: tuple[str, ...] | None
) -> Iterator[tuple[str, str]]:
    """Yield the columns of a header that are wrong, each with its remedy."""
    for separator, called in ((";", "semicolons"), ("\t", "tabs")):
        if len(header) == 1 and separator in header[0]:
            yield "", f"columns are separated by {called}; separate them by commas and write decimals with a point"
            return
    for name, count in Counter(header).items():
        if not name:
            yield "", "a column has no name; name it or remove the comma"
        elif count > 1:
            yield name, f"column stands there {count} times; keep one"
        elif known is not None and name not in known:
            unused = [k for k in known if k not in header]
            yield name, f"unknown column; {did_you_mean(name, unused or known)}"
    for name in required:
        if name not in header:
            yield name, "column is missing; add it"


# ---- runs.csv


@dataclass(frozen=True)
class RunRows:
    """The runs of runs.csv by name, and the table in which they stand."""

    table: CsvTable
    runs: dict[str, Run]

    def refuse(self, run: str, name: str, value: object, unit: str, remedy: str) -> None:
        """Append a problem with what the row of a run states."""
        self.table.refuse(self.table.columns["run"].index(run), name, value, unit, remedy)


def read_runs(text: str, problems: list[Problem]) -> RunRows | None:
    """Return the rows of runs.csv as runs without records; None if the table itself is broken."""
    table = parse_table(text, "runs.csv", REQUIRED, KNOWN, problems)
    if table is None:
        return None
    numbers = {
        field: table.numbers(column, bounds, blank=blank)
        for column, (field, bounds, blank) in NUMBERS.items()
        if column in table.columns
    }
    _check_cells(table, numbers.get("direction", np.ones(len(table))))
    rows = RunRows(table, {})
    repeats, uses, started = (table.texts(column) for column in ("repeat_of", "use", "started"))
    for row, name in enumerate(table.columns["run"]):
        if not _name_fits(rows, row, name):
            continue
        values: dict[str, Any] = {field: float(column[row]) for field, column in numbers.items()}
        values |= {key: None for key in ("start", "y0") if math.isnan(values.get(key, 0.0))}
        if run_in := values.get("run_in", 0.0):
            values["yaw_at"] = values.get("yaw_at", 0.0) + run_in
        use: Any = uses[row] or "fit"
        rows.runs[name] = Run(name=name, repeat_of=repeats[row] or None, use=use, started=started[row], **values)
    _check_repeats(rows)
    return rows


def _check_cells(table: CsvTable, directions: np.ndarray) -> None:
    """Check that every direction, use and time of day is one."""
    for row, direction in enumerate(directions):
        if abs(direction) != 1.0 and math.isfinite(direction):
            table.refuse(row, "direction", direction, "", "must be 1 (upper span runs from head to tail) or -1")
    for row, use in enumerate(table.texts("use")):
        if use not in ("", "fit", "hold_out"):
            table.refuse(row, "use", use, "", did_you_mean(use, ("fit", "hold_out")))
    for row, moment in enumerate(table.texts("started")):
        try:
            (datetime.datetime if "-" in moment[:5] else datetime.time).fromisoformat(moment or "00:00")
        except ValueError:
            remedy = "write a date and time as 2024-05-12T13:00:00, or leave it blank"
            table.refuse(row, "started", moment, "", remedy)


def _name_fits(rows: RunRows, row: int, name: str) -> bool:
    """Check the name of a run; return whether it is one of its own."""
    table = rows.table
    if not name:
        table.refuse(row, "run", None, "", "is blank; name the run")
        return False
    try:
        check_name(name)
    except InputError as error:
        table.refuse(row, "run", name, "", error.remedy)
    if name in rows.runs:
        line = table.lines[table.columns["run"].index(name)]
        table.refuse(row, "run", name, "", f"stands already in line {line}; give every run its own name")
        return False
    return True


def _check_repeats(rows: RunRows) -> None:
    """Check that every repeat_of names a first run with the same settings."""
    for run in rows.runs.values():
        if run.repeat_of is None:
            continue
        first = rows.runs.get(run.repeat_of)
        if first is None:
            others = [name for name in rows.runs if name != run.name]
            remedy = f"no such run; {did_you_mean(run.repeat_of, others)}"
        elif first is run:
            remedy = "a run cannot repeat itself; name the first run of the series"
        elif first.repeat_of is not None:
            remedy = f"is itself a repeat; name {first.repeat_of} instead"
        else:
            _check_same_settings(rows, run, first)
            continue
        rows.refuse(run.name, "repeat_of", run.repeat_of, "", remedy)


def _check_same_settings(rows: RunRows, run: Run, first: Run) -> None:
    for column, (field, bounds, _) in NUMBERS.items():
        if field in FREE:
            continue
        own, its = (getattr(r, field) - (r.run_in if field == "yaw_at" else 0.0) for r in (run, first))
        if abs(own - its) > REPEAT_TOLERANCE * abs(its):
            shown, other = (x / UNITS[bounds.unit][1] for x in (own, its))
            remedy = f"{first.name} has {other:.6g}; a repeat has the settings of its first run"
            rows.refuse(run.name, column, float(f"{shown:.6g}"), bounds.unit, remedy)


# ---- signals.csv and steady.csv


def read_signals(
    text: str, names: frozenset[str] | None, sheets: tuple[SignalSheet, ...] | None, rows: RunRows | None, problems
) -> dict[str, Run]:
    """Return the valid runs of signals.csv by name, with their records."""
    before = len(problems)
    known = None if names is None else ("run", "travel_m", "time_s", *sorted(names))
    table = parse_table(text, "signals.csv", ("run", "travel_m"), known, problems)
    if table is None:
        return {}
    travel = table.numbers("travel_m", plausible.TRAVEL)
    time = table.numbers("time_s", plausible.TIME, blank=math.nan) if "time_s" in table.columns else None
    columns = _readings(table, sheets)
    recorded = {}
    for name, index in _rows_of_runs(table, rows).items():
        _check_rising(table, index, "travel_m", travel, "m")
        if time is not None:
            _check_rising(table, index, "time_s", time, "s")
        if rows is None or name not in rows.runs:
            continue
        if len(index) == 1 and len(problems) == before:
            remedy = "is the only reading of its run; give readings on the way, or the late rates in steady.csv"
            table.refuse(index[0], "travel_m", float(travel[index[0]]), "m", remedy)
        signals = {signal: column[index] for signal, column in columns.items() if np.isfinite(column[index]).any()}
        own = time[index] if time is not None and np.isfinite(time[index]).any() else None
        way = travel[index] + rows.runs[name].run_in
        recorded[name] = replace(rows.runs[name], travel=way, time=own, signals=signals)
        if columns and not signals and len(problems) == before:
            table.refuse(index[0], "run", name, "", "has rows but no readings; fill them in or remove the run")
    return recorded


def _readings(table: CsvTable, sheets: tuple[SignalSheet, ...] | None) -> dict[str, np.ndarray]:
    """Return the signal columns in SI; having none is a problem."""
    columns = {
        sheet.name: table.numbers(sheet.name, plausible.READING[sheet.kind], unit=sheet.unit, blank=math.nan)
        for sheet in sheets or ()
        if sheet.name in table.columns
    }
    if sheets is not None and not columns:
        stated = ", ".join(sheet.name for sheet in sheets)
        remedy = f"has no column of a signal; add {stated or 'signals to campaign.yaml'}"
        table.problems.append(Problem(file="signals.csv", line=1, remedy=remedy))
    return columns


def _rows_of_runs(table: CsvTable, rows: RunRows | None) -> dict[str, np.ndarray]:
    """Return the row indices of each run in file order; each unknown run is one problem."""
    found: dict[str, list[int]] = {}
    for row, name in enumerate(table.columns["run"]):
        found.setdefault(name, []).append(row)
    if rows is not None:
        for name in [name for name in found if name not in rows.runs]:
            remedy = "is blank; name the run" if not name else f"not in runs.csv; {did_you_mean(name, rows.runs)}"
            table.refuse(found[name][0], "run", name or None, "", remedy)
    return {name: np.array(index) for name, index in found.items()}


def _check_rising(table: CsvTable, index: np.ndarray, name: str, values: np.ndarray, unit: str) -> None:
    """Check that travel or time rises within a run; its first step back is a problem."""
    index = index[np.isfinite(values[index])]
    back = np.flatnonzero(np.diff(values[index]) <= 0.0)
    if back.size:
        row, before = index[back[0] + 1], values[index[back[0]]]
        remedy = f"must increase within a run, whichever way the belt runs; the row before has {before:.15g}"
        table.refuse(row, name, float(values[row]), unit, remedy)


def read_steady(text: str, rows: RunRows | None, problems: list[Problem]) -> tuple[SteadyRate, ...]:
    """Return the steady rates of steady.csv, one row a run."""
    table = parse_table(text, "steady.csv", ("run", "u_rate"), ("run", *RATES, "u_rate"), problems)
    if table is None:
        return ()
    u = table.numbers("u_rate", plausible.RATE_U)
    rates = np.full((4, len(table)), math.nan)
    for k, column in enumerate(RATES):
        if column in table.columns:
            rates[k] = table.numbers(column, plausible.RATE, blank=math.nan)
    found = _rows_of_runs(table, rows)
    for name, index in found.items():
        if len(index) > 1:
            table.refuse(index[1], "run", name, "", f"stands already in line {table.lines[index[0]]}; keep one row")
    for row, cells in enumerate(zip(*map(table.texts, RATES), strict=True)):
        if not any(cells):
            table.refuse(row, "run", table.columns["run"][row], "", "states no rate; fill in one of rate1 to rate4")
    return tuple(SteadyRate(run=name, rates=rates[:, index[0]], u=float(u[index[0]])) for name, index in found.items())
