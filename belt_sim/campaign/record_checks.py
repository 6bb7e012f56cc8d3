"""Checks of single records: clipped, stuck, dropped out, or with a noise of another magnitude than stated."""

import math
from collections import defaultdict

import numpy as np

from belt_sim.campaign.nouns import Campaign
from belt_sim.campaign.record import Record
from belt_sim.campaign.suspect import Severity, Suspicion, SuspicionKind

#: Shorter records say nothing about their noise or their repetitions.
FEWEST = 12
#: Equal readings in a row that are never taken for chance, and the factor on the longest streak expected.
STREAK, STREAK_FACTOR = 8, 3.0
#: Readings at the extreme value against those at the three values next to it.
PILE, PILE_FACTOR = 6, 4.0
#: A spike stands this many sigmas of scatter out of its neighbours; heavy tails (Student's t with
#: 3 degrees of freedom) reach 200 once in a million readings.
SPIKE, LONE_SPIKE, SPIKES = 40.0, 200.0, 3
#: Scatter over its stated size beyond which it is a slip (inch: 25; milli: 1000); stated noise errs by 40 %.
NOISE_FACTOR = 6.0
#: Root mean square of lateral readings over |yaw| times travel: linear belts give 0.05 to 0.4.
TINY, HUGE = 0.01, 3.0
#: A blank stretch is a gap when it is this share of the record and this many usual steps.
GAP_SHARE, GAP_STEPS = 0.03, 10.0


def broken_record(record: Record) -> list[Suspicion]:
    """Clipped, stuck at a value, or interrupted by spikes."""
    if len(record.readings) < FEWEST:
        return []
    for check in (_stuck, _clipped, _spikes):
        sentence, kind = check(record)
        if sentence:
            return [Suspicion(run=record.run.name, signal=record.sheet.name, kind=kind, sentence=sentence)]
    return []


