"""Runs at one setting: settings that were logged brought together, and repeats marked as such."""

import math
from collections import defaultdict
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from belt_sim.campaign import Run
from belt_sim.campaign.run_tables import REPEAT_TOLERANCE
from belt_sim.importing.settings import Settings
from belt_sim.si import DEGREE, N_PER_MM2, round_digits

#: Digits of one setting that was logged, within SAME of each other in several runs.
SAME_DIGITS, SAME = 3, 0.01
#: Repeats are cut to the shortest of them when they differ by less than this share.
ALIKE = 0.1


def snap_settings(runs: list[Run], settings: list[Settings]) -> list[Run]:
    """Runs with settings that were logged and are meant to be the same brought together."""
    found = list(runs)
    for key, unit in (("tension", N_PER_MM2), ("yaw", DEGREE), ("yaw_head", DEGREE), ("speed", 1.0)):
        own = [k for k, s in enumerate(settings) if key in s and not s[key].text]
        values = _group_values(np.array([getattr(found[k], key) for k in own]))
        for k, value in zip(own, values, strict=True):
            change: dict[str, Any] = {key: round_digits(value / unit, SAME_DIGITS) * unit}
            found[k] = replace(found[k], **change)
    return found


def _group_values(values: np.ndarray) -> np.ndarray:
    """Every value as the mean of those within SAME of its neighbours in size, its sign kept."""
    out, order = values.copy(), np.argsort(np.abs(values))
    size = np.abs(values[order])
    ends = np.flatnonzero(np.diff(size) > SAME * size[1:]) + 1
    for group in np.split(order, ends):
        out[group] = np.sign(values[group]) * np.mean(np.abs(values[group])) if len(group) else 0.0
    return out


def mark_repeats(runs: list[Run], stated: list[bool]) -> tuple[list[Run], list[Run]]:
    """Runs at one setting as repeats of the first, with its settings; those that were recognised."""
    out: list[Run] = []
    found: list[Run] = []
    for run, is_stated in zip(runs, stated, strict=True):
        twin = next((f for f in out if not is_stated and f.repeat_of is None and _same(f, run)), None)
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


def cut_repeats(runs: list[Run], records: list[pd.DataFrame]) -> list[pd.DataFrame]:
    """Records of the runs; repeats cut to the shortest of them, where they differ by little, so that they compare."""
    series = defaultdict[str, list[int]](list)
    for k, run in enumerate(runs):
        series[run.repeat_of or run.name].append(k)
    out = list(records)
    for alike in series.values():
        lengths = [len(records[k]) for k in alike]
        if max(lengths) - min(lengths) <= ALIKE * max(lengths):
            for k in alike:
                out[k] = records[k].iloc[: min(lengths)]
    return out
