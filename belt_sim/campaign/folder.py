"""Read and write campaign folders (belt-campaign/1): measured, begun or only planned, or shipped with the package.

Every wrong cell of runs.csv, signals.csv and steady.csv becomes a ``Problem`` with file, line and remedy.
"""

import datetime
import hashlib
import math
import os
import secrets
import shutil
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from belt_sim.campaign.sheet import CAMPAIGN_SCHEMA, check_name, read_sheet
from belt_sim.campaign.types import (
    Campaign,
    CampaignError,
    Problem,
    Quantity,
    Run,
    SignalSheet,
    SteadyRate,
    did_you_mean,
    refusal,
)
from belt_sim.errors import InputError
from belt_sim.io import CAMPAIGNS, sample_campaigns
from belt_sim.settings import BELT, BOUNDS, Range
from belt_sim.units import MM_PER_M, UNITS

#: column -> field of Run, range, value of a blank (None: required)
RUN_NUMBERS: dict[str, tuple[str, Range, float | None]] = {
    "tension_N_per_mm2": ("tension", BOUNDS["tension"], None),
    "yaw_deg": ("yaw", BOUNDS["yaw"], None),
    "yaw_head_deg": ("yaw_head", BOUNDS["yaw"], 0.0),
    "speed_m_per_s": ("speed", BOUNDS["speed"], 0.5),
    "direction": ("direction", BOUNDS["direction"], 1.0),
    "yaw_at_m": ("yaw_at", BOUNDS["yaw_at"], 0.0),
    "u_yaw_at_m": ("yaw_at_u", BOUNDS["u_yaw_at"], 0.0),
    "start_m": ("start", BOUNDS["reading_travel"], math.nan),
    "run_in_m": ("run_in", BOUNDS["reading_travel"], 0.0),
    "y0_mm": ("y0", BOUNDS["y0"], math.nan),
}
REQUIRED = ("run", "tension_N_per_mm2", "yaw_deg")
RUNS_COLUMNS = ("run", *RUN_NUMBERS, "repeat_of", "use", "started")
RATES = ("rate1", "rate2", "rate3", "rate4")
#: A repeat's stated settings may differ from its first run's by this share: set again, they are read again.
REPEAT_TOLERANCE = 0.05
#: Cell of run_in_m where the machine ran already, for a way that nobody knows.
UNKNOWN_RUN_IN = "unknown"
#: In the file these count from the beginning of the record, in a run from its straight start: what run_in adds there.
COUNTED = {"yaw_at": 1.0, "start": -1.0}
#: What a repeat need not have alike.
FREE = ("yaw_at_u", "start", "run_in", "y0")


@dataclass(frozen=True)
class CsvTable:
    """A table that remembers the line of every row.

    columns: name -> stripped text of every row; lines: line of every row, from 1, ascending; rows: run -> its rows;
    problems: list to which wrong cells are appended.
    """

    file: str
    columns: dict[str, list[str]]
    lines: list[int]
    rows: dict[str, list[int]]
    problems: list[Problem]

    def texts(self, name: str) -> list[str]:
        """The cells of a column; blanks where there is none."""
        return self.columns.get(name, [""] * len(self.lines))

    def numbers(
        self, name: str, bounds: Range, *, unit: str | None = None, instead: Mapping[str, float] | None = None
    ) -> np.ndarray:
        """Return a column in SI, shape (rows,); instead: what cells that hold no number stand for, as {"": 0.0}.

        A wrong cell becomes a problem and nan.
        """
        unit, cells, instead = bounds.unit if unit is None else unit, self.texts(name), instead or {}
        written = np.full(len(cells), math.nan)
        for row, cell in enumerate(cells):  # nan where it holds no number (or 1_000, which only Python reads)
            with suppress(ValueError):
                written[row] = instead[cell] if cell in instead else float(cell) if "_" not in cell else math.nan
        with np.errstate(over="ignore"):  # what overflows is refused as implausible
            si = written * UNITS[unit][1]
        for row in np.flatnonzero(~bounds.holds(si)).tolist():
            cell, si[row] = cells[row], math.nan
            if not math.isfinite(written[row]) and cell not in instead:
                remedy = "must be a finite number, with a decimal point" if cell else "is blank; state a number"
                self.refuse(row, name, cell or None, unit, remedy)
            elif cell not in instead:
                try:
                    bounds.check(float(written[row]), unit, name=name)
                except InputError as error:
                    self.refuse(row, name, error.value, unit, error.remedy)
        return si

    def refuse(self, row: int | str, name: str, value: object, unit: str, remedy: str) -> None:
        """Append a problem for one wrong cell of a row, or of the first row of a run."""
        line = self.lines[self.rows[row][0] if isinstance(row, str) else row]
        self.problems.append(Problem(file=self.file, line=line, name=name, value=value, unit=unit, remedy=remedy))


