"""A logger's files of the virtual rig: python -m studies.loggers [out=FOLDER] writes models/loggers anew.

A run is as a German logger would leave it, with semicolons, decimal commas, Windows' letters, time and speed in place
of travel, the tension as a force, sensors that count from marks of their own, and the yaw in the middle of it.
"""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.campaign import Campaign, Run
from belt_sim.io import write_with
from belt_sim.units import DEGREE, MM, N_PER_MM2
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Noise, Plan, RunSetting
from studies.application import application

BEFORE, LENGTH, SPACING, SPEED = 5.0, 60.0, 0.1, 0.5  # [m] travel before and after the yaw, [m] between readings, [m/s]
TENSIONS, YAW = (20.0, 30.0, 60.0), 0.042  # [N/mm2], [deg]
NOISE = Noise(white=0.01 * MM, wander_sd=0.03 * MM, zero=0.0, tension_rel=0.005)
MARKS = (103.2, 48.1)  # [mm], where the sensors' own zeros are
HIDDEN = [{"id": "taper", "kappa_t": 1.5e-4}]
HEADER = "Zeit [s];v Band [m/min];Schwenkwinkel [°];Bandzug [kN];Kante Umlenktrommel [mm];Kante Antriebstrommel [mm]"
DIGITS = (1, 2, 3, 3, 4, 4)


def plan(rng: np.random.Generator) -> Plan:
    """Both signs of yaw at each tension, and two repeats; a yaw comes somewhere between two readings."""

    def setting(tension: float, yaw: float, repeat_of: int | None = None) -> RunSetting:
        at = BEFORE - SPACING * rng.random()
        return RunSetting(tension=tension, yaw=yaw, repeat_of=repeat_of, yaw_at=at, speed=SPEED)

    runs = [setting(t * N_PER_MM2, s * YAW * DEGREE) for t in TENSIONS for s in (-1, 1)]
    again = [setting(runs[k].tension, runs[k].yaw, k) for k in (1, 4)]
    return Plan(runs=(*runs, *again), length=BEFORE + LENGTH, spacing=SPACING)


def columns_of(run: Run, campaign: Campaign, rng: np.random.Generator) -> list[np.ndarray]:
    """Time [s], speed [m/min], yaw [deg], force [kN], and both edges [mm] of one run, each (n,)."""
    section = campaign.belt.width.value * campaign.belt.thickness.value
    time = run.travel / SPEED
    force = run.tension * section / 1e3 + 0.001 * rng.standard_normal(len(time))
    speed = 60.0 * SPEED + 0.02 * rng.standard_normal(len(time))
    yaw = np.where(run.travel >= run.yaw_at, run.yaw / DEGREE, 0.0)
    edges = [mark + run.signals[n] / MM for mark, n in zip(MARKS, ("y1", "y4"), strict=True)]
    return [time, speed, yaw, force, *edges]


def loggers(config: dict[str, Any]) -> None:
    """Write one file a run."""
    seed = int(config["seed"])
    rng = np.random.default_rng(seed)
    campaign, _ = make_campaign(hidden=HIDDEN, seed=seed, base="strip", plan=plan(rng), noise=NOISE)
    for k, run in enumerate(campaign.runs, start=1):
        rows = zip(*columns_of(run, campaign, rng), strict=True)
        cells = [";".join(f"{x:.{d}f}" for x, d in zip(row, DIGITS, strict=True)) for row in rows]
        top = f"Messung: Bandlauf, Prüfstand 2\nLauf Nr.: {k}\n\n"
        text = top + "\n".join([HEADER, *(c.replace(".", ",") for c in cells), ""])
        put = partial(Path.write_bytes, data=text.replace("\n", "\r\n").encode("cp1252"))
        print(write_with(Path(config["out"]) / f"lauf_{k:02d}.csv", put))


if __name__ == "__main__":
    application("loggers", loggers)
