"""Read runs.csv, signals.csv and steady.csv; every wrong cell becomes a ``Problem`` with file, line and remedy."""

import dataclasses
import math
from collections import Counter
from dataclasses import dataclass
from datetime import datetime, time
from typing import Any

import numpy as np

from belt_sim.campaign import plausible
from belt_sim.campaign.plausible import Range
from belt_sim.campaign.problems import Problem, did_you_mean
from belt_sim.campaign.sheet import check_name
from belt_sim.campaign.types import Run, SignalSheet, SteadyRate
from belt_sim.errors import InputError
from belt_sim.si import MM_PER_M, UNITS


@dataclass(frozen=True)
class CsvTable:
    """A comma-separated table that remembers the line of every row.

    columns: name -> stripped text of every row; lines: line of every row, from 1, ascending.
    """

    file: str
    columns: dict[str, list[str]]
    lines: np.ndarray
    problems: list[Problem]

    def __len__(self) -> int:
        return len(self.lines)

    def refuse(self, row: int, name: str, value: object, unit: str, remedy: str) -> None:
        """Append a problem for one wrong cell."""
        line = int(self.lines[row])
        self.problems.append(Problem(file=self.file, line=line, name=name, value=value, unit=unit, remedy=remedy))

    def numbers(self, name: str, bounds: Range, *, unit: str | None = None, blank: float | None = None) -> np.ndarray:
        """Return a column in SI (as written if ``bounds`` has no unit), shape (rows,).

        A blank cell becomes ``blank``, or a problem if that is None. A wrong cell becomes a problem and nan.
        """
        unit = bounds.unit if unit is None else unit
        cells, shown = self.columns[name], unit or bounds.label
        written = np.array([_number(cell) for cell in cells])
        empty = np.array([not cell for cell in cells], dtype=bool)
        typed = np.array(["_" in cell for cell in cells], dtype=bool) | (~np.isfinite(written) & ~empty)
        for row in rows_where(typed):
            self.refuse(row, name, cells[row], shown, "must be a finite number, with a decimal point")
        if blank is None:
            for row in rows_where(empty):
                self.refuse(row, name, None, shown, "is blank; state a number")
        with np.errstate(over="ignore"):  # what overflows is refused as implausible
            si = written * UNITS[unit][1]
        outside = ~bounds.holds(si) & ~typed & ~empty
        for row in rows_where(outside):
            try:
                bounds.check(float(written[row]), unit, name=name)
            except InputError as error:
                self.refuse(row, name, error.value, shown, error.remedy)
        si[empty] = math.nan if blank is None else blank
        si[typed | outside] = math.nan
        return si


def rows_where(mask: np.ndarray) -> list[int]:
    """Return the indices of the rows where a mask is true."""
    return np.flatnonzero(mask).tolist()


def _number(cell: str) -> float:
    try:
        return float(cell) if cell else math.nan
    except ValueError:
        return math.nan


def parse_table(
    text: str, file: str, required: tuple[str, ...], known: tuple[str, ...] | None, problems: list[Problem]
) -> CsvTable | None:
    """Split a table into columns; return None if the header or the number of cells in a row is wrong.

    known: all allowed columns (None allows any). Quotes around cells are dropped, blank lines skipped.
    """
    lines = text.replace("\r\n", "\n").replace("\r", "\n").replace('"', "").split("\n")
    header = [cell.strip() for cell in lines[0].split(",")]
    if not text.strip():
        problems.append(Problem(file=file, remedy=f"the file is empty; begin with the line {','.join(required)}"))
        return None
    if not _header_fits(header, file, required, known, problems):
        return None
    commas = len(header) - 1
    numbers = [n for n, line in enumerate(lines[1:], start=2) if line and not line.isspace() and line.strip(", ")]
    ragged = [n for n in numbers if lines[n - 1].count(",") != commas]
    for n in ragged:
        remedy = f"the header has {commas + 1}; end the line with commas for blanks, write decimals with a point"
        problems.append(Problem(file=file, line=n, name="cells", value=lines[n - 1].count(",") + 1, remedy=remedy))
    if ragged:
        return None
    if not numbers:
        problems.append(Problem(file=file, remedy="has a header but no rows; add them"))
        return None
    split = zip(*(lines[n - 1].split(",") for n in numbers), strict=True)
    columns = {name: [cell.strip() for cell in cells] for name, cells in zip(header, split, strict=True)}
    return CsvTable(file, columns, np.array(numbers), problems)


def _header_fits(
    header: list[str], file: str, required: tuple[str, ...], known: tuple[str, ...] | None, problems: list[Problem]
) -> bool:
    before = len(problems)

    def refuse(name: str, remedy: str) -> None:
        problems.append(Problem(file=file, line=1, name=name, remedy=remedy))

    for separator, called in ((";", "semicolons"), ("\t", "tabs")):
        if len(header) == 1 and separator in header[0]:
            remedy = f"columns are separated by {called}; separate them by commas and write decimals with a point"
            refuse("", remedy)
            return False
    for name, count in Counter(header).items():
        if not name:
            refuse("", "a column has no name; name it or remove the comma")
        elif count > 1:
            refuse(name, f"column stands there {count} times; keep one")
        elif known is not None and name not in known:
            unused = [k for k in known if k not in header]
            refuse(name, f"unknown column; {did_you_mean(name, unused or known)}")
    for name in required:
        if name not in header:
            refuse(name, "column is missing; add it")
    return len(problems) == before


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
}
REQUIRED = ("run", "tension_N_per_mm2", "yaw_deg")
KNOWN = ("run", *NUMBERS, "repeat_of", "use", "started")
RATES = ("rate1", "rate2", "rate3", "rate4")
#: A repeat's stated settings may differ from its first run's by this share: set again, they are read again.
REPEAT_TOLERANCE = 0.05


