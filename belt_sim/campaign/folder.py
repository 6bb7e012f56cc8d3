"""Read and write campaign folders (belt-campaign/1): measured, begun or only planned, or shipped with the package."""

import hashlib
import os
import secrets
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from belt_sim.campaign.problems import CampaignError, Problem, did_you_mean, refusal
from belt_sim.campaign.run_tables import NUMBERS, RATES, RunRows, read_runs, read_signals, read_steady
from belt_sim.campaign.sheet import SCHEMA, read_sheet
from belt_sim.campaign.types import Campaign, Quantity, Run, SignalSheet, SteadyRate
from belt_sim.errors import InputError
from belt_sim.files import CAMPAIGNS, sample_campaigns
from belt_sim.plausible import BELT
from belt_sim.si import MM_PER_M, UNITS

REQUIRED_FILES = ("campaign.yaml", "runs.csv")
DATA_FILES = ("signals.csv", "steady.csv")
FILES = REQUIRED_FILES + DATA_FILES
#: Significant digits written: below the last bit of a float, so that 0.012 mm stays 0.012.
DIGITS = 15


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
    return _read(folder)[0]


def read_begun(folder: str | Path) -> tuple[Campaign, tuple[Run, ...]]:
    """Return the measured runs of a folder as a campaign, and the runs that have no data yet.

    Raises CampaignError with every violation, except that some (not all) runs may lack data.
    """
    return _read(folder, whole=False)


def _read(folder: str | Path, *, whole: bool = True, measured: bool = True) -> tuple[Campaign, tuple[Run, ...]]:
    """Return the campaign and its runs without data; whole: refuse such runs; measured: read the data."""
    folder = campaign_folder(folder)
    problems: list[Problem] = []
    contents = contents_of(folder, problems, measured=measured)
    texts = {name: text for name, data in contents.items() if (text := text_of(name, data, problems)) is not None}
    sheet, names = read_sheet(texts["campaign.yaml"], problems) if "campaign.yaml" in texts else (None, None)
    rows = read_runs(texts["runs.csv"], problems) if "runs.csv" in texts else None
    recorded: dict[str, Run] = {}
    steady: tuple[SteadyRate, ...] = ()
    if measured and "signals.csv" in texts:
        recorded = read_signals(texts["signals.csv"], names, sheet.signals if sheet else None, rows, problems)
    if measured and "steady.csv" in texts:
        steady = read_steady(texts["steady.csv"], rows, problems)
    if not measured and sheet is not None and not sheet.signals:
        remedy = "no signal is planned; state at least one"
        problems.append(Problem(file="campaign.yaml", name="signals", remedy=remedy))
    if rows is not None and not problems:
        _check_records(rows, recorded, steady, whole=whole)
    if problems or sheet is None or rows is None:
        raise CampaignError(problems)
    data = recorded.keys() | {rate.run for rate in steady}
    there = [recorded.get(name, run) for name, run in rows.runs.items() if name in data]
    campaign = replace(sheet, runs=tuple(_relink_repeats(there)), steady=tuple(steady), sha256=hash_of(contents))
    return campaign, tuple(run for name, run in rows.runs.items() if name not in data)


def _relink_repeats(runs: list[Run]) -> list[Run]:
    """Let repeats of a missing first run repeat the first of them that is present."""
    names = {run.name for run in runs}
    heir: dict[str, str] = {}
    found = []
    for run in runs:
        first = run.repeat_of
        if first is not None and first not in names:
            heir.setdefault(first, run.name)
            run = replace(run, repeat_of=None if heir[first] == run.name else heir[first])
        found.append(run)
    return found


def contents_of(folder: Path, problems: list[Problem], *, measured: bool = True) -> dict[str, bytes]:
    """Return the bytes of the campaign files present; measured: require at least one data file."""
    try:
        present = sorted(path.name for path in folder.iterdir())
    except (OSError, ValueError) as error:
        what = "there is no such folder" if isinstance(error, FileNotFoundError) else "is not a folder that can be read"
        remedy = f"{what}; name a folder with campaign.yaml and runs.csv"
        if str(folder) == folder.name:
            remedy += f", or a campaign that ships: {', '.join(sample_campaigns())}"
        raise refusal(folder, remedy) from None
    others = [name for name in present if name not in FILES]
    missing = [name for name in REQUIRED_FILES if name not in present]
    if measured and not any(name in present for name in DATA_FILES):
        missing.append("signals.csv")
    for name in missing:
        near = did_you_mean(name, others) if others else ""
        hint = f"; {near.removesuffix('?')}? Rename it" if near.startswith("did you mean") else ""
        alone = " (or steady.csv)" if name == "signals.csv" else ""
        problems.append(Problem(file=name, remedy=f"the file{alone} is missing in {folder}; add it{hint}"))
    contents = {}
    for name in (name for name in FILES if name in present):
        try:
            if not (folder / name).is_file():
                raise OSError("not a plain file")
            contents[name] = (folder / name).read_bytes()
        except OSError as error:
            cause = error.strerror or error
            problems.append(Problem(file=name, remedy=f"cannot be read ({cause}); replace it by a readable text file"))
    return contents