def _table(
    text: str, file: str, required: tuple[str, ...], known: tuple[str, ...] | None, problems: list[Problem]
) -> CsvTable | None:
    """Split a table into columns; None if the header or the number of cells in a row is wrong.

    known: all allowed columns (None allows any). Quotes around cells are dropped, blank lines skipped.
    """
    lines = text.replace("\r\n", "\n").replace("\r", "\n").replace('"', "").split("\n")
    header, *rows = ([cell.strip() for cell in line.split(",")] for line in lines)
    filled = {line: row for line, row in enumerate(rows, start=2) if any(row)}
    separator = {";": "semicolons", "\t": "tabs"}.get(next((c for c in header[0] if c in ";\t"), ""))
    wrong: list[tuple[int | None, str, str]] = []  # line, name, remedy
    if not text.strip():
        wrong.append((None, "", f"the file is empty; begin with the line {','.join(required)}"))
    elif len(header) == 1 and separator:
        remedy = "separate them by commas and write decimals with a point"
        wrong.append((1, "", f"columns are separated by {separator}; {remedy}"))
    else:
        for name, count in Counter(header).items():
            if not name:
                wrong.append((1, "", "a column has no name; name it or remove the comma"))
            elif count > 1:
                wrong.append((1, name, f"column stands there {count} times; keep one"))
            elif known is not None and name not in known:
                unused = [k for k in known if k not in header]
                wrong.append((1, name, f"unknown column; {did_you_mean(name, unused or known)}"))
        wrong += [(1, name, "column is missing; add it") for name in required if name not in header]
    if not wrong and not filled:
        wrong.append((None, "", "has a header but no rows; add them"))
    problems += [Problem(file=file, line=line, name=name, remedy=remedy) for line, name, remedy in wrong]
    remedy = f"the header has {len(header)}; end the line with commas for blanks, write decimals with a point"
    ragged = {} if wrong else {line: len(row) for line, row in filled.items() if len(row) != len(header)}
    problems += [Problem(file=file, line=k, name="cells", value=n, remedy=remedy) for k, n in ragged.items()]
    if wrong or ragged:
        return None
    columns = {name: list(cells) for name, cells in zip(header, zip(*filled.values(), strict=True), strict=True)}
    of_run: dict[str, list[int]] = {}
    for row, name in enumerate(columns["run"]):
        of_run.setdefault(name, []).append(row)
    return CsvTable(file, columns, [*filled], of_run, problems)