@dataclasses.dataclass(frozen=True)
class RunRows:
    """The valid runs of runs.csv, and the line of every run that it names."""

    runs: dict[str, Run]
    lines: dict[str, int]


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
    direction = numbers.get("direction", np.ones(len(table)))
    for row in rows_where(np.isfinite(direction) & (np.abs(direction) != 1.0)):
        table.refuse(row, "direction", direction[row], "", "must be 1 (upper span runs from head to tail) or -1")
    uses, repeats = _uses(table), table.columns.get("repeat_of", [""] * len(table))
    started = _clock_times(table)
    runs: dict[str, Run] = {}
    lines: dict[str, int] = {}
    for row, name in enumerate(table.columns["run"]):
        if not _name_fits(table, row, name, lines):
            continue
        lines[name] = int(table.lines[row])
        values: dict[str, Any] = {field: float(column[row]) for field, column in numbers.items()}
        if math.isnan(values.get("start", 0.0)):
            values["start"] = None
        runs[name] = Run(name=name, repeat_of=repeats[row] or None, use=uses[row], started=started[row], **values)
    _check_repeats(runs, lines, problems)
    return RunRows(runs, lines)


def _clock_times(table: CsvTable) -> list[str]:
    """Return when each run started, as written; a cell that is no ISO date or time of day is refused."""
    cells = table.columns.get("started", [""] * len(table))
    for row, cell in enumerate(cells):
        try:
            (datetime if "-" in cell else time).fromisoformat(cell or "00:00")
        except ValueError:
            table.refuse(row, "started", cell, "", "write a date and time as 2024-05-12T13:00:00, or leave it blank")
    return cells


def _uses(table: CsvTable) -> list:
    uses = [use or "fit" for use in table.columns.get("use", [""] * len(table))]
    for row, use in enumerate(uses):
        if use not in ("fit", "hold_out"):
            table.refuse(row, "use", use, "", did_you_mean(use, ("fit", "hold_out")))
    return uses


def _name_fits(table: CsvTable, row: int, name: str, lines: dict[str, int]) -> bool:
    if not name:
        table.refuse(row, "run", None, "", "is blank; name the run")
        return False
    try:
        check_name(name)
    except InputError as error:
        table.refuse(row, "run", name, "", error.remedy)
    if name in lines:
        table.refuse(row, "run", name, "", f"stands already in line {lines[name]}; give every run its own name")
        return False
    return True


def _check_repeats(runs: dict[str, Run], lines: dict[str, int], problems: list[Problem]) -> None:
    """Check that every repeat_of names a first run with the same settings."""

    def refuse(run: Run, name: str, value: object, unit: str, remedy: str) -> None:
        line = lines[run.name]
        problems.append(Problem(file="runs.csv", line=line, name=name, value=value, unit=unit, remedy=remedy))

    for run in runs.values():
        if run.repeat_of is None:
            continue
        first = runs.get(run.repeat_of)
        if first is None:
            others = [name for name in runs if name != run.name]
            refuse(run, "repeat_of", run.repeat_of, "", f"no such run; {did_you_mean(run.repeat_of, others)}")
        elif first is run:
            refuse(run, "repeat_of", run.repeat_of, "", "a run cannot repeat itself; name the first run of the series")
        elif first.repeat_of is not None:
            refuse(run, "repeat_of", run.repeat_of, "", f"is itself a repeat; name {first.repeat_of} instead")
        else:
            for column, (field, bounds, _) in NUMBERS.items():
                if field in ("yaw_at_u", "start"):
                    continue
                own, its = getattr(run, field), getattr(first, field)
                if abs(own - its) > REPEAT_TOLERANCE * abs(its):
                    shown, other = (x / UNITS[bounds.unit][1] for x in (own, its))
                    remedy = f"{first.name} has {other:.6g}; a repeat has the settings of its first run"
                    refuse(run, column, float(f"{shown:.6g}"), bounds.unit, remedy)


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
        recorded[name] = dataclasses.replace(rows.runs[name], travel=travel[index], time=own, signals=signals)
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
        for name in [name for name in found if name not in rows.lines]:
            remedy = "is blank; name the run" if not name else f"not in runs.csv; {did_you_mean(name, rows.lines)}"
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
    u = table.numbers("u_rate", plausible.RATE_U) * MM_PER_M
    rates = np.full((4, len(table)), math.nan)
    for k, column in enumerate(RATES):
        if column in table.columns:
            rates[k] = table.numbers(column, plausible.RATE, blank=math.nan) * MM_PER_M
    found = _rows_of_runs(table, rows)
    for name, index in found.items():
        if len(index) > 1:
            table.refuse(index[1], "run", name, "", f"stands already in line {table.lines[index[0]]}; keep one row")
    for row in range(len(table)):
        if not any(table.columns.get(column, [""] * len(table))[row] for column in RATES):
            table.refuse(row, "run", table.columns["run"][row], "", "states no rate; fill in one of rate1 to rate4")
    return tuple(SteadyRate(run=name, rates=rates[:, index[0]], u=float(u[index[0]])) for name, index in found.items())
