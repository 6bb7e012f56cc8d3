"""A logger's files of the virtual rig: python -m studies.loggers [form=csv|dropout|workbook|tabs] [out=FOLDER].

csv writes models/loggers anew: a run as a German logger would leave it, with semicolons, decimal commas, Windows'
letters, time and speed in place of travel, the tension as a force, sensors that count from marks of their own, and the
yaw in the middle of it. dropout is the same with a sensor that fails twice. workbook and tabs are another machine: one
sheet a run beside a table of runs, and tabs with a row of units.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from belt_sim.campaign import BeltSheet, Campaign, Machine, Quantity, Run
from belt_sim.errors import InputError
from belt_sim.io import write_with
from belt_sim.units import DEGREE, MM, N_PER_MM2
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import TEST_BELT, TEST_RIG, Noise, Plan, RunSetting
from studies.application import application

BEFORE, SPACING, SPEED = 5.0, 0.1, 0.5  # [m] travel before the yaw, [m] between readings, [m/s]
NOISE = Noise(white=0.01 * MM, wander_sd=0.03 * MM, zero=0.0, tension_rel=0.005)
MARKS = (103.2, 48.1)  # [mm], where the sensors' own zeros are
LOST, CODE, SPIKES = (0.55, 0.58), -9999.0, 3  # share of a record without readings, the logger's code for it
SHORT_RIG = Machine(
    centre_distance=Quantity(value=6.4, u=0.003),
    head_radius=Quantity(value=0.25, u=0.0005),
    tail_radius=Quantity(value=0.25, u=0.0005),
)
SHORT_BELT = BeltSheet(
    width=Quantity(value=0.4, u=2e-4),
    thickness=Quantity(value=0.8e-3, u=8e-6),
    youngs_modulus=Quantity(value=210e9, u=4e9),
    density=Quantity(value=7850.0),
)


@dataclass(frozen=True)
class Form:
    """One logger: what its machine hides, tensions [N/mm2], yaw [deg], and the function that writes its files."""

    hidden: list
    base: str
    machine: Machine
    belt: BeltSheet
    tensions: tuple[float, ...]
    yaw: float
    length: float  # [m] from the yaw on
    write: Callable[[Campaign, Path, np.random.Generator], list[Path]]


def plan(form: Form, rng: np.random.Generator) -> Plan:
    """Both signs of yaw at each tension, and two repeats; a yaw comes somewhere between two readings."""

    def setting(tension: float, yaw: float, repeat_of: int | None = None) -> RunSetting:
        at = BEFORE - SPACING * rng.random()
        return RunSetting(tension=tension, yaw=yaw, repeat_of=repeat_of, yaw_at=at, speed=SPEED)

    runs = [setting(t * N_PER_MM2, s * form.yaw * DEGREE) for t in form.tensions for s in (-1, 1)]
    again = [setting(runs[k].tension, runs[k].yaw, k) for k in (1, 4)]
    length = BEFORE + form.length
    return Plan(runs=(*runs, *again), length=length, spacing=SPACING, machine=form.machine, belt=form.belt)


def columns_of(run: Run, campaign: Campaign, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Time [s], speed [m/min], yaw [deg], force [kN], and both edges [mm] of one run, each (n,)."""
    section = campaign.belt.width.value * campaign.belt.thickness.value
    time = run.travel / SPEED
    force = run.tension * section / 1e3 + 0.001 * rng.standard_normal(len(time))
    speed = 60.0 * SPEED + 0.02 * rng.standard_normal(len(time))
    edges = {n: mark + run.signals[n] / MM for mark, n in zip(MARKS, ("y1", "y4"), strict=True)}
    return {"time": time, "speed": speed, "yaw": np.where(run.travel >= run.yaw_at, run.yaw / DEGREE, 0.0)} | {
        "force": force,
        **edges,
    }


# ---- German CSV

HEADER = "Zeit [s];v Band [m/min];Schwenkwinkel [°];Bandzug [kN];Kante Umlenktrommel [mm];Kante Antriebstrommel [mm]"


