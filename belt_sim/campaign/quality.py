"""Data quality before any fit and without any belt model: records, their scatter and spikes, and checks of signals.

The checks find sensors that clip, stick or drop out, slipped units and shifted runs, by magnitude and by repetition;
``kinematics`` judges what all belts share.
"""

import math
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from belt_sim.campaign.types import Campaign, Run, SignalSheet, rig_of, shortlist
from belt_sim.units import MM

SuspicionKind = Literal[
    "unit_slip", "clipped", "swapped", "wrong_sign", "dropout", "shifted", "zero", "same_place", "guided", "sheet",
    "repeats", "travel", "running_start",
]  # fmt: skip
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
#: Readings below which a record says nothing about its noise or its repetitions.
FEWEST_READINGS = 12
FEWEST_ON_LINE = 6  # readings of a straight line
FEWEST_RUNS = 4
#: A spike stands this many sigmas of scatter out of its neighbours; heavy tails (Student's t with
#: 3 degrees of freedom) reach 200 once in a million readings.
SPIKE, LONE_SPIKE, SPIKES = 40.0, 200.0, 3
#: Rows that one spike lasts at most, and the share of a record that may be spikes: more makes a broken sensor.
LONGEST_SPIKE, MOST_SPIKES = 4, 0.05
#: Equal readings in a row that are never taken for chance, and the factor on the longest streak expected.
STREAK, STREAK_FACTOR = 8, 3.0
#: Readings at the extreme value against those at the three values next to it.
PILE, PILE_FACTOR = 6, 4.0
#: Steps between values by which a record has left that at which it began.
AT_REST = 2.5
#: Scatter of a record that is taken at least, over the stated noise: readings that hardly differ have no spikes.
LEAST_SCATTER = 0.1
MOST_STUCK = 0.1  # share of a record: more makes a broken sensor
#: Rows whose median stands before and after a step of the readings, and how often such a step exceeds what all but a
#: tenth of them reach: of 1,859 records without a fault the largest is 3.6 times as large.
STEP_ROWS, STEP_SIZE = 4, 5.0
#: Places of bad readings that a sentence lists.
LISTED = 6
#: A blank stretch is a gap when it is this share of the record and this many usual steps.
GAP_SHARE, GAP_STEPS = 0.03, 10.0
#: Scatter over its stated size beyond which it is a slip (inch: 25; milli: 1000); stated noise errs by 40 %.
NOISE_FACTOR = 6.0
#: Root mean square of lateral readings over |yaw| times travel: linear belts give 0.05 to 0.4.
TINY, HUGE = 0.01, 3.0
#: Factor on step and length of the travel, against other runs, or on travel/(speed time), that is a slip.
TRAVEL_FACTOR = 20.0
#: Smaller slips of travel over speed times time (tenfold, inches, minutes), told where they are met to SLIP_WITHIN.
SLIPS, SLIP_WITHIN = np.array([10.0, 0.1, 25.4, 1.0 / 25.4, 60.0, 1.0 / 60.0]), 0.03
#: Share by which travel over speed times time may be off 1 in all runs alike: speeds are known to a percent.
ENCODER = 0.015
#: Length of the line as a share of a span, and its error by the curvature of the path, as a share of yaw times that.
LINE_SHARE, CURVATURE_SHARE = 0.08, 0.2
#: One run this many sigmas off is shifted. This rms over all runs means that ``zero`` is stated too small, or that it
#: was forgotten if none is stated.
SHIFTED, UNSTATED, FORGOTTEN = 12.0, 5.0, 1.8