def _read_runs(text: str, problems: list[Problem]) -> tuple[CsvTable | None, dict[str, Run]]:
    """Return runs.csv and its rows as runs without records, by name; None if the table itself is broken."""
    table, runs = _table(text, "runs.csv", REQUIRED, RUNS_COLUMNS, problems), dict[str, Run]()
    if table is None:
        return None, runs
    numbers = {}
    for column, (field, bounds, value) in RUN_NUMBERS.items():
        instead = {} if value is None else {"": value}
        instead |= {UNKNOWN_RUN_IN: math.nan} if field == "run_in" else {}
        numbers[field] = table.numbers(column, bounds, instead=instead)
    repeats, uses, started = (table.texts(column) for column in ("repeat_of", "use", "started"))
    for row, name in enumerate(table.columns["run"]):
        values: dict[str, Any] = {field: float(column[row]) for field, column in numbers.items()}
        if abs(direction := values["direction"]) != 1.0 and math.isfinite(direction):
            table.refuse(row, "direction", direction, "", "must be 1 (upper span runs from head to tail) or -1")
        if uses[row] not in ("", "fit", "hold_out"):
            table.refuse(row, "use", uses[row], "", did_you_mean(uses[row], ("fit", "hold_out")))
        try:
            clock = datetime.datetime if "-" in started[row][:5] else datetime.time
            clock.fromisoformat(started[row] or "00:00")
        except ValueError:
            remedy = "write a date and time as 2024-05-12T13:00:00, or leave it blank"
            table.refuse(row, "started", started[row], "", remedy)
        if not name:
            table.refuse(row, "run", None, "", "is blank; name the run")
            continue
        try:
            check_name(name)
        except InputError as error:
            table.refuse(row, "run", name, "", error.remedy)
        if name in runs:
            line = table.lines[table.rows[name][0]]
            table.refuse(row, "run", name, "", f"stands already in line {line}; give every run its own name")
            continue
        run_in = 0.0 if math.isnan(values["run_in"]) else values["run_in"]
        values["yaw_at"] += run_in
        values["start"] -= run_in
        values |= {key: None for key in ("start", "y0") if math.isnan(values[key])}
        if values["yaw_at"] < 0.0:
            remedy = f"is before the record: state run_in_m of at least {run_in - values['yaw_at']:g}, how far the belt"
            remedy += " had run from a straight start when the record began, or leave this at 0 beside run_in_m"
            table.refuse(row, "yaw_at_m", values["yaw_at"] - run_in, "m", f"{remedy} {UNKNOWN_RUN_IN}")
        use: Any = uses[row] or "fit"
        runs[name] = Run(name=name, repeat_of=repeats[row] or None, use=use, started=started[row], **values)
    for run in runs.values():
        _check_repeat(table, runs, run)
    return table, runs


def _check_repeat(table: CsvTable, runs: Mapping[str, Run], run: Run) -> None:
    """Check that repeat_of names a first run with the same settings."""
    if run.repeat_of is None:
        return
    first, remedy = runs.get(run.repeat_of), ""
    if first is None:
        remedy = f"no such run; {did_you_mean(run.repeat_of, [name for name in runs if name != run.name])}"
    elif first is run:
        remedy = "a run cannot repeat itself; name the first run of the series"
    elif first.repeat_of is not None:
        remedy = f"is itself a repeat; name {first.repeat_of} instead"
    if first is None or remedy:
        table.refuse(run.name, "repeat_of", run.repeat_of, "", remedy)
        return
    for column, (field, bounds, _) in RUN_NUMBERS.items():
        counted = COUNTED.get(field, 0.0)
        own, its = ((getattr(r, field) or 0.0) - counted * r.counted_from for r in (run, first))
        if field not in FREE and abs(own - its) > REPEAT_TOLERANCE * abs(its):
            shown, other = (x / UNITS[bounds.unit][1] for x in (own, its))
            remedy = f"{first.name} has {other:.6g}; a repeat has the settings of its first run"
            table.refuse(run.name, column, float(f"{shown:.6g}"), bounds.unit, remedy)


def _read_signals(
    text: str,
    names: frozenset[str] | None,
    sheets: tuple[SignalSheet, ...] | None,
    runs: Mapping[str, Run] | None,
    problems: list[Problem],
) -> dict[str, Run]:
    """Return the valid runs of signals.csv by name, with their records; runs: of runs.csv, None where it is broken."""
    before = len(problems)
    known = None if names is None else ("run", "travel_m", "time_s", *sorted(names))
    table = _table(text, "signals.csv", ("run", "travel_m"), known, problems)
    if table is None:
        return {}
    ways = {"travel_m": table.numbers("travel_m", BOUNDS["reading_travel"])}
    ways["time_s"] = table.numbers("time_s", BOUNDS["time"], instead={"": math.nan})
    columns = {
        sheet.name: table.numbers(sheet.name, BOUNDS[sheet.kind], unit=sheet.unit, instead={"": math.nan})
        for sheet in sheets or ()
        if sheet.name in table.columns
    }
    if sheets is not None and not columns:
        stated = ", ".join(sheet.name for sheet in sheets)
        remedy = f"has no column of a signal; add {stated or 'signals to campaign.yaml'}"
        problems.append(Problem(file="signals.csv", line=1, remedy=remedy))
    _check_runs(table, runs)
    recorded = {}
    for name, index in ((name, np.array(rows)) for name, rows in table.rows.items()):
        for column, values in ways.items():
            there = index[np.isfinite(values[index])]
            back = np.flatnonzero(np.diff(values[there]) <= 0.0)
            if back.size:
                row, earlier = there[back[0] + 1], values[there[back[0]]]
                remedy = f"must increase within a run, whichever way the belt runs; the row before has {earlier:.15g}"
                table.refuse(row, column, float(values[row]), column[-1], remedy)
        if runs is None or name not in runs:
            continue
        travel, time = (values[index] for values in ways.values())
        if len(index) == 1 and len(problems) == before:
            remedy = "is the only reading of its run; give readings on the way, or the late rates in steady.csv"
            table.refuse(index[0], "travel_m", float(travel[0]), "m", remedy)
        signals = {signal: column[index] for signal, column in columns.items() if np.isfinite(column[index]).any()}
        own, way = time if np.isfinite(time).any() else None, travel + runs[name].counted_from
        recorded[name] = replace(runs[name], travel=way, time=own, signals=signals)
        if columns and not signals and len(problems) == before:
            table.refuse(index[0], "run", name, "", "has rows but no readings; fill them in or remove the run")
    return recorded


