"""What looks wrong in a campaign once the model's own path is taken off its readings."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np

from belt_sim.campaign import Suspicion
from belt_sim.campaign.offsets import shifted_runs
from belt_sim.campaign.record import records
from belt_sim.diagnosis.workbench import Workbench

CLEARED = 60.0  # chi2 that one record read another way has to clear; no chance among all records does that
WITHIN = 4.0  # sigmas of its chi2 that the run may then still be from what noise makes of it
LEFT = 0.05  # share of the chi2 cleared that may stay beside that: settings and noise levels are not known exactly


def set_up(bench: Workbench, values: np.ndarray) -> tuple[Suspicion, ...]:
    """Everything that ``values`` (R, S, n) show: runs that are shifted, records that are turned round or exchanged."""
    return offsets(bench, values) or misread(bench, values)


def misread(bench: Workbench, values: np.ndarray) -> tuple[Suspicion, ...]:
    """The run in which a single record with its sign turned, or two exchanged, is all that the model does not explain.

    What a machine does shows in more than one record; what a hand did is undone to within noise.
    """
    y = bench.fitted.y
    runs = len(y)

    def of_runs(errors: np.ndarray) -> np.ndarray:
        return np.sum(bench.metric.whiten(errors).reshape(*errors.shape[:-3], runs, -1) ** 2, axis=-1)

    ways = list(_other_ways(bench, y))
    if not ways:
        return ()
    before = of_runs(y - values)
    other = np.repeat((y - values)[None], len(ways), axis=0)
    for k, (r, _, read) in enumerate(ways):
        other[k, r] = read - values[r]
    after = of_runs(other)
    cleared = before.sum() - after.sum(axis=1)
    count = np.isfinite(y).sum(axis=(1, 2))
    found = []
    for (r, told, _), gain, left in zip(ways, cleared, after, strict=True):
        rest = left[r] - count[r] - WITHIN * np.sqrt(2.0 * count[r])
        if gain > CLEARED and rest < LEFT * gain:
            found.append((float(gain), r, replace(told, run=bench.samples.runs[r].name)))
    if len({r for _, r, _ in found}) != 1:
        return ()  # in several runs: the model lacks something
    return (max(found, key=lambda f: f[0])[2],)


def _other_ways(bench: Workbench, y: np.ndarray) -> Iterator[tuple[int, Suspicion, np.ndarray]]:
    """Runs, what was done to one, and its readings (S, n) with that undone."""
    lateral = [s for s, signal in enumerate(bench.samples.signals) if signal.kind == "lateral"]
    for r in range(len(y)):
        there = [s for s in lateral if np.isfinite(y[r, s]).any()]
        for s in there:
            name, read = bench.samples.signals[s].name, y[r].copy()
            read[s] *= -1.0
            words = "fits the model with its sign turned round, and nothing else in this run is off"
            yield r, Suspicion(run=None, signal=name, kind="wrong_sign", sentence=words), read
        for s, t in combinations(there, 2):
            if np.array_equal(np.isfinite(y[r, s]), np.isfinite(y[r, t])):
                names, read = (f"{bench.samples.signals[k].name}" for k in (s, t)), y[r].copy()
                read[[s, t]] = read[[t, s]]
                words = "fit the model with the two exchanged, and nothing else in this run is off"
                yield r, Suspicion(run=None, signal=" and ".join(names), kind="swapped", sentence=words), read


def offsets(bench: Workbench, values: np.ndarray) -> tuple[Suspicion, ...]:
    """Runs that do not begin where ``values`` (R, S, n) do, by more than the sheet's errors allow."""
    samples = bench.samples
    rest = samples.y - values
    runs = []
    for r, run in enumerate(samples.runs):
        own = np.concatenate([[True], np.diff(samples.travel[r]) > 0])  # shorter records are padded
        signals = {s.name: rest[r, k, own] for k, s in enumerate(samples.signals) if s.name in run.signals}
        runs.append(replace(run, travel=samples.travel[r, own], time=None, signals=signals))
    left = replace(bench.campaign, runs=tuple(runs))
    return tuple(shifted_runs(left, records(left), bent=0.0))