@dataclass(frozen=True, kw_only=True)
class Record:
    """One signal of one run without blanks, all of shape (n,).

    rows: where the readings stand in the run; travel: since the yaw was applied [m]; readings [m or rad].
    """

    run: Run
    sheet: SignalSheet
    rows: np.ndarray
    travel: np.ndarray
    readings: np.ndarray

    @property
    def stated_noise(self) -> float:
        """Standard deviation expected of ``measured_noise`` from the stated sensor errors."""
        step = float(np.median(np.diff(self.travel))) if len(self.travel) > 1 else 0.0
        return math.hypot(self.sheet.white, scatter_of_wander(self.sheet.wander_sd, self.sheet.wander_length, step))

    @property
    def measured_noise(self) -> float:
        return scatter(self.readings)

    def at(self, travel: np.ndarray) -> np.ndarray:
        """Readings at travels (m,), by straight lines between those that were taken."""
        return np.interp(travel, self.travel, self.readings)

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.readings**2)))

    @property
    def drift_error(self) -> float:
        """One sigma of zero, wander and white noise together."""
        return math.hypot(self.sheet.zero, self.sheet.wander_sd, self.sheet.white)


def scatter(y: np.ndarray) -> float:
    """Return one sigma of the scatter from sample to sample of readings (n,), from the median second difference."""
    second = np.abs(np.diff(y, 2))
    return MAD_TO_SIGMA * float(np.median(second)) / math.sqrt(6.0) if second.size else 0.0


def scatter_of_wander(sd: float, length: float, step: float) -> float:
    """Return the ``scatter`` of samples a step apart that wander with the correlation exp(-distance/length) gives.

    Second differences have the variance 6 w^2 for white noise w, and sd^2 (6 - 8 c + 2 c^2) = 2 sd^2 (1 - c) (3 - c)
    for wander with c = exp(-step/length). sd [m or rad]; length, step [m].
    """
    c = math.exp(-step / length)
    return sd * math.sqrt((1.0 - c) * (3.0 - c) / 3.0)


def resolution(y: np.ndarray) -> float:
    """Return the smallest step between distinct readings (n,), rounding aside; 0 if all are equal."""
    steps = np.diff(np.unique(y))
    steps = steps[steps > 1e-9 * np.abs(y).max(initial=0.0)]
    return float(steps.min()) if steps.size else 0.0


def records_of(campaign: Campaign) -> list[Record]:
    """Return the records of all signals of all runs that have a reading."""
    sheets, found = {sheet.name: sheet for sheet in campaign.signals}, []
    for run, (name, y) in ((r, signal) for r in campaign.runs for signal in r.signals.items()):
        rows = np.flatnonzero(np.isfinite(y))
        travel = run.travel[rows] - run.yaw_at
        found.append(Record(run=run, sheet=sheets[name], rows=rows, travel=travel, readings=y[rows]))
    return found


def pairs_at(records: list[Record], one: str, other: str) -> list[tuple[Record, Record]]:
    """Return the records of two places in every run that has both; of two sensors at a place, the first."""
    at, also = ({r.run.name: r for r in reversed(records) if r.sheet.at == place} for place in (one, other))
    runs = dict.fromkeys(r.run.name for r in records)
    return [(at[run], also[run]) for run in runs if run in at and run in also]


def counted_from_yaw(records: list[Record]) -> list[Record]:
    """Return records with their readings counted from the last rows before the yaw, where there are such rows.

    What a machine does before the yaw is no error of zero, wherever its sensors were set to zero.
    """
    lateral = (reading_at_yaw(r.travel, r.readings) if r.sheet.kind == "lateral" else 0.0 for r in records)
    return [replace(r, readings=r.readings - at_yaw) for r, at_yaw in zip(records, lateral, strict=True)]


def reading_at_yaw(travel: np.ndarray, readings: np.ndarray) -> float:
    """The reading at the yaw, by a line through the last of the rows before it; travel (n,): from the yaw [m].

    The mean of these rows where they are too few for a line; 0 where there are none.
    """
    before = np.flatnonzero((travel < 0.0) & np.isfinite(readings))[-FEWEST_ON_LINE:]
    s, y = travel[before], readings[before]
    if len(before) == FEWEST_ON_LINE:
        return float(np.polynomial.Polynomial.fit(s, y, 1)(0.0))
    return float(np.mean(y)) if len(before) else 0.0