def text_of(name: str, data: bytes, problems: list[Problem]) -> str | None:
    """Decode UTF-8 with or without a byte-order mark; return None and append a problem if that fails."""
    at, value = data.find(b"\0"), None
    remedy = "holds bytes that are no UTF-8 text (binary, a spreadsheet, or UTF-16); save it as UTF-8 text"
    if at < 0:
        try:
            return data.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            at, value = error.start, f"byte 0x{data[error.start]:02x}"
            remedy = "not UTF-8; save the file as UTF-8 text"
    problems.append(Problem(file=name, line=data[:at].count(b"\n") + 1, value=value, remedy=remedy))
    return None


def _check_records(rows: RunRows, recorded: dict[str, Run], steady: tuple[SteadyRate, ...], *, whole: bool) -> None:
    """Check that every run has a record or a rate (if whole), and that its yaw is applied before its record ends."""
    rated = {rate.run for rate in steady}
    for name, run in rows.runs.items():
        if name in recorded:
            end = float(recorded[name].travel[-1])
            if run.yaw_at > end:
                remedy = f"must be at most {end:.15g} m, where the record of {name} ends"
                rows.refuse(name, "yaw_at_m", run.yaw_at, "m", remedy)
        elif whole and name not in rated:
            remedy = "has no rows in signals.csv or steady.csv; add them or remove the run"
            rows.refuse(name, "run", name, "", remedy)


def hash_of(contents: dict[str, bytes]) -> str:
    """Return the SHA-256 of the campaign files."""
    digest = hashlib.sha256()
    for name in sorted(contents):
        digest.update(f"{name} {len(contents[name])}\n".encode())
        digest.update(contents[name])
    return digest.hexdigest()


def is_plan(folder: str | Path) -> bool:
    """Return whether a folder has runs.csv but no measurements (no data file, or a signals.csv with a header only)."""
    folder = campaign_folder(folder)
    if not (folder / "runs.csv").is_file() or (folder / "steady.csv").exists():
        return False
    signals = folder / "signals.csv"
    try:
        return not signals.exists() or sum(bool(line.strip()) for line in signals.read_bytes().splitlines()) == 1
    except OSError:
        return False


def read_plan(folder: str | Path, *, travel: float, step: float) -> Campaign:
    """Return a planned campaign whose runs are recorded over ``travel`` [m] after the yaw, every ``step`` [m].

    All readings are 0 and have no meaning. Raises CampaignError with every violation.
    """
    sheet, planned = _read(folder, whole=False, measured=False)
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
    return put_folder(_texts(campaign) | dict(instead or {}), folder, overwrite=overwrite, check=read_campaign)


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
    folder.parent.mkdir(parents=True, exist_ok=True)
    fresh = folder.with_name(f".{folder.name}.{secrets.token_hex(4)}")
    fresh.mkdir()
    try:
        for name, text in texts.items():
            (fresh / name).write_text(text, encoding="utf-8", newline="\n")
        back = check(fresh)
        _put(fresh, folder)
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
    return back


def _put(fresh: Path, folder: Path) -> None:
    """Rename ``fresh`` to ``folder``; what else stood in the old folder moves along."""
    old = fresh.with_name(fresh.name + ".old")
    if folder.exists():
        os.rename(folder, old)
    try:
        os.rename(fresh, folder)
    except OSError:
        if old.exists():
            os.rename(old, folder)  # as it was
        raise
    if old.exists():
        for path in old.iterdir():
            if path.name not in FILES and not (folder / path.name).exists():
                os.rename(path, folder / path.name)
        shutil.rmtree(old)


