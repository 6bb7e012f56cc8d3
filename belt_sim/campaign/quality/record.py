"""Records of single signals, their noise, and checks for clipping, dropouts, gaps and slipped units."""

import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.ndimage import median_filter

from belt_sim.campaign.types import Campaign, Run, SignalSheet

SuspicionKind = Literal[
    "unit_slip", "clipped", "swapped", "wrong_sign", "dropout", "shifted", "zero", "same_place", "guided", "sheet"
]
Severity = Literal["stop", "look"]


@dataclass(frozen=True)
class Suspicion:
    """A probable error in the data.

    run: where (None: in all runs); signals: names of the one or two signals concerned, () for all; sentence: what was
    observed; severity "stop": do not fit before it is cleared, "look": an effect of the machine could do the same.
    """

    run: str | None
    signals: tuple[str, ...]
    kind: SuspicionKind
    sentence: str
    severity: Severity = "stop"

    @property
    def signal(self) -> str | None:
        """The names of the signals in words, "y1" or "y1 and y4"; None for all signals."""
        return " and ".join(self.signals) or None

    def __str__(self) -> str:
        where = ", ".join(part for part in (f"run {self.run}" if self.run else "", self.signal) if part)
        return f"{where}: {self.sentence}" if where else self.sentence


#: Median absolute deviation -> standard deviation of a normal distribution.
MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True, kw_only=True)
class Record:
    """One signal of one run without blanks: travel since the yaw was applied [m], readings [m or rad], shape (n,)."""

    run: Run
    sheet: SignalSheet
    travel: np.ndarray
    readings: np.ndarray

    @property
    def stated_noise(self) -> float:
        """Standard deviation expected of ``measured_noise`` from the stated sensor errors.

        Second differences have the variance 6 w^2 for white noise, and less for wander with correlation exp(-d/length).
        """
        step = float(np.median(np.diff(self.travel))) if len(self.travel) > 1 else 0.0
        correlation = math.exp(-step / self.sheet.wander_length)
        wander = self.sheet.wander_sd**2 * (6.0 - 8.0 * correlation + 2.0 * correlation**2)
        return math.sqrt(self.sheet.white**2 + wander / 6.0)

    @property
    def measured_noise(self) -> float:
        """Standard deviation of the scatter from sample to sample, from the median second difference."""
        return scatter(self.readings)

    @property
    def drift_error(self) -> float:
        """One sigma of zero, wander and white noise together."""
        return math.hypot(self.sheet.zero, self.sheet.wander_sd, self.sheet.white)


def scatter(y: np.ndarray) -> float:
    """Return one sigma of the scatter from sample to sample of readings (n,), from the median second difference."""
    second = np.abs(np.diff(y, 2))
    return MAD_TO_SIGMA * float(np.median(second)) / math.sqrt(6.0) if second.size else 0.0


def resolution(y: np.ndarray) -> float:
    """Return the smallest step between distinct readings (n,); 0 if all are equal."""
    steps = np.diff(np.unique(y))
    return float(steps.min()) if steps.size else 0.0


def records_of(campaign: Campaign) -> list[Record]:
    """Return the records of all signals of all runs that have a reading."""
    sheets = {sheet.name: sheet for sheet in campaign.signals}
    found = []
    for run in campaign.runs:
        for name, readings in run.signals.items():
            there = np.isfinite(readings)
            travel = run.travel[there] - run.yaw_at
            found.append(Record(run=run, sheet=sheets[name], travel=travel, readings=readings[there]))
    return found


#: Shorter records say nothing about their noise or their repetitions.
FEWEST = 12
#: Equal readings in a row that are never taken for chance, and the factor on the longest streak expected.
STREAK, STREAK_FACTOR = 8, 3.0
#: Readings at the extreme value against those at the three values next to it.
PILE, PILE_FACTOR = 6, 4.0
#: A spike stands this many sigmas of scatter out of its neighbours; heavy tails (Student's t with
#: 3 degrees of freedom) reach 200 once in a million readings.
SPIKE, LONE_SPIKE, SPIKES = 40.0, 200.0, 3
#: Rows that one spike lasts at most, and the shares of a record that may be spikes and stuck readings: what is more
#: makes a broken sensor.
LONGEST_SPIKE, MOST_SPIKES, MOST_STUCK = 4, 0.05, 0.1
#: Places of bad readings that a sentence lists.
LISTED = 6
#: Scatter over its stated size beyond which it is a slip (inch: 25; milli: 1000); stated noise errs by 40 %.
NOISE_FACTOR = 6.0
#: Root mean square of lateral readings over |yaw| times travel: linear belts give 0.05 to 0.4.
TINY, HUGE = 0.01, 3.0
#: A blank stretch is a gap when it is this share of the record and this many usual steps.
GAP_SHARE, GAP_STEPS = 0.03, 10.0