def spike_sizes(y: np.ndarray, least: float, lone: float = LONE_SPIKE) -> np.ndarray:
    """Return how far readings (n,) that are spikes, several by SPIKE or one by ``lone``, stand off the median of their
    neighbours, over their scatter (``least`` at least); 0 of all others, and where nothing scatters.

    Near the ends the neighbours are those of the nearest whole window, carried on along their median slope.
    """
    width, last, local = 2 * LONGEST_SPIKE + 1, len(y) - 1 - LONGEST_SPIKE, np.array(y, float)
    place = np.arange(len(y))
    if len(y) >= width:
        local[LONGEST_SPIKE : last + 1] = np.median(np.lib.stride_tricks.sliding_window_view(y, width), axis=-1)
    for window, middle, end in ((y[:width], LONGEST_SPIKE, place < LONGEST_SPIKE), (y[-width:], last, place > last)):
        local[end] = np.median(window) + np.median(np.diff(window)) * (place[end] - middle)
    noise = max(scatter(y), least)
    jumps = np.abs(y - local) / noise if noise > 0.0 else np.zeros(len(y))
    spikes = np.where(jumps > SPIKE, jumps, 0.0)
    return spikes if np.count_nonzero(spikes) >= SPIKES or spikes.max() > lone else np.zeros(len(y))


def few_spikes(y: np.ndarray, least: float, lone: float = LONE_SPIKE) -> np.ndarray:
    """Return the places (k,) of the spikes in readings (n,); none where so many jump that the sensor is broken."""
    spikes = np.flatnonzero(spike_sizes(y, least, lone)) if len(y) >= FEWEST_READINGS else np.arange(0)
    return spikes if len(spikes) < MOST_SPIKES * len(y) else spikes[:0]


def leave_out_bad_readings(campaign: Campaign) -> tuple[Campaign, tuple[Suspicion, ...]]:
    """Return the campaign with spikes and short dropouts blanked, and what was left out where.

    A record of which too many readings are bad stays as it is: its sensor is broken (``check_record``).
    """
    signals, found = {run.name: dict(run.signals) for run in campaign.runs}, []
    for record in records_of(campaign):
        count = len(record.readings)
        if count < FEWEST_READINGS or len(stuck := _stuck_stretch(record)) > MOST_STUCK * count:
            continue
        others = np.delete(np.arange(count), stuck)
        spikes = others[few_spikes(record.readings[others], LEAST_SCATTER * record.stated_noise)]
        run, name = record.run, record.sheet.name
        bad = ("in a row are one and the same value", stuck), ("jump away from their neighbours and back", spikes)
        for what, rows in ((what, record.rows[places]) for what, places in bad if len(places)):
            signals[run.name][name] = readings = signals[run.name][name].copy()
            readings[rows] = np.nan
            places = shortlist((f"{s:.6g}" for s in run.travel[rows]), LISTED)
            sentence = f"{len(rows)} readings {what}, left out (travel {places} m)"
            found.append(Suspicion(run.name, (name,), "dropout", sentence, "look"))
    if found:
        campaign = replace(campaign, runs=tuple(replace(run, signals=signals[run.name]) for run in campaign.runs))
    return campaign, tuple(found)


