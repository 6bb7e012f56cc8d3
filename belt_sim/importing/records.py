"""Runs with their records on one grid, readings counted from the yaw, repeats recognised."""

import math
from collections import defaultdict
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from belt_sim.campaign import Run
from belt_sim.campaign.run_tables import REPEAT_TOLERANCE
from belt_sim.errors import InputError
from belt_sim.importing.columns import Note
from belt_sim.importing.mapping import MappingEntry
from belt_sim.importing.runs import RANGES, TIME, AssembledRun, Settings
from belt_sim.si import DEGREE, N_PER_MM2, UNITS, round_digits, size_of

AT_ONCE = "the yaw is taken to act from the first reading on; else state where it was set: all_runs: {yaw_at: 5 m}"
#: Samples a run that are aimed at, and the fewest that a step may leave.
AIMED, LEFT = 600, 60
#: Travel from time and speed is a little uneven; a step this share below twice the spacing still has two rows.
UNEVEN = 0.95
#: Decimals of a reading in SI that are kept.
DECIMALS = 10
#: Digits of one setting that was logged, within SAME of each other in several runs.
SAME_DIGITS, SAME = 3, 0.01
#: Repeats are cut to the shortest of them when they differ by less than this share.
ALIKE = 0.1


def runs_on_one_grid(made: list[AssembledRun], entry: MappingEntry) -> tuple[list[Run], list[Note], float]:
    """Runs on one grid, their readings counted from the yaw, repeats recognised; remarks; the step [m]."""
    if not made:
        return [], [], 0.0
    notes: list[Note] = []
    step = size_of(entry.step_m, "m", "step_m") if entry.step_m else _step_for([m.record for m in made])
    records = [_resample(m.record, step) for m in made]
    if step > 0.0:
        rows, left = (sum(map(len, some)) for some in ([m.record for m in made], records))
        notes.append(Note("", f"{rows} rows were averaged over steps of {step:g} m, {left} are left"))
    runs = _snap_settings([_run(m) for m in made], [m.settings for m in made])
    notes += [Note(r.name, AT_ONCE) for r, m in zip(runs, made, strict=True) if r.yaw and "yaw_at" not in m.settings]
    stated = [m.entry.repeat_of is not None for m in made]
    runs = _mark_repeats(runs, stated)
    found = [r for r, is_stated in zip(runs, stated, strict=True) if r.repeat_of and not is_stated]
    notes += [Note(r.name, f"repeats {r.repeat_of}, same settings") for r in found] + _note_blanks(made, records)
    records = _cut_repeats(runs, records)
    if entry.start == "yaw":
        records, said = _count_from_yaw(records, [r.yaw_at for r in runs])
        notes += [Note("", text) for text in said]
    out = []
    for run, record in zip(runs, records, strict=True):
        time = record[TIME].to_numpy() if TIME in record else None
        signals = {name: record[name].to_numpy() for name in _signals_in(record)}
        way = record.index.to_numpy() + run.run_in
        out.append(replace(run, travel=way, yaw_at=run.yaw_at + run.run_in, time=time, signals=signals))
    return out, notes, step


def _note_blanks(made: list[AssembledRun], records: list[pd.DataFrame]) -> list[Note]:
    """Runs without a signal that others have: a column of that name may be missing in their file."""
    names = dict.fromkeys(n for record in records for n in _signals_in(record))
    lacking = {m.key: [n for n in names if n not in record] for m, record in zip(made, records, strict=True)}
    text = "has no {}, which other runs have; is its column called otherwise there?"
    return [Note(run, text.format(" and no ".join(blank))) for run, blank in lacking.items() if blank]


def _run(made: AssembledRun) -> Run:
    values: dict[str, Any] = {k: s.value for k, s in made.settings.items()}
    for key, value in values.items():
        bounds = RANGES[key]
        if np.isfinite(value) and not bounds.holds(value):
            shown = value / UNITS[bounds.unit][1]
            remedy = (
                f"must be {bounds.low:g} to {bounds.high:g} {bounds.unit}; it came from {made.settings[key].source}"
            )
            raise InputError(f"runs.{made.key}.{key}", f"{shown:.6g}", bounds.unit, remedy)
    entry = made.entry
    unknown = {"tension": np.nan, "yaw": np.nan}
    name, use = entry.name or made.key, entry.use or "fit"
    return Run(name=name, repeat_of=entry.repeat_of, use=use, started=made.started, **unknown | values)


def _signals_in(record: pd.DataFrame) -> list[str]:
    """The names of the signals of a record."""
    return [str(name) for name in record.columns if name != TIME]