def leave_out_bad_readings(campaign: Campaign) -> tuple[Campaign, tuple[Suspicion, ...]]:
    """Return the campaign with spikes and short dropouts blanked, and what was left out where.

    A record of which too many readings are bad stays as it is: its sensor is broken (``check_record``).
    """
    sheets = {sheet.name: sheet for sheet in campaign.signals}
    runs, found = list(campaign.runs), []
    for k, run in enumerate(campaign.runs):
        signals = dict(run.signals)
        for name, readings in run.signals.items():
            for what, rows in _bad_readings(run, sheets[name], readings):
                signals[name] = signals[name].copy()
                signals[name][rows] = np.nan
                at = run.travel[rows]
                places = ", ".join(f"{s:.6g}" for s in at[:LISTED]) + (" ..." if len(at) > LISTED else "")
                sentence = f"{len(at)} readings {what}, left out (travel {places} m)"
                found.append(Suspicion(run.name, (name,), "dropout", sentence, "look"))
        if any(signals[n] is not run.signals[n] for n in signals):
            runs[k] = replace(run, signals=signals)
    return (replace(campaign, runs=tuple(runs)) if found else campaign), tuple(found)


def _bad_readings(run: Run, sheet: SignalSheet, readings: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yield what is wrong with readings of a record that is sound but for them, and in which rows they stand."""
    there = np.flatnonzero(np.isfinite(readings))
    if len(there) < FEWEST:
        return
    record = Record(run=run, sheet=sheet, travel=run.travel[there] - run.yaw_at, readings=readings[there])
    first, last = _stuck_stretch(record)
    if last - first > MOST_STUCK * len(there):
        return
    if last > first:
        yield "in a row are one and the same value", there[first:last]
        travel, kept, there = (np.delete(x, np.s_[first:last]) for x in (record.travel, record.readings, there))
        record = replace(record, travel=travel, readings=kept)
    out = _jumps(record.readings, 0.1 * record.stated_noise)
    bad = out > SPIKE
    if (bad.sum() >= SPIKES or out.max() > LONE_SPIKE) and bad.mean() < MOST_SPIKES:
        yield "jump away from their neighbours and back", there[bad]


def check_record(record: Record) -> list[Suspicion]:
    """Return at most one suspicion: stuck at a value, clipped, or jumping away from its neighbours and back."""
    y, s = record.readings, record.travel + record.run.yaw_at
    if len(y) < FEWEST:
        return []
    first, end = _stuck_stretch(record)
    extremes = ((y.max(), "above"), (y.min(), "below")) if y.min() != y.max() else ()
    piled = [(value, side) for value, side in extremes if value != 0.0 and _is_piled(y, value)]
    out = _jumps(y, 0.1 * record.stated_noise)
    spikes = int((out > SPIKE).sum())
    kind: SuspicionKind = "dropout"
    if end > first:
        what = "exactly 0" if y[first] == 0.0 else "one and the same value"
        sentence = f"{end - first} readings in a row are {what}, from travel {s[first]:.6g} to {s[end - 1]:.6g} m"
        sentence += ": the sensor dropped out or stuck"
    elif piled:
        kind, (value, side) = "clipped", piled[0]
        sentence = f"{int((y == value).sum())} readings are exactly the extreme value and none is {side} it: clipped"
    elif spikes >= SPIKES or out.max() > LONE_SPIKE:
        sentence = f"{max(spikes, 1)} readings jump by more than {SPIKE:g} times the scatter, the largest at"
        sentence += f" {s[int(np.argmax(out))]:.6g} m: the sensor drops out"
    else:
        return []
    return [Suspicion(record.run.name, (record.sheet.name,), kind, sentence)]


def _streaks(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return starts and lengths of the streaks of exactly equal readings."""
    starts = np.concatenate([[0], np.flatnonzero(np.diff(y) != 0.0) + 1])
    return starts, np.diff(np.concatenate([starts, [len(y)]]))


def _chance_streak(y: np.ndarray, lengths: np.ndarray) -> float:
    """Return the length of a streak of equal readings that a sensor of this resolution does not reach by chance."""
    others = lengths[lengths < max(lengths.max(), 2)]
    equal = float((others - 1).sum()) / max(int(others.sum()), 1)
    expected = math.log(len(y)) / -math.log(equal) if 0.0 < equal < 1.0 else 0.0
    return max(STREAK, STREAK_FACTOR * expected)


def _stuck_stretch(record: Record) -> tuple[int, int]:
    """Return the first row of the longest streak of equal readings and the one after its last.

    They are equal where no streak is too long for chance, and where it is at an extreme (that is clipping).
    """
    y, s = record.readings, record.travel
    starts, lengths = _streaks(y)
    k = int(np.argmax(lengths))
    first, last = starts[k], starts[k] + lengths[k] - 1
    value = y[first]
    if lengths[k] < _chance_streak(y, lengths) or (value == 0.0 and s[last] <= 0.0):
        return 0, 0
    jump = max(abs(value - y[max(first - 1, 0)]), abs(value - y[min(last + 1, len(y) - 1)]))
    extreme = value in (y.min(), y.max()) and y.min() != y.max() and jump < SPIKE * record.stated_noise
    return (0, 0) if value != 0.0 and extreme and _is_piled(y, value) else (int(first), int(last) + 1)


def _is_piled(y: np.ndarray, value: float) -> bool:
    """Return whether readings pile up at an extreme, more than at the three values next to it."""
    levels, counts = np.unique(y, return_counts=True)
    count = int(counts[levels == value][0])
    neighbours = counts[1:4] if value == levels[0] else counts[-4:-1]
    return count >= PILE and count > PILE_FACTOR * (neighbours.max() if neighbours.size else 0)


def _jumps(y: np.ndarray, least: float) -> np.ndarray:
    """Return how far readings (n,) stand off the median of their neighbours, over their scatter (``least`` at least).

    Near the ends the neighbours are those of the nearest whole window, carried on along their median slope. 0 where
    nothing scatters.
    """
    width, last = 2 * LONGEST_SPIKE + 1, len(y) - 1 - LONGEST_SPIKE
    local, place = median_filter(y, width), np.arange(len(y))
    for window, middle, end in ((y[:width], LONGEST_SPIKE, place < LONGEST_SPIKE), (y[-width:], last, place > last)):
        local[end] = np.median(window) + np.median(np.diff(window)) * (place[end] - middle)
    noise = max(scatter(y), least)
    return np.abs(y - local) / noise if noise > 0.0 else np.zeros(len(y))


def spike_mask(readings: np.ndarray) -> np.ndarray:
    """Return which readings (n,) jump out of their neighbours by SPIKE times the scatter and back within four rows.

    Nothing where the scatter is not known, or where so many jump that the sensor is broken.
    """
    there = np.flatnonzero(np.isfinite(readings))
    mask = np.zeros(len(readings), dtype=bool)
    y = readings[there]
    if len(y) < FEWEST:
        return mask
    out = _jumps(y, resolution(y)) > SPIKE
    if out.mean() < MOST_SPIKES:
        mask[there[out]] = True
    return mask


def check_gaps(campaign: Campaign) -> list[Suspicion]:
    """Return long blank stretches inside signals, and signals that are missing in some runs only."""
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
                found.append(Suspicion(run.name, (name,), "dropout", sentence, "look"))
        for name in sorted({n for other in recorded for n in other.signals} - set(run.signals)):
            share = sum(name in other.signals for other in recorded) / len(recorded)
            if share > 0.5:
                sentence = "no readings at all, though most runs have them"
                found.append(Suspicion(run.name, (name,), "dropout", sentence, "look"))
    return found


def check_noise(records: list[Record]) -> list[Suspicion]:
    """Return scatter of another magnitude than stated: a unit slipped, in the data or in the sheet.

    A slip of one run also stands out from the other runs. A ratio common to all runs belongs to the signal: the
    sensor is noisier than stated, or its samples are too far apart to follow the belt's edge.
    """
    ratios: dict[str, dict[str, float]] = defaultdict(dict)
    for record in records:
        noise = record.measured_noise or resolution(record.readings)  # a slip may leave no more than the last digits
        if len(record.readings) >= FEWEST and noise > 0.0:
            ratios[record.sheet.name][record.run.name] = noise / record.stated_noise
    found = []
    for signal, of_run in ratios.items():
        off = {run: r for run, r in of_run.items() if _is_other_magnitude(r)}
        others = {run: [r for name, r in of_run.items() if name != run] or [1.0] for run in of_run}
        odd = {run for run, r in of_run.items() if _is_other_magnitude(r / float(np.median(others[run])))}
        alone = {run: r for run, r in off.items() if run in odd} if odd <= set(off) else off
        if len(alone) < len(off):
            typical = float(np.median(list(of_run.values())))
            sentence = f"its scatter is {typical:.3g} times the stated one in every run: unit or noise is wrong"
            severity: Severity = "stop" if _size_out_of_scale(signal, records) else "look"
            found.append(Suspicion(None, (signal,), "unit_slip", sentence, severity))
        for run, ratio in alone.items():
            sentence = f"its scatter is {ratio:.3g} times the stated one: its unit slipped, or the sensor broke"
            found.append(Suspicion(run, (signal,), "unit_slip", sentence))
    return found


def _is_other_magnitude(ratio: float) -> bool:
    """Return whether a ratio is of another magnitude."""
    return not 1.0 / NOISE_FACTOR < ratio < NOISE_FACTOR


def _size_out_of_scale(signal: str, records: list[Record]) -> bool:
    """Return whether lateral readings are far larger or smaller than a yawed belt can move."""
    sizes = [
        float(np.sqrt(np.mean(r.readings**2))) / (abs(r.run.yaw) * float(r.travel[-1]))
        for r in records
        if r.sheet.name == signal and r.sheet.kind == "lateral" and r.run.yaw != 0.0 and r.travel[-1] > 0.0
    ]
    return bool(sizes) and not TINY < float(np.median(sizes)) < HUGE