def check_record(record: Record) -> list[Suspicion]:
    """Return at most one suspicion: stuck at a value, clipped, jumping away and back, or stepping."""
    y, s = record.readings, record.travel + record.run.yaw_at
    if len(y) < FEWEST_READINGS:
        return []
    kind: SuspicionKind = "dropout"
    severity: Severity = "stop"
    spikes = spike_sizes(y, LEAST_SCATTER * record.stated_noise)
    if len(stuck := _stuck_stretch(record)):
        what = "exactly 0" if y[stuck[0]] == 0.0 else "one and the same value"
        sentence = f"{len(stuck)} readings in a row are {what}, from travel {s[stuck[0]]:.6g} to {s[stuck[-1]]:.6g} m"
        sentence += ": the sensor dropped out or stuck"
    elif clipped := _clipped_values(y):
        kind, side = "clipped", "above" if clipped[0] == y.max() else "below"
        sentence = f"{np.sum(y == clipped[0])} readings are exactly the extreme value and none is {side} it: clipped"
    elif spikes.any():
        sentence = f"{np.count_nonzero(spikes)} readings jump by more than {SPIKE:g} times the scatter, the largest at"
        sentence += f" {s[int(np.argmax(spikes))]:.6g} m: the sensor drops out"
    elif record.sheet.kind != "lateral" or len(y) < 6 * STEP_ROWS:
        return []
    else:  # a step is larger than what scatter and movement make elsewhere; over a gap the belt moves on
        levels = np.median(np.lib.stride_tricks.sliding_window_view(y, STEP_ROWS), axis=1)
        steps = levels[STEP_ROWS:] - levels[:-STEP_ROWS]
        ways = record.travel[2 * STEP_ROWS - 1 :] - record.travel[: len(steps)]
        sizes = np.where(ways < 1.5 * np.median(ways), np.abs(steps), 0.0)
        row = int(np.argmax(sizes))
        least = max(record.measured_noise, LEAST_SCATTER * record.stated_noise, resolution(y))
        if sizes[row] <= max(SPIKE * least, STEP_SIZE * float(np.quantile(sizes, 0.9))):
            return []
        kind, severity = "shifted", "look"
        sentence = f"its readings step by {steps[row] / MM:+.2g} mm at travel {s[row + STEP_ROWS]:.6g} m: the sensor"
        sentence += " was moved or failed there, or the belt's edge has a step (a weld)"
    return [Suspicion(record.run.name, (record.sheet.name,), kind, sentence, severity)]


def _stuck_stretch(record: Record) -> np.ndarray:
    """Return the places (k,) of the longest streak of equal readings.

    None where a sensor of this resolution reaches it by chance (by all other streaks, as the longest says nothing about
    the resolution), and where it is at an extreme (that is clipping).
    """
    y = record.readings
    starts = np.concatenate([[0], np.flatnonzero(np.diff(y) != 0.0) + 1])
    lengths = np.diff(np.concatenate([starts, [len(y)]]))
    first, longest = int(starts[np.argmax(lengths)]), int(lengths.max())
    last, value = first + longest - 1, y[first]
    others = lengths[lengths < max(longest, 2)]
    equal = float((others - 1).sum()) / max(int(others.sum()), 1)
    expected = math.log(len(y)) / -math.log(equal) if 0.0 < equal < 1.0 else 0.0
    jump = max(abs(value - y[max(first - 1, 0)]), abs(value - y[min(last + 1, len(y) - 1)]))
    is_short = longest < max(STREAK, STREAK_FACTOR * expected) or (value == 0.0 and record.travel[last] <= 0.0)
    is_clipped = value in _clipped_values(y) and jump < SPIKE * record.stated_noise
    return np.arange(0) if is_short or is_clipped else np.arange(first, last + 1)


def _clipped_values(y: np.ndarray) -> list[float]:
    """Return the extremes at which readings pile up, more than at the three values next to it; the largest first.

    Those at which a record begins do not count: a belt that stands is one value to a coarse sensor, and leaves it to
    one side.
    """
    levels, counts = np.unique(y, return_counts=True)
    if len(levels) < 2:
        return []
    leaves = int(np.argmax(np.abs(y - y[0]) > AT_REST * np.median(np.diff(levels))))
    counts = counts - np.sum(y[:leaves, None] == levels, axis=0)
    ends = (levels[-1], counts[-1], counts[-4:-1].max()), (levels[0], counts[0], counts[1:4].max())
    return [float(v) for v, n, beside in ends if v != 0.0 and n >= PILE and n > PILE_FACTOR * beside]