def _check_runs(table: CsvTable, runs: Mapping[str, Run] | None) -> None:
    """One problem for each run that is not in runs.csv; runs: None where that is broken."""
    for name in (n for n in table.rows if runs is not None and n not in runs):
        remedy = f"not in runs.csv; {did_you_mean(name, runs or ())}" if name else "is blank; name the run"
        table.refuse(name, "run", name or None, "", remedy)


def _read_steady(text: str, runs: Mapping[str, Run] | None, problems: list[Problem]) -> tuple[SteadyRate, ...]:
    """Return the steady rates of steady.csv, one row a run."""
    table = _table(text, "steady.csv", ("run", "u_rate"), ("run", *RATES, "u_rate"), problems)
    if table is None:
        return ()
    u = table.numbers("u_rate", BOUNDS["u_rate"])
    rates = np.array([table.numbers(column, BOUNDS["rate"], instead={"": math.nan}) for column in RATES])
    _check_runs(table, runs)
    for name, (first, *others) in table.rows.items():
        if others:
            table.refuse(others[0], "run", name, "", f"stands already in line {table.lines[first]}; keep one row")
    for row, name in enumerate(table.columns["run"]):
        if not any(table.texts(column)[row] for column in RATES):
            table.refuse(row, "run", name, "", "states no rate; fill in one of rate1 to rate4")
    return tuple(
        SteadyRate(run=name, rates=rates[:, rows[0]], u=float(u[rows[0]])) for name, rows in table.rows.items()
    )


REQUIRED_FILES = ("campaign.yaml", "runs.csv")
#: The truth of a virtual rig goes with the data that it belongs to.
SEALED = ("truth.sealed", "truth.sha256")
DATA_FILES = ("signals.csv", "steady.csv")
FILES = REQUIRED_FILES + DATA_FILES
#: Significant digits written: below the last bit of a float, so that 0.012 mm stays 0.012.
WRITTEN_DIGITS = 15


def campaign_folder(named: str | Path) -> Path:
    """Return the folder of a path, or of the bare name of a shipped campaign."""
    folder = Path(named)
    return CAMPAIGNS / folder if not folder.exists() and str(named) in sample_campaigns() else folder


def read_campaign(folder: str | Path) -> Campaign:
    """Read and validate a measured campaign.

    Defaults of optional parts: every ``u`` 0, poisson_ratio 0.3, zero, gain and wander 0, exact settings, yaw_head 0,
    speed 0.5 m/s, direction 1, yaw_at 0, use fit, no time. Other files in the folder are ignored.

    Args:
        folder: path of a campaign folder, or the bare name of a shipped campaign.

    Raises:
        CampaignError: with every violation found.
    """
    return read_begun(folder, whole=True)[0]


