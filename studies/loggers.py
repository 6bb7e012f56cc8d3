"""The logger's files of models/loggers, written anew: python -m studies.loggers.

A run of the virtual rig as a German logger would leave it: semicolons, decimal commas, Windows' letters, time and speed
in place of travel, the tension as a force, sensors that count from marks of their own, the yaw in the middle of it.
"""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.campaign import Run
from belt_sim.files import write_with
from belt_sim.si import DEGREE, MM, N_PER_MM2
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Noise, Plan, Setting
from studies.application import application

BEFORE, LENGTH, SPACING = 5.0, 60.0, 0.1  # [m]: travel before the yaw, from it on, between readings
TENSIONS, YAW, SPEED = (10.0, 20.0, 40.0), 0.042, 0.5  # [N/mm2], [deg], [m/s]
HIDDEN = [{"id": "taper", "kappa_t": 4e-6}]
NOISE = Noise(white=0.01 * MM, wander_sd=0.03 * MM, zero=0.0, tension_rel=0.005)
MARKS = (103.2, 48.1)  # [mm], where the sensors' own zeros are
HEADER = "Zeit [s];v Band [m/min];Schwenkwinkel [°];Bandzug [kN];Kante Umlenktrommel [mm];Kante Antriebstrommel [mm]"


def plan(rng: np.random.Generator) -> Plan:
    """Both signs of yaw at each tension, and two repeats; a yaw comes somewhere between two readings."""

    def setting(tension: float, yaw: float, repeat_of: int | None = None) -> Setting:
        at = BEFORE - SPACING * rng.random()
        return Setting(tension=tension, yaw=yaw, repeat_of=repeat_of, yaw_at=at, speed=SPEED)

    runs = [setting(t * N_PER_MM2, s * YAW * DEGREE) for t in TENSIONS for s in (-1, 1)]
    again = [setting(runs[k].tension, runs[k].yaw, k) for k in (1, 4)]
    return Plan(runs=(*runs, *again), length=BEFORE + LENGTH, spacing=SPACING)


def logged(run: Run, number: int, section: float, rng: np.random.Generator) -> str:
    """One run as the logger writes it; section [m2]: of the belt."""
    time = run.travel / SPEED
    yaw = np.where(run.travel >= run.yaw_at, run.yaw / DEGREE, 0.0)
    force = run.tension * section / 1e3 + 0.001 * rng.standard_normal(len(time))
    edges = [mark + run.signals[n] / MM for mark, n in zip(MARKS, ("y1", "y4"), strict=True)]
    speed = 60.0 * SPEED + 0.02 * rng.standard_normal(len(time))
    columns = [time, speed, yaw, force, *edges]
    digits = (1, 2, 3, 3, 4, 4)
    rows = [";".join(f"{x:.{d}f}" for x, d in zip(row, digits, strict=True)) for row in zip(*columns, strict=True)]
    top = f"Messung: Bandlauf, Prüfstand 2\nLauf Nr.: {number}\n\n"
    return top + "\n".join([HEADER, *(r.replace(".", ",") for r in rows), ""])


def loggers(config: dict[str, Any]) -> None:
    """Write one file a run."""
    seed = int(config["seed"])
    rng = np.random.default_rng(seed)
    chosen = plan(rng)
    campaign, _ = make_campaign(hidden=HIDDEN, seed=seed, base="strip", plan=chosen, noise=NOISE)
    section = campaign.belt.width.value * campaign.belt.thickness.value
    for k, run in enumerate(campaign.runs, start=1):
        text = logged(run, k, section, rng).replace("\n", "\r\n")
        print(write_with(Path(config["out"]) / f"lauf_{k:02d}.csv", partial(_put, text=text)))


def _put(path: Path, text: str) -> None:
    path.write_bytes(text.encode("cp1252"))


if __name__ == "__main__":
    application("loggers", loggers)