def check_gaps(campaign: Campaign) -> list[Suspicion]:
    """Return long blank stretches inside signals, and signals that are missing in some runs only."""
    recorded, found = [run for run in campaign.runs if len(run.travel) >= FEWEST_READINGS], []
    usual = [s.name for s in campaign.signals if 2 * sum(s.name in r.signals for r in recorded) > len(recorded)]
    for run in recorded:
        told = dict.fromkeys(sorted({*usual} - {*run.signals}), "no readings at all, though most runs have them")
        for name, readings in run.signals.items():
            there = run.travel[np.isfinite(readings)]
            edges = np.concatenate([run.travel[:1], there, run.travel[-1:]])
            worst = int(np.argmax(np.diff(edges)))
            step = float(np.median(np.diff(there))) if len(there) > 1 else 0.0
            if np.diff(edges)[worst] > max(GAP_STEPS * step, GAP_SHARE * np.ptp(run.travel)):
                told[name] = f"no readings from travel {edges[worst]:.6g} to {edges[worst + 1]:.6g} m"
        found += [Suspicion(run.name, (name,), "dropout", sentence, "look") for name, sentence in told.items()]
    return found


def check_travel(campaign: Campaign) -> list[Suspicion]:
    """Return runs whose travel has another magnitude than the other runs, or than speed times time.

    A ratio to speed times time that all runs share to ENCODER and that is not 1 is of the wheel that counts the travel.
    """
    recorded = [run for run in campaign.runs if len(run.travel) > 2]
    sizes = {run.name: (np.median(np.diff(run.travel)), np.ptp(run.travel)) for run in recorded}  # step, length
    found, paces = [], []
    for run in recorded:
        others = [size for name, size in sizes.items() if name != run.name]
        ratios = np.array(sizes[run.name]) / np.median(others, axis=0) if len(others) > 1 else np.ones(2)
        pace, slipped = 1.0, ""
        if run.time is not None and (there := np.isfinite(run.time)).sum() > 2:
            pace = float(np.ptp(run.travel[there]) / (np.ptp(run.time[there]) * run.speed))
            paces.append(pace)
        if ratios.min() > TRAVEL_FACTOR or ratios.max() < 1.0 / TRAVEL_FACTOR:
            slipped = f"its travel is {ratios[1]:.3g} times that of the other runs: its unit has slipped"
        elif not 1.0 / TRAVEL_FACTOR < pace < TRAVEL_FACTOR or np.abs(pace / SLIPS - 1.0).min() < SLIP_WITHIN:
            slipped = f"travel is {pace:.3g} times speed times time: one of them is in another unit"
        found += [Suspicion(run.name, (), "unit_slip", slipped)] if slipped else []
    usual = float(np.median(paces or [1.0]))
    if not found and len(paces) >= FEWEST_RUNS and np.ptp(paces) < ENCODER < abs(usual - 1.0):
        sentence = (
            f"in every run travel is {usual:.4g} times speed times time: the wheel that counts the travel slips or is "
            f"scaled wrongly (true travel {1.0 / usual:.3g} times the recorded?), or the speed is; one turn of the "
            f"belt, mark to mark, is {float(rig_of(campaign).belt_length):.4g} m"
        )
        found.append(Suspicion(None, (), "travel", sentence, "look"))
    return found


def check_noise(records: list[Record]) -> list[Suspicion]:
    """Return scatter of another magnitude than stated: a unit slipped, in the data or in the sheet.

    A slip of one run also stands out from the other runs. A ratio common to all runs belongs to the signal: the
    sensor is noisier than stated, or its samples are too far apart to follow the belt's edge; it stops where lateral
    readings are far larger or smaller than a yawed belt can move.
    """
    found, sizes = [], defaultdict[str, list[float]](list)
    ratios: dict[str, dict[str, float]] = defaultdict(dict)
    for r in records:
        # a sensor's quantum, or a slip, may leave no more than steps of the last digits
        noise = max(r.measured_noise, resolution(r.readings) / math.sqrt(12.0))
        if len(r.readings) >= FEWEST_READINGS and noise > 0.0:
            ratios[r.sheet.name][r.run.name] = noise / r.stated_noise
        if r.sheet.kind == "lateral" and r.run.yaw != 0.0 and r.travel[-1] > 0.0:
            sizes[r.sheet.name].append(r.rms / (abs(r.run.yaw) * float(r.travel[-1])))
    for signal, of_run in ratios.items():
        off, odd = set[str](), set[str]()  # runs that are not as stated, and runs that are not as the other runs
        for run, ratio in of_run.items():
            others = [r for name, r in of_run.items() if name != run]
            off |= {run} if abs(math.log(ratio)) >= math.log(NOISE_FACTOR) else set()
            odd |= {run} if abs(math.log(ratio / np.median(others or [1.0]))) >= math.log(NOISE_FACTOR) else set()
        alone = odd if odd <= off else off
        if len(alone) < len(off):
            sentence = f"its scatter is {float(np.median([*of_run.values()])):.3g} times the stated one in every run:"
            size = float(np.median(sizes[signal] or [1.0]))
            severity: Severity = "look" if TINY < size < HUGE or not sizes[signal] else "stop"
            found.append(Suspicion(None, (signal,), "unit_slip", f"{sentence} unit or noise is wrong", severity))
        for run in (run for run in of_run if run in alone):
            sentence = f"its scatter is {of_run[run]:.3g} times the stated one: its unit slipped, or the sensor broke"
            found.append(Suspicion(run, (signal,), "unit_slip", sentence))
    return found