def _streaks(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where streaks of exactly equal readings begin, and how long they are."""
    starts = np.concatenate([[0], np.flatnonzero(np.diff(y) != 0.0) + 1])
    return starts, np.diff(np.concatenate([starts, [len(y)]]))


def _chance_streak(y: np.ndarray, lengths: np.ndarray) -> float:
    """A length that equal readings in a row do not reach by chance, for a sensor of this resolution."""
    others = lengths[lengths < max(lengths.max(), 2)]
    equal = float((others - 1).sum()) / max(int(others.sum()), 1)
    expected = math.log(len(y)) / -math.log(equal) if 0.0 < equal < 1.0 else 0.0
    return max(STREAK, STREAK_FACTOR * expected)


def _stuck(record: Record) -> tuple[str, SuspicionKind]:
    """The longest streak of equal readings, away from the extremes (those are clipping)."""
    y, s = record.readings, record.travel
    starts, lengths = _streaks(y)
    k = int(np.argmax(lengths))
    first, last = starts[k], starts[k] + lengths[k] - 1
    value = y[first]
    if lengths[k] < _chance_streak(y, lengths) or (value == 0.0 and s[last] <= 0.0):
        return "", "dropout"
    jump = max(abs(value - y[max(first - 1, 0)]), abs(value - y[min(last + 1, len(y) - 1)]))
    extreme = value in (y.min(), y.max()) and y.min() != y.max() and jump < SPIKE * record.stated_noise
    if value != 0.0 and extreme and _is_piled(y, value):
        return "", "dropout"
    place = f"from travel {s[first] + record.run.yaw_at:.6g} to {s[last] + record.run.yaw_at:.6g} m"
    what = "exactly 0" if value == 0.0 else "one and the same value"
    return f"{lengths[k]} readings in a row are {what}, {place}: the sensor dropped out or stuck", "dropout"


def _is_piled(y: np.ndarray, value: float) -> bool:
    """Whether readings pile up at an extreme, more than at the three values next to it."""
    levels, counts = np.unique(y, return_counts=True)
    at = int(counts[levels == value][0])
    near = counts[1:4] if value == levels[0] else counts[-4:-1]
    return at >= PILE and at > PILE_FACTOR * (near.max() if near.size else 0)


def _clipped(record: Record) -> tuple[str, SuspicionKind]:
    y = record.readings
    for value, side in ((y.max(), "above"), (y.min(), "below")):
        if value != 0.0 and y.min() != y.max() and _is_piled(y, value):
            count = int((y == value).sum())
            return f"{count} readings are exactly the extreme value and none is {side} it: clipped", "clipped"
    return "", "clipped"


def _spikes(record: Record) -> tuple[str, SuspicionKind]:
    """Readings that jump out of their neighbours and back, or to a fill value."""
    y = record.readings
    padded = np.pad(y, 2, mode="edge")
    local = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    scatter = max(record.measured_noise, 0.1 * record.stated_noise)
    out = np.abs(y - local) / scatter
    places = np.flatnonzero(out > SPIKE)
    if len(places) >= SPIKES or (out > LONE_SPIKE).any():
        at = record.travel[int(np.argmax(out))] + record.run.yaw_at
        count = max(len(places), 1)
        sentence = f"{count} readings jump by more than {SPIKE:g} times the scatter, the largest at {at:.6g} m"
        return f"{sentence}: the sensor drops out", "dropout"
    return "", "dropout"


def gaps(campaign: Campaign) -> list[Suspicion]:
    """Long blank stretches inside a signal, and signals missing in some runs only."""
    found = []
    recorded = [run for run in campaign.runs if len(run.travel) >= FEWEST]
    for run in recorded:
        for name, readings in run.signals.items():
            there = run.travel[np.isfinite(readings)]
            edges = np.concatenate([run.travel[:1], there, run.travel[-1:]])
            steps = np.diff(edges)
            worst = int(np.argmax(steps))
            usual = float(np.median(np.diff(there))) if len(there) > 1 else 0.0
            if steps[worst] > max(GAP_STEPS * usual, GAP_SHARE * (run.travel[-1] - run.travel[0])):
                sentence = f"no readings from travel {edges[worst]:.6g} to {edges[worst + 1]:.6g} m"
                found.append(Suspicion(run=run.name, signal=name, kind="dropout", sentence=sentence))
        for name in sorted({n for other in recorded for n in other.signals} - set(run.signals)):
            share = sum(name in other.signals for other in recorded) / len(recorded)
            if share > 0.5:
                sentence = "no readings at all, though most runs have them"
                found.append(Suspicion(run=run.name, signal=name, kind="dropout", sentence=sentence, severity="look"))
    return found


def noise_out_of_scale(records: list[Record]) -> list[Suspicion]:
    """Scatter of another magnitude than stated: a unit slipped, in the data or in the sheet.

    A slip of one run shows beside the other runs too. What all runs of a signal show alike is the signal's: a noisier
    sensor than stated, or a belt's edge that is read too seldom to be followed.
    """
    ratios: dict[str, dict[str, float]] = defaultdict(dict)
    for record in records:
        scatter = record.measured_noise or record.digit  # a slip may leave no more of it than the last digits show
        if len(record.readings) >= FEWEST and scatter > 0.0:
            ratios[record.sheet.name][record.run.name] = scatter / record.stated_noise
    found = []
    for signal, of_run in ratios.items():
        off = {run: r for run, r in of_run.items() if _slipped(r)}
        odd = {run for run, r in of_run.items() if _slipped(r / _usual(of_run, run))}
        alone = {run: r for run, r in off.items() if run in odd} if odd <= set(off) else off
        if len(alone) < len(off):
            typical = float(np.median(list(of_run.values())))
            sentence = f"its scatter is {typical:.3g} times the stated one in every run: unit or noise is wrong"
            severity: Severity = "stop" if _size_out_of_scale(signal, records) else "look"
            slip = Suspicion(run=None, signal=signal, kind="unit_slip", sentence=sentence, severity=severity)
            found.append(slip)
        for run, ratio in alone.items():
            sentence = f"its scatter is {ratio:.3g} times the stated one: its unit slipped, or the sensor broke"
            found.append(Suspicion(run=run, signal=signal, kind="unit_slip", sentence=sentence))
    return found


def _slipped(ratio: float) -> bool:
    """Whether a ratio is of another magnitude."""
    return not 1.0 / NOISE_FACTOR < ratio < NOISE_FACTOR


def _usual(of_run: dict[str, float], run: str) -> float:
    """Scatter over the stated one in the other runs; as stated where there is none."""
    others = [r for name, r in of_run.items() if name != run]
    return float(np.median(others)) if others else 1.0


def _size_out_of_scale(signal: str, records: list[Record]) -> bool:
    """Whether lateral readings are far larger or smaller than a yawed belt can move."""
    sizes = [
        float(np.sqrt(np.mean(r.readings**2))) / (abs(r.run.yaw) * float(r.travel[-1]))
        for r in records
        if r.sheet.name == signal and r.sheet.kind == "lateral" and r.run.yaw != 0.0 and r.travel[-1] > 0.0
    ]
    return bool(sizes) and not TINY < float(np.median(sizes)) < HUGE