def read_begun(folder: str | Path, *, whole: bool = False, measured: bool = True) -> tuple[Campaign, tuple[Run, ...]]:
    """Return the measured runs of a folder as a campaign, and the runs that have no data yet; raises CampaignError with
    every violation. whole: refuse runs without data; measured: read the data."""
    folder = campaign_folder(folder)
    problems: list[Problem] = []
    texts = _texts_of(folder, problems, measured=measured)
    bare = {name: text.removeprefix("\ufeff") for name, text in texts.items()}
    sheet, names = read_sheet(bare["campaign.yaml"], problems) if "campaign.yaml" in bare else (None, None)
    table, runs = _read_runs(bare["runs.csv"], problems) if "runs.csv" in bare else (None, {})
    known, recorded, steady = None if table is None else runs, dict[str, Run](), tuple[SteadyRate, ...]()
    if measured and "signals.csv" in bare:
        recorded = _read_signals(bare["signals.csv"], names, sheet.signals if sheet else None, known, problems)
    if measured and "steady.csv" in bare:
        steady = _read_steady(bare["steady.csv"], known, problems)
    if not measured and sheet is not None and not sheet.signals:
        remedy = "no signal is planned; state at least one"
        problems.append(Problem(file="campaign.yaml", name="signals", remedy=remedy))
    if problems or sheet is None or table is None:
        raise CampaignError(problems)
    rated = {rate.run for rate in steady}
    for name, run in runs.items():
        if name in recorded and run.yaw_at > (end := float(recorded[name].travel[-1])):
            remedy = f"must be at most {end:.15g} m, where the record of {name} ends"
            table.refuse(name, "yaw_at_m", run.yaw_at, "m", remedy)
        elif whole and name not in recorded and name not in rated:
            remedy = "has no rows in signals.csv or steady.csv; add them or remove the run"
            table.refuse(name, "run", name, "", remedy)
    counted = [name for name, run in runs.items() if run.start is not None]
    blank = [name for name in runs if name not in counted and (name in recorded or name not in rated)]
    if counted and blank:
        some = f"is blank, but stated of {len(counted)} other{'s' * (len(counted) > 1)} ({counted[0]})"
        table.refuse(blank[0], "start_m", None, "m", f"{some}; state it in every run or in none")
    if problems:
        raise CampaignError(problems)
    data = recorded.keys() | rated
    there = {name: recorded.get(name, run) for name, run in runs.items() if name in data}
    heir: dict[str | None, str] = {}  # repeats of a missing first run repeat the first of them that is present
    for name, run in there.items():
        if run.repeat_of is not None and run.repeat_of not in there:
            heir.setdefault(run.repeat_of, name)
        first = heir.get(run.repeat_of, run.repeat_of)
        there[name] = replace(run, repeat_of=None if first == name else first)
    contents = ((name.encode(), text.encode()) for name, text in sorted(texts.items()))
    digest = hashlib.sha256(b"".join(b"%b %d\n%b" % (name, len(data), data) for name, data in contents)).hexdigest()
    campaign = replace(sheet, runs=tuple(there.values()), steady=tuple(steady), sha256=digest)
    return campaign, tuple(run for name, run in runs.items() if name not in data)


def _texts_of(folder: Path, problems: list[Problem], *, measured: bool) -> dict[str, str]:
    """Return the texts of the campaign files present; measured: require at least one data file."""
    try:
        present = sorted(path.name for path in folder.iterdir())
    except (OSError, ValueError) as error:
        cause = getattr(error, "strerror", None) or error
        what = f"is not a folder that can be read ({cause})"
        what = "there is no such folder" if isinstance(error, FileNotFoundError) else what
        remedy = f"{what}; name a folder with campaign.yaml and runs.csv"
        if str(folder) == folder.name:
            remedy += f", or a campaign that ships: {', '.join(sample_campaigns())}"
        raise refusal(folder, remedy) from None
    others = [name for name in present if name not in FILES]
    missing = [name for name in REQUIRED_FILES if name not in present]
    missing += ["signals.csv"] if measured and not {*DATA_FILES} & {*present} else []
    for name in missing:
        near = did_you_mean(name, others) if others else ""
        hint = f"; {near.removesuffix('?')}? Rename it" if near.startswith("did you mean") else ""
        alone = " (or steady.csv)" if name == "signals.csv" else ""
        problems.append(Problem(file=name, remedy=f"the file{alone} is missing in {folder}; add it{hint}"))
    texts = {}
    for name in (name for name in FILES if name in present):
        try:
            if not (folder / name).is_file():
                raise OSError("not a plain file")
            raw = (folder / name).read_bytes()
            if b"\0" in raw:
                line = raw[: raw.index(b"\0")].count(b"\n") + 1
                remedy = "holds bytes that are no UTF-8 text (binary, a spreadsheet, or UTF-16); save it as UTF-8 text"
                problems.append(Problem(file=name, line=line, remedy=remedy))
            else:
                texts[name] = raw.decode("utf-8")
        except OSError as error:
            cause = error.strerror or error
            problems.append(Problem(file=name, remedy=f"cannot be read ({cause}); replace it by a readable text file"))
        except UnicodeDecodeError as error:
            where: dict[str, Any] = {
                "line": raw[: error.start].count(b"\n") + 1,
                "value": f"byte 0x{raw[error.start]:02x}",
            }
            problems.append(Problem(file=name, remedy="not UTF-8; save the file as UTF-8 text", **where))
    return texts