def check_starts(
    campaign: Campaign, records: list[Record], *, curvature_share: float = CURVATURE_SHARE
) -> list[Suspicion]:
    """Return runs that are shifted, and signals whose runs begin further from zero than the sheet allows.

    Judged by a straight line through the first readings after the yaw. curvature_share: 0 for residuals of a model,
    which have no path of their own.
    """
    found, reach = [], LINE_SHARE * campaign.machine.centre_distance.value
    for sheet in (s for s in campaign.signals if s.kind == "lateral"):
        starts, score = {}, {}  # run -> reading at the yaw [m], and over its sigma
        for record in (r for r in records if r.sheet.name == sheet.name and not r.run.runs_already):
            after = record.travel >= 0.0
            s, y = record.travel[after], record.readings[after]
            if len(s) < 4 * FEWEST_ON_LINE or s[0] > max(reach, s[1] - s[0]):
                continue
            count = max(FEWEST_ON_LINE, int(np.searchsorted(s, reach)))
            white = 2.0 * max(sheet.white, record.measured_noise) / math.sqrt(count)
            sigma = math.hypot(white, sheet.wander_sd, sheet.zero)
            sigma += curvature_share * abs(record.run.yaw) * float(s[count - 1])
            starts[record.run.name] = start = float(np.polynomial.Polynomial.fit(s[:count], y[:count], 1)(0.0))
            score[record.run.name] = abs(start) / sigma
        usual = max(float(np.median([*score.values()] or [1.0])), 1.0)
        shifted = [run for run in score if score[run] > SHIFTED * usual]
        for run in shifted:
            sentence = f"begins at {starts[run] / MM:.3g} mm, where y = 0 should be: this run is shifted"
            sentence += "; take its readings from where the point was when the yaw was applied"
            found.append(Suspicion(run, (sheet.name,), "shifted", sentence))
        rest = [run for run in score if run not in shifted]
        limit = FORGOTTEN if curvature_share == 0.0 and sheet.zero == 0.0 else UNSTATED
        if len(rest) >= FEWEST_RUNS and np.sqrt(np.mean([min(score[run], 20.0) ** 2 for run in rest])) > limit:
            size = np.sqrt(np.mean([starts[run] ** 2 for run in rest]))
            stated = f"states zero: {sheet.zero / MM:g} mm" if sheet.zero > 0.0 else "states no zero"
            sentence = f"its runs begin {size / MM:.2g} mm (rms) off y = 0, while the sheet {stated}: "
            sentence += "the zero of every run is what is left when belt and effects are fitted"
            found.append(Suspicion(None, (sheet.name,), "zero", sentence, "look"))
    return found


def off_the_pulleys(runs: Iterable[Run], width: float) -> list[Run]:
    """Return the runs of a belt of this width [m] that stood further off the middle than half of it, farthest first."""
    return sorted((run for run in runs if abs(run.y0 or 0.0) > 0.5 * width), key=lambda run: -abs(run.y0 or 0.0))
