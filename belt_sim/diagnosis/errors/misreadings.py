"""What looks wrong in a campaign once the model's own path is taken off its readings."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from belt_sim.campaign import Campaign, Suspicion
from belt_sim.campaign.quality import check_starts, counted_from_yaw, records_of
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.noise.metric import FREE_ZERO

CLEARED = 30.0  # chi2 that one record read another way has to clear; no chance among all records does that
ALONE = 0.1  # share of it that the same may clear in another run: what an effect does, it does in several
WITHIN = 4.0  # sigmas of its chi2 that the run may then still be from what noise makes of it
UNDONE = 0.5  # share of the chi2 beyond noise that a turned sign must at least account for
LEFT = 0.05  # share of the chi2 cleared that may stay beside that: settings and noise levels are not known exactly


def free_zeros(campaign: Campaign, suspicions: Sequence[Suspicion]) -> Campaign:
    """The campaign with any zero allowed to signals whose runs begin further from zero than the sheet allows."""
    free = {name for s in suspicions if s.kind == "zero" for name in s.signals}
    signals = tuple(replace(s, zero=max(s.zero, FREE_ZERO)) if s.name in free else s for s in campaign.signals)
    return replace(campaign, signals=signals) if free else campaign


def confirm_signs(bench: Workbench, values: np.ndarray, suspicions: Sequence[Suspicion]) -> tuple[Suspicion, ...]:
    """``suspicions`` of the data by themselves, each sign judged by what is left beside ``values`` (R, S, n) once it is
    turned back.

    A sign that accounts for less than half is to be looked at only: a fault of the machine larger than the yaw turns
    readings as well. A column that was to be looked at stops the diagnosis where noise is all that is left.
    """
    return tuple(_confirm_sign(bench, values, s) if s.kind == "wrong_sign" else s for s in suspicions)


def _confirm_sign(bench: Workbench, values: np.ndarray, told: Suspicion) -> Suspicion:
    """``told`` with the severity that the model gives it."""
    samples, before = bench.samples, _excess_chi2(bench, values, bench.fitted.y)
    runs = [r for r, run in enumerate(samples.runs) if told.run in (None, run.name) and run.use == "fit"]
    if not runs:
        return told
    lateral = [k for k, s in enumerate(samples.signals) if s.kind == "lateral"]
    own = [k for k in lateral if samples.signals[k].name == told.signal]
    if told.severity == "stop":  # of one signal or all, or of the one that fits
        left = min(_left_by_turning(bench, values, runs, turned) for turned in (own, lateral, *([k] for k in lateral)))
        return told if left < UNDONE * np.sum(before[runs]) else replace(told, severity="look")
    if told.run is not None:
        return told
    left = _left_by_turning(bench, values, runs, own)
    cleared, count = float(np.sum(before[runs])) - left, np.isfinite(bench.fitted.y[runs]).sum()
    return replace(told, severity="stop") if _leaves_noise(left, cleared, count) else told


def _left_by_turning(bench: Workbench, values: np.ndarray, runs: Sequence[int], signals: Sequence[int]) -> float:
    """chi2 beyond noise that is left in ``runs`` with the sign of ``signals`` turned there."""
    y = bench.fitted.y.copy()
    y[np.ix_(runs, signals)] *= -1.0
    return float(np.sum(_excess_chi2(bench, values, y)[runs]))


def _leaves_noise(left: float, cleared: float, count: int) -> bool:
    """Whether readings, read another way, ``cleared`` more chi2 than chance and have noise ``left``, of ``count``."""
    return cleared > CLEARED and left - WITHIN * np.sqrt(2.0 * count) < LEFT * cleared


def _excess_chi2(bench: Workbench, values: np.ndarray, y: np.ndarray) -> np.ndarray:
    """chi2 of readings y (R, S, n) beyond their number, run by run (R,)."""
    white = bench.metric.whiten(y - values).reshape(len(y), -1)
    return np.sum(white**2, axis=1) - np.isfinite(bench.fitted.y).sum(axis=(1, 2))


def find_faults(bench: Workbench, values: np.ndarray, suspicions: Sequence[Suspicion]) -> tuple[Suspicion, ...]:
    """What is wrong, worst first: ``suspicions`` of the data by themselves, and what ``values`` (R, S, n) show."""
    seen = confirm_signs(bench, values, suspicions)
    if all(s.kind == "dropout" and s.severity == "look" for s in seen):  # what was left out says nothing of the rest
        seen = (*seen, *find_offsets(bench, values))
    return seen if any(s.severity == "stop" for s in seen) else (*find_misread_run(bench, values), *seen)


def find_misread_run(bench: Workbench, values: np.ndarray) -> tuple[Suspicion, ...]:
    """The run in which a single record with its sign turned, or two exchanged, is all that the model does not explain.

    What a machine does shows in more than one record; what a hand did is undone to within noise.
    """
    before, count = _excess_chi2(bench, values, bench.fitted.y), np.isfinite(bench.fitted.y).sum(axis=(1, 2))
    gains, found = defaultdict[tuple, list[float]](list), []
    for r, told, read in _alternative_readings(bench):
        y = bench.fitted.y.copy()
        y[r] = read
        after = _excess_chi2(bench, values, y)
        gain = float(np.sum(before - after))
        gains[told.kind, told.signal].append(gain)
        if _leaves_noise(after[r], gain, count[r]):
            found.append((gain, r, told))
    if len({r for _, r, _ in found}) != 1:
        return ()  # in several runs: the model lacks something
    gain, _, told = max(found, key=lambda f: f[0])
    others = sorted(gains[told.kind, told.signal])[:-1]
    return (told,) if max(others, default=0.0) < ALONE * gain else ()


def _alternative_readings(bench: Workbench) -> Iterator[tuple[int, Suspicion, np.ndarray]]:
    """A run with a sign turned (of one signal, of the yaw) or with two signals exchanged: which, what was done to it,
    and its readings (S, n) with that undone.
    """
    y = bench.fitted.y
    lateral = [s for s, signal in enumerate(bench.samples.signals) if signal.kind == "lateral"]
    for r, run in enumerate(bench.samples.runs):
        there = [s for s in lateral if np.isfinite(y[r, s]).any()]
        for turned in [[s] for s in there] + ([there] if len(there) > 1 else []):
            name = bench.samples.signals[turned[0]].name if len(turned) == 1 else None
            whose = "its sign" if name else "the sign of its yaw"
            words = f"fits the model with {whose} turned round, and nothing else in this run is off"
            read = y[r].copy()
            read[turned] *= -1.0
            yield r, Suspicion(run=run.name, signals=(name,) if name else (), kind="wrong_sign", sentence=words), read
        for s, t in combinations(there, 2):
            if np.array_equal(np.isfinite(y[r, s]), np.isfinite(y[r, t])):
                both = tuple(bench.samples.signals[k].name for k in (s, t))
                words = "fit the model with the two exchanged, and nothing else in this run is off"
                read = y[r].copy()
                read[[s, t]] = read[[t, s]]
                yield r, Suspicion(run=run.name, signals=both, kind="swapped", sentence=words), read


def find_offsets(bench: Workbench, values: np.ndarray) -> tuple[Suspicion, ...]:
    """Runs that do not begin where ``values`` (R, S, n) do, by more than the sheet's errors allow."""
    samples = bench.samples
    rest = samples.y - values
    runs = []
    for r, run in enumerate(samples.runs):
        own = np.concatenate([[True], np.diff(samples.travel[r]) > 0])  # shorter records are padded
        signals = {s.name: rest[r, k, own] for k, s in enumerate(samples.signals) if s.name in run.signals}
        runs.append(replace(run, travel=samples.travel[r, own], time=None, signals=signals))
    left = replace(bench.campaign, runs=tuple(runs))
    return tuple(check_starts(left, counted_from_yaw(records_of(left)), curvature_share=0.0))