def _step_for(records: list[pd.DataFrame]) -> float:
    """A step [m], 1, 2 or 5 times a power of ten, that keeps some hundred samples a run; 0 where records are so sparse
    that they stay as they are."""
    places = [np.unique(record.index) for record in records]
    spacing = [float(np.median(np.diff(travel))) for travel in places if len(travel) > 2]
    if not spacing or _on_one_grid(records):
        return 0.0
    longest = max(float(record.index[-1]) for record in records)
    least = max(longest / AIMED, UNEVEN * 2.0 * max(spacing))
    power = 10.0 ** math.floor(math.log10(least))
    step = float(next(f"{f * power:.6g}" for f in (1.0, 2.0, 5.0, 10.0) if f * power >= least * (1.0 - 1e-9)))
    return step if step <= longest / LEFT else 0.0


def _on_one_grid(records: list[pd.DataFrame]) -> bool:
    """Whether all records stand at the same travels already, and not at too many of them."""
    first = max(records, key=len).index
    if len(first) > 4 * AIMED:
        return False
    return all(r.index.is_unique and np.allclose(r.index, first[: len(r)], atol=1e-6) for r in records)


def _resample(record: pd.DataFrame, step: float) -> pd.DataFrame:
    """Averages over bins of ``step`` [m] about its multiples; with step 0 only rows of one travel fall together."""
    travel = record.index.to_numpy()
    means = record.groupby(np.rint(travel / step) * step if step > 0.0 else travel).mean()
    hardly_begun = step > 0.0 and len(means) > 2 and travel[-1] < means.index[-1] - 0.25 * step
    means.index = np.round(means.index, 9)
    return means.iloc[:-1] if hardly_begun else means


def _count_from_yaw(records: list[pd.DataFrame], yaw_at: list[float]) -> tuple[list[pd.DataFrame], list[str]]:
    """Readings counted from where each point was when the yaw was applied [m], and what was taken off, in words."""
    out: list[pd.DataFrame] = []
    off: dict[str, list[float]] = {}
    for record, at in zip(records, yaw_at, strict=True):
        travel = record.index.to_numpy()
        starts = {name: _reading_at_yaw(travel, record[name].to_numpy(), at) for name in _signals_in(record)}
        out.append(record.assign(**{name: np.round(record[name] - y, DECIMALS) for name, y in starts.items()}))
        for name, start in starts.items():
            off.setdefault(name, []).append(1e3 * start)
    told = [f"{name} {min(x):.4g} to {max(x):.4g}" for name, x in off.items() if max(map(abs, x)) > 1e-3]
    if not told:
        return out, []
    return out, [f"readings count from where each point was at the yaw; taken off: {', '.join(told)} (mm or mrad)"]


def _reading_at_yaw(travel: np.ndarray, y: np.ndarray, yaw_at: float) -> float:
    """Reading [SI] at the yaw: the mean of what stands before it, else a line through the first readings after it."""
    there = np.isfinite(y)
    before = there & (travel < yaw_at)
    if before.sum() >= 3:
        return float(np.mean(y[before]))
    s, values = travel[there] - yaw_at, y[there]
    if not len(s):
        return 0.0
    near = s <= max(0.01 * (s[-1] - s[0]), 4.0 * float(np.median(np.diff(s))) if len(s) > 4 else 0.0)
    if near.sum() < 4:
        return float(values[0])
    return float(np.polynomial.Polynomial.fit(s[near], values[near], 1)(0.0))


# ---- runs at one setting


def _snap_settings(runs: list[Run], settings: list[Settings]) -> list[Run]:
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


def _mark_repeats(runs: list[Run], stated: list[bool]) -> list[Run]:
    """Runs at one setting as repeats of the first, with its settings; stated: whether the mapping says of which."""
    out: list[Run] = []
    for run, is_stated in zip(runs, stated, strict=True):
        twin = next((f for f in out if not is_stated and f.repeat_of is None and _same(f, run)), None)
        if twin is not None:
            run = replace(run, repeat_of=twin.name, tension=twin.tension, yaw=twin.yaw, yaw_head=twin.yaw_head)
            u = math.hypot(run.yaw_at_u, run.yaw_at - twin.yaw_at)  # taken to be where the first run's was
            run = replace(run, speed=twin.speed, yaw_at=twin.yaw_at, yaw_at_u=u)
        out.append(run)
    return out


def _same(a: Run, b: Run) -> bool:
    near = all(
        abs(getattr(a, k) - getattr(b, k)) <= 0.5 * REPEAT_TOLERANCE * abs(getattr(a, k))
        for k in ("tension", "yaw", "yaw_head", "speed")
    )
    return near and a.direction == b.direction and abs(a.yaw_at - b.yaw_at) <= 0.05 * max(a.yaw_at, 0.0)


def _cut_repeats(runs: list[Run], records: list[pd.DataFrame]) -> list[pd.DataFrame]:
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
