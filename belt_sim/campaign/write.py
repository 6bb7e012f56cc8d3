"""Campaign -> a campaign folder, belt-campaign/1."""

import os
import secrets
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from belt_sim.campaign.plausible import BELT
from belt_sim.campaign.read import FILES, read_campaign
from belt_sim.campaign.run_tables import NUMBERS, RATES
from belt_sim.campaign.sheet import SCHEMA
from belt_sim.campaign.types import Campaign, Quantity, Run, SignalSheet
from belt_sim.errors import InputError
from belt_sim.si import MM_PER_M, UNITS

#: Significant digits written: below the last bit of a float, so that 0.012 mm stays 0.012.
DIGITS = 15


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
    if not folder.exists() or not any(folder.iterdir()):
        os.rename(fresh, folder)
        return
    new = {path.name for path in fresh.iterdir()}
    old = fresh.with_name(fresh.name + ".old")
    os.rename(folder, old)
    os.rename(fresh, folder)
    for path in old.iterdir():
        if path.name not in (*FILES, *new):
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


def _quantity(quantity: Quantity, unit: str) -> dict:
    out = {"value": _in_unit(quantity.value, unit), "u": _in_unit(quantity.u, unit)}
    return out | {"unit": unit} if unit else out


def _signal(signal: SignalSheet) -> dict:
    out = {"unit": signal.unit, "at": signal.at, "white": _in_unit(signal.white, signal.unit)}
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
        columns[column] = _cells(values, UNITS[bounds.unit][1])
    columns["direction"] = [f"{run.direction:g}" for run in runs]
    columns |= {name: [getattr(run, name) or "" for run in runs] for name in ("repeat_of", "use", "started")}
    blank = {"u_yaw_at_m": "0.0", "start_m": "", "started": ""}
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
        columns = [[run.name] * len(run.travel), _cells(run.travel)]
        if timed:
            columns.append(_cells(blank if run.time is None else run.time))
        for signal in used:
            columns.append(_cells(run.signals.get(signal.name, blank), UNITS[signal.unit][1]))
        rows.extend(",".join(row) for row in zip(*columns, strict=True))
    return "\n".join([*rows, ""])