def is_plan(folder: str | Path) -> bool:
    """Return whether a folder has runs.csv but no measurements (no data file, or a signals.csv with a header only)."""
    folder = campaign_folder(folder)
    signals = folder / "signals.csv"
    try:
        if not (folder / "runs.csv").is_file() or (folder / "steady.csv").exists():
            return False
        return not signals.exists() or sum(bool(line.strip()) for line in signals.read_bytes().splitlines()) == 1
    except OSError:
        return False


def read_plan(folder: str | Path, *, travel: float, step: float) -> Campaign:
    """Return a planned campaign whose runs are recorded over ``travel`` [m] after the yaw, every ``step`` [m], with
    readings of 0 that have no meaning. Raises CampaignError with every violation."""
    sheet, planned = read_begun(folder, measured=False)
    runs = []
    for run in planned:
        way = np.arange(0.0, run.yaw_at + travel + step / 2.0, step)
        runs.append(replace(run, travel=way, signals={s.name: np.zeros(len(way)) for s in sheet.signals}))
    return replace(sheet, runs=tuple(runs))


# ---- writing


def write_campaign(
    campaign: Campaign, folder: str | Path, *, overwrite: bool = False, instead: Mapping[str, str] | None = None
) -> Campaign:
    """Write a campaign folder in one go and return it as read back (SI values equal to 15 digits).

    The files are written to a temporary folder beside it, read back, and only then renamed. An existing
    folder raises InputError unless it is empty or ``overwrite`` is set, which replaces the campaign's own
    files and keeps all others. A campaign that the reader would refuse raises CampaignError; nothing is left.
    instead: name -> text of files that are written as they are: a sheet with comments, or files of other kinds.
    """
    options: dict[str, Any] = {"sort_keys": False, "allow_unicode": True, "width": 10_000, "default_flow_style": None}
    texts = {"campaign.yaml": yaml.safe_dump(sheet_tree(campaign), **options), "runs.csv": runs_text(campaign.runs)}
    if recorded := [(run, np.full(len(run.travel), np.nan)) for run in campaign.runs if len(run.travel)]:
        columns = {"run": [run.name for run, blank in recorded for _ in blank]}
        columns["travel_m"] = _cells(np.concatenate([run.travel - run.counted_from for run, _ in recorded]))
        if any(run.time is not None for run, _ in recorded):
            columns["time_s"] = _cells(np.concatenate([b if run.time is None else run.time for run, b in recorded]))
        for sheet in (s for s in campaign.signals if any(s.name in run.signals for run, _ in recorded)):
            readings = np.concatenate([run.signals.get(sheet.name, blank) for run, blank in recorded])
            columns[sheet.name] = _cells(readings, UNITS[sheet.unit][1])
        texts["signals.csv"] = _csv(columns)
    if campaign.steady:
        rates = np.array([[*r.rates, r.u] for r in campaign.steady]).T
        columns = {"run": [r.run for r in campaign.steady]}
        columns |= {name: _cells(own, MM_PER_M) for name, own in zip((*RATES, "u_rate"), rates, strict=True)}
        texts["steady.csv"] = _csv(columns)
    return put_folder(texts | dict(instead or {}), folder, overwrite=overwrite, check=read_campaign)