def _texts(campaign: Campaign) -> dict[str, str]:
    sheet = yaml.safe_dump(
        sheet_tree(campaign), sort_keys=False, allow_unicode=True, width=10_000, default_flow_style=None
    )
    texts = {"campaign.yaml": sheet, "runs.csv": runs_text(campaign.runs)}
    if any(len(run.travel) for run in campaign.runs):
        texts["signals.csv"] = _signals(campaign)
    if campaign.steady:
        header = ",".join(("run", *RATES, "u_rate"))
        rows = [",".join([r.run, *_cells(np.array([*r.rates, r.u]), MM_PER_M)]) for r in campaign.steady]
        texts["steady.csv"] = "\n".join([header, *rows, ""])
    return texts


def sheet_tree(campaign: Campaign) -> dict[str, Any]:
    """The content of campaign.yaml as plain data."""
    machine, settings = dict(vars(campaign.machine)), campaign.settings
    if machine["head_radius"] == machine["tail_radius"]:
        machine = {"centre_distance": machine["centre_distance"], "pulley_radius": machine["head_radius"]}
    return {
        "schema": SCHEMA,
        "title": campaign.title,
        "source": dict(vars(campaign.source)),
        "machine": {name: _quantity(q, "m") for name, q in machine.items()},
        "belt": {name: _quantity(getattr(campaign.belt, name), bounds.unit) for name, bounds in BELT.items()},
        "signals": {signal.name: _signal(signal) for signal in campaign.signals},
        "settings": {
            "tension_rel": float(settings.tension_rel),
            "yaw": {"u": _in_unit(settings.yaw_u, "urad"), "unit": "urad"},
        },
    }


def _quantity(quantity: Quantity, unit: str) -> dict[str, Any]:
    out: dict[str, Any] = {"value": _in_unit(quantity.value, unit), "u": _in_unit(quantity.u, unit)}
    return out | {"unit": unit} if unit else out


def _signal(signal: SignalSheet) -> dict[str, Any]:
    out: dict[str, Any] = {"unit": signal.unit, "at": signal.at, "white": _in_unit(signal.white, signal.unit)}
    out |= {"zero": _in_unit(signal.zero, signal.unit), "gain": float(signal.gain)}
    if signal.wander_sd:
        out["wander"] = {"sd": _in_unit(signal.wander_sd, signal.unit), "length_m": float(signal.wander_length)}
    return out


def _in_unit(si: float, unit: str) -> float:
    """An SI value as the number to write in a unit."""
    return float(f"{si / UNITS[unit][1]:.{DIGITS}g}")


def _cells(si: np.ndarray, scale: float = 1.0) -> list[str]:
    """Cells of a column; nan is blank."""
    return ["" if x != x else repr(float(f"{x:.{DIGITS}g}")) for x in (np.asarray(si, dtype=float) / scale).tolist()]


def runs_text(runs: tuple[Run, ...]) -> str:
    """runs.csv; columns that no run states are left out."""
    columns = {"run": [run.name for run in runs]}
    for column, (name, bounds, _) in NUMBERS.items():
        values = np.array([getattr(run, name) for run in runs], dtype=float)
        if name == "yaw_at":  # in the file both count from the beginning of the record
            values = values - np.array([run.run_in for run in runs])
        columns[column] = _cells(values, UNITS[bounds.unit][1])
    columns["direction"] = [f"{run.direction:g}" for run in runs]
    columns |= {name: [getattr(run, name) or "" for run in runs] for name in ("repeat_of", "use", "started")}
    blank = {"u_yaw_at_m": "0.0", "start_m": "", "run_in_m": "0.0", "y0_mm": "", "started": ""}
    stated = {n: cells for n, cells in columns.items() if n not in blank or set(cells) - {blank[n]}}
    return "\n".join([",".join(stated), *(",".join(row) for row in zip(*stated.values(), strict=True)), ""])


def _signals(campaign: Campaign) -> str:
    """signals.csv: columns of the signals that any run has, time_s where any run has it."""
    recorded = [run for run in campaign.runs if len(run.travel)]
    used = [signal for signal in campaign.signals if any(signal.name in run.signals for run in recorded)]
    timed = any(run.time is not None for run in recorded)
    rows = [",".join(["run", "travel_m", *(["time_s"] if timed else []), *(signal.name for signal in used)])]
    for run in recorded:
        blank = np.full(len(run.travel), np.nan)
        columns = [[run.name] * len(run.travel), _cells(run.travel - run.run_in)]
        if timed:
            columns.append(_cells(blank if run.time is None else run.time))
        for signal in used:
            columns.append(_cells(run.signals.get(signal.name, blank), UNITS[signal.unit][1]))
        rows.extend(",".join(row) for row in zip(*columns, strict=True))
    return "\n".join([*rows, ""])
