"""Settings that were logged and are meant to be the same, as the same; and runs that repeat others."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from belt_sim.campaign import Run
from belt_sim.campaign.csv_tables import REPEAT_TOLERANCE
from belt_sim.si import DEGREE, N_PER_MM2

#: Logged settings within this share of each other are one setting, rounded to so many digits.
ALIKE, DIGITS = 0.01, 3
UNIT = {"tension": N_PER_MM2, "yaw": DEGREE, "yaw_head": DEGREE, "speed": 1.0}


def snapped(runs: list[Run], told: list[dict[str, str]]) -> list[Run]:
    """Runs with settings that were read off columns (told: setting -> where from) brought together."""
    for key, unit in UNIT.items():
        own = [k for k, t in enumerate(told) if "column" in t.get(key, "") or t.get(key) == "travel over time"]
        values = np.array([getattr(runs[k], key) for k in own])
        for k, value in zip(own, _together(values), strict=True):
            change: dict[str, Any] = {key: _rounded(value / unit) * unit}
            runs = [*runs[:k], replace(runs[k], **change), *runs[k + 1 :]]
    return runs


def _together(values: np.ndarray) -> np.ndarray:
    """Every value as the mean of those within ALIKE of its neighbours in size, its sign kept."""
    out, order = values.copy(), np.argsort(np.abs(values))
    start = 0
    for k in range(1, len(order) + 1):
        size = np.abs(values[order])
        if k == len(order) or size[k] - size[k - 1] > ALIKE * size[k]:
            group = order[start:k]
            out[group] = np.sign(values[group]) * np.mean(np.abs(values[group]))
            start = k
    return out


def _rounded(x: float) -> float:
    return float(f"{x:.{DIGITS}g}")


def with_repeats(runs: list[Run], stated: list[bool]) -> tuple[list[Run], list[Run]]:
    """Runs at one setting as repeats of the first, with its settings; those that were recognised."""
    out: list[Run] = []
    found: list[Run] = []
    for run, told in zip(runs, stated, strict=True):
        twin = next((f for f in out if not told and f.repeat_of is None and _same(f, run)), None)
        if twin is not None:
            run = replace(run, repeat_of=twin.name, tension=twin.tension, yaw=twin.yaw, yaw_head=twin.yaw_head)
            u = math.hypot(run.yaw_at_u, run.yaw_at - twin.yaw_at)  # taken to be where the first run's was
            run = replace(run, speed=twin.speed, yaw_at=twin.yaw_at, yaw_at_u=u)
            found.append(run)
        out.append(run)
    return out, found


def _same(a: Run, b: Run) -> bool:
    near = all(
        abs(getattr(a, k) - getattr(b, k)) <= 0.5 * REPEAT_TOLERANCE * abs(getattr(a, k))
        for k in ("tension", "yaw", "yaw_head", "speed")
    )
    return near and a.direction == b.direction and abs(a.yaw_at - b.yaw_at) <= 0.05 * max(a.yaw_at, 0.0)