def put_folder(
    texts: Mapping[str, str], folder: str | Path, *, overwrite: bool, check: Callable[[Path], Campaign]
) -> Campaign:
    """Files of a campaign (name -> text) as a folder, once ``check`` has read them; all of them or nothing."""
    folder = Path(folder)
    if Path.cwd().is_relative_to(folder.resolve()):
        raise InputError("folder", folder, "", "you are in it, so that it cannot be replaced; choose another")
    there = folder.exists()
    if there and not folder.is_dir():
        raise InputError("folder", folder, "", "a file of that name exists; choose another name")
    if there and any(folder.iterdir()) and not overwrite:
        raise InputError("folder", folder, "", "exists and is not empty; choose another name or overwrite it")
    fresh = folder.with_name(f".{folder.name}.{secrets.token_hex(4)}")
    try:
        fresh.mkdir(parents=True)
        for name, text in texts.items():
            (fresh / name).write_text(text, encoding="utf-8", newline="\n")
        back = check(fresh)
        old = fresh.with_name(fresh.name + ".old")
        if folder.exists():
            os.rename(folder, old)
        try:
            os.rename(fresh, folder)
        except OSError:
            if old.exists():
                os.rename(old, folder)  # as it was
            raise
        for path in old.iterdir() if old.exists() else ():  # what else stood in the old folder moves along
            if path.name not in (*FILES, *SEALED) and not (folder / path.name).exists():
                os.rename(path, folder / path.name)
        shutil.rmtree(old, ignore_errors=True)
    except OSError as error:
        cause = error.strerror or error
        remedy = f"cannot be written ({cause}); choose another place, or make room"
        raise InputError("folder", folder, "", remedy) from None
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
    return back


def sheet_tree(campaign: Campaign) -> dict[str, Any]:
    """The content of campaign.yaml as plain data."""

    def quantity(q: Quantity, unit: str) -> dict[str, Any]:
        out: dict[str, Any] = {"value": _in_unit(q.value, unit), "u": _in_unit(q.u, unit)}
        return out | {"unit": unit} if unit else out

    machine, settings, signals = dict(vars(campaign.machine)), campaign.settings, dict[str, Any]()
    if machine["head_radius"] == machine["tail_radius"]:
        machine = {"centre_distance": machine["centre_distance"], "pulley_radius": machine["head_radius"]}
    for s in campaign.signals:
        signals[s.name] = {"unit": s.unit, "at": s.at, "white": _in_unit(s.white, s.unit)}
        signals[s.name] |= {"zero": _in_unit(s.zero, s.unit), "gain": float(s.gain)}
        if s.wander_sd:
            signals[s.name]["wander"] = {"sd": _in_unit(s.wander_sd, s.unit), "length_m": float(s.wander_length)}
    return {
        "schema": CAMPAIGN_SCHEMA,
        "title": campaign.title,
        "source": dict(vars(campaign.source)),
        "machine": {name: quantity(q, "m") for name, q in machine.items()},
        "belt": {name: quantity(getattr(campaign.belt, name), BOUNDS[name].unit) for name in BELT},
        "signals": signals,
        "settings": {
            "tension_rel": float(settings.tension_rel),
            "yaw": {"u": _in_unit(settings.yaw_u, "urad"), "unit": "urad"},
        },
    }


def _in_unit(si: float, unit: str) -> float:
    """An SI value as the number to write in a unit."""
    return float(f"{si / UNITS[unit][1]:.{WRITTEN_DIGITS}g}")


def _cells(si: np.ndarray, scale: float = 1.0) -> list[str]:
    """Cells of a column; nan is blank."""
    written = (np.asarray(si, dtype=float) / scale).tolist()
    return ["" if x != x else repr(float(f"{x:.{WRITTEN_DIGITS}g}")) for x in written]


def runs_text(runs: tuple[Run, ...]) -> str:
    """runs.csv; columns that no run states are left out."""
    columns = {"run": [run.name for run in runs]}
    for column, (name, bounds, _) in RUN_NUMBERS.items():
        values = np.array([getattr(run, name) for run in runs], dtype=float)
        if name in COUNTED:
            values = values - COUNTED[name] * np.array([run.counted_from for run in runs])
        columns[column] = _cells(values, UNITS[bounds.unit][1])
        if name == "run_in":
            columns[column] = [cell or UNKNOWN_RUN_IN for cell in columns[column]]
    columns["direction"] = [f"{run.direction:g}" for run in runs]
    columns |= {name: [getattr(run, name) or "" for run in runs] for name in ("repeat_of", "use", "started")}
    blank = {"u_yaw_at_m": "0.0", "start_m": "", "run_in_m": "0.0", "y0_mm": "", "started": ""}
    stated = {n: cells for n, cells in columns.items() if n not in blank or set(cells) - {blank[n]}}
    return _csv(stated)


def _csv(columns: Mapping[str, list[str]]) -> str:
    """A table as text."""
    return "\n".join([",".join(columns), *(",".join(row) for row in zip(*columns.values(), strict=True)), ""])