def write_csv(campaign: Campaign, folder: Path, rng: np.random.Generator, dropout: bool = False) -> list[Path]:
    """One file a run; dropout: a sensor that is silent for two metres in one run, and jumps in another."""
    written = []
    for k, run in enumerate(campaign.runs, start=1):
        columns = columns_of(run, campaign, rng)
        if dropout and k in (2, 5):
            own = columns["y1"] if k == 2 else columns["y4"]
            if k == 2:
                own[slice(*(int(share * len(own)) for share in LOST))] = CODE
            own[rng.integers(20, len(own) - 20, SPIKES)] += 25.0
        digits = (1, 2, 3, 3, 4, 4)
        rows = zip(*columns.values(), strict=True)
        cells = [";".join(f"{x:.{d}f}" for x, d in zip(row, digits, strict=True)) for row in rows]
        top = f"Messung: Bandlauf, Prüfstand 2\nLauf Nr.: {k}\n\n"
        text = top + "\n".join([HEADER, *(c.replace(".", ",") for c in cells), ""])
        path = folder / f"lauf_{k:02d}.csv"
        written.append(write_with(path, partial(_put, data=text.replace("\n", "\r\n").encode("cp1252"))))
    return written


def _put(path: Path, data: bytes) -> None:
    path.write_bytes(data)


# ---- a workbook, and tabs with a row of units


def write_workbook(campaign: Campaign, folder: Path, rng: np.random.Generator) -> list[Path]:
    """A sheet of runs with their settings, and a sheet a run with travel and edges."""
    settings = [
        (f"M{k}", r.tension / N_PER_MM2, r.yaw / DEGREE * 1e3, r.yaw_at) for k, r in enumerate(campaign.runs, 1)
    ]
    names = ["Versuch", "Bandspannung [N/mm²]", "Schwenkwinkel [mdeg]", "Schwenken bei [m]"]
    sheets = {"Versuche": pd.DataFrame(settings, columns=names)}
    for k, run in enumerate(campaign.runs, 1):
        columns = columns_of(run, campaign, rng)
        own = {"Bandweg [m]": run.travel, "BK Umlenk oben [mm]": columns["y1"], "BK Antrieb oben [mm]": columns["y4"]}
        sheets[f"M{k}"] = pd.DataFrame({n: np.round(v, 4) for n, v in own.items()})

    def put(path: Path) -> None:
        with pd.ExcelWriter(path, engine="openpyxl") as book:
            for name, sheet in sheets.items():
                sheet.to_excel(book, sheet_name=name, index=False)

    return [write_with(folder / "versuche.xlsx", put)]


def write_tabs(campaign: Campaign, folder: Path, rng: np.random.Generator) -> list[Path]:
    """One file of all runs, their number in a column, units in a row of their own."""
    names = ("test", "elapsed", "belt speed", "steering angle", "pull", "edge tail upper", "edge head upper")
    lines = ["\t".join(names), "\t".join(("", "s", "m/min", "mrad", "kN", "um", "um"))]
    for k, run in enumerate(campaign.runs, 1):
        columns = columns_of(run, campaign, rng)
        columns["yaw"] = np.deg2rad(columns["yaw"]) * 1e3
        columns |= {n: columns[n] * 1e3 for n in ("y1", "y4")}
        lines += ["\t".join((str(k), *(f"{x:.6g}" for x in row))) for row in zip(*columns.values(), strict=True)]
    return [write_with(folder / "tests.txt", partial(_put, data="\n".join([*lines, ""]).encode()))]


# ----

_TEST = (TEST_RIG, TEST_BELT, (20.0, 30.0, 60.0), 0.042, 60.0)
_SHORT = (SHORT_RIG, SHORT_BELT, (8.0, 15.0, 30.0, 60.0), 0.03, 60.0)
FORMS = {
    "csv": Form([{"id": "taper", "kappa_t": 1.5e-4}], "strip", *_TEST, write_csv),
    "dropout": Form([{"id": "taper", "kappa_t": 1.5e-4}], "strip", *_TEST, partial(write_csv, dropout=True)),
    "workbook": Form([{"id": "yaw_offset_tail", "beta_0": 2e-4}], "strip", *_SHORT, write_workbook),
    "tabs": Form([], "strip", *_SHORT, write_tabs),
}


def loggers(config: dict[str, Any]) -> None:
    """Write the files of one logger."""
    name, seed = str(config["form"]), int(config["seed"])
    if name not in FORMS:
        raise InputError("form", name, "", f"use one of {', '.join(FORMS)}")
    form, rng = FORMS[name], np.random.default_rng(seed)
    campaign, _ = make_campaign(hidden=form.hidden, seed=seed, base=form.base, plan=plan(form, rng), noise=NOISE)
    for path in form.write(campaign, Path(config["out"]), rng):
        print(path)


if __name__ == "__main__":
    application("loggers", loggers)
