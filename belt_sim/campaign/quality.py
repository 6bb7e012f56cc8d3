"""Data-quality checks of a campaign, before any fit and without any belt model.

They find sensors that clip, stick or drop out, slipped units, exchanged columns and turned signs, by magnitude, by
repetition, and by kinematics that all belts share.
"""

import math
from collections import defaultdict
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import combinations
from typing import Literal, NamedTuple

import numpy as np

from belt_sim.campaign.types import Campaign, Run, SignalSheet, rig_of, shortlist
from belt_sim.units import MM, N_PER_MM2

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


#: Equal readings in a row that are never taken for chance, and the factor on the longest streak expected.
STREAK, STREAK_FACTOR = 8, 3.0
#: Readings at the extreme value against those at the three values next to it.
PILE, PILE_FACTOR = 6, 4.0
#: Steps between values by which a record has left that at which it began.
AT_REST = 2.5
#: A spike stands this many sigmas of scatter out of its neighbours; heavy tails (Student's t with
#: 3 degrees of freedom) reach 200 once in a million readings.
SPIKE, LONE_SPIKE, SPIKES = 40.0, 200.0, 3
#: Scatter of a record that is taken at least, over the stated noise: readings that hardly differ have no spikes.
LEAST_SCATTER = 0.1
#: Rows that one spike lasts at most, and the shares of a record that may be spikes and stuck readings: what is more
#: makes a broken sensor.
LONGEST_SPIKE, MOST_SPIKES, MOST_STUCK = 4, 0.05, 0.1
#: Rows whose median stands before and after a step of the readings, and how often such a step exceeds what all but a
#: tenth of them reach: of 1,859 records without a fault the largest is 3.6 times as large.
STEP_ROWS, STEP = 4, 5.0
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
#: Length of the line as a share of a span, its fewest readings, and its error by the curvature of the path, as a share
#: of yaw times its length.
LINE_SHARE, FEWEST_ON_LINE, CURVATURE_SHARE = 0.08, 6, 0.2
#: One run this many sigmas off is shifted. This rms over all runs means that ``zero`` is stated too small, or that it
#: was forgotten if none is stated.
SHIFTED, UNSTATED, FORGOTTEN = 12.0, 5.0, 1.8
FEWEST_RUNS = 4


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
        if sizes[row] <= max(SPIKE * least, STEP * float(np.quantile(sizes, 0.9))):
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


def jumps(y: np.ndarray, least: float) -> np.ndarray:
    """Return how far readings (n,) stand off the median of their neighbours, over their scatter (``least`` at least).

    Near the ends the neighbours are those of the nearest whole window, carried on along their median slope. 0 where
    nothing scatters.
    """
    width, last, local = 2 * LONGEST_SPIKE + 1, len(y) - 1 - LONGEST_SPIKE, np.array(y, float)
    place = np.arange(len(y))
    if len(y) >= width:
        local[LONGEST_SPIKE : last + 1] = np.median(np.lib.stride_tricks.sliding_window_view(y, width), axis=-1)
    for window, middle, end in ((y[:width], LONGEST_SPIKE, place < LONGEST_SPIKE), (y[-width:], last, place > last)):
        local[end] = np.median(window) + np.median(np.diff(window)) * (place[end] - middle)
    noise = max(scatter(y), least)
    return np.abs(y - local) / noise if noise > 0.0 else np.zeros(len(y))


def spike_sizes(y: np.ndarray, least: float, lone: float = LONE_SPIKE) -> np.ndarray:
    """Return the ``jumps`` of readings (n,) that are spikes, several by SPIKE or one by ``lone``; 0 of all others."""
    out = jumps(y, least)
    spikes = np.where(out > SPIKE, out, 0.0)
    return spikes if np.count_nonzero(spikes) >= SPIKES or spikes.max() > lone else np.zeros(len(y))


def few_spikes(y: np.ndarray, least: float, lone: float = LONE_SPIKE) -> np.ndarray:
    """Return the places (k,) of the spikes in readings (n,); none where so many jump that the sensor is broken."""
    spikes = np.flatnonzero(spike_sizes(y, least, lone)) if len(y) >= FEWEST_READINGS else np.arange(0)
    return spikes if len(spikes) < MOST_SPIKES * len(y) else spikes[:0]


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


def check_running_start(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return a campaign whose records begin on a belt that runs off already, before any yaw could move it.

    Of a straight belt at rest the two pulleys begin unlike, as the lean spreads with the travel, and an edge that is
    not straight shows in opposite phases. So the rate before the yaw (or at the start of a run without yaw) is
    judged by its mean over both pulleys and all runs, against its scatter between them.
    """
    reach, rates, errors = 0.5 * float(rig_of(campaign).span_length), [], []
    for pair in (p for places in TAIL_AND_HEAD for p in pairs_at(records, *places) if p[0].run.run_in == 0.0):
        own = []  # rate and its error at tail and head
        for record in pair:
            early = record.travel - record.travel[0] < reach
            if record.run.yaw or record.run.yaw_head:
                early &= record.travel < 0.0
            s, y = record.travel[early], record.readings[early]
            if len(s) >= FEWEST_ON_LINE:
                error = math.hypot(record.sheet.white * math.sqrt(12.0 / len(s)), 2.0 * record.sheet.wander_sd)
                own.append((float(np.polynomial.Polynomial.fit(s, y, 1).deriv()(0.0)), error / float(np.ptp(s))))
        if len(own) == 2:
            rates.append(float(np.mean([rate for rate, _ in own])))
            errors.append(math.hypot(*(error for _, error in own)) / 2.0)
    if len(rates) < FEWEST_RUNS:
        return []
    rate = float(np.mean(rates))
    error = max(float(np.mean(errors)), float(np.std(rates, ddof=1))) / math.sqrt(len(rates))
    if abs(rate) < CLEAR_SIGMAS * error:
        return []
    sentence = (
        f"the belt runs off by {1e3 * rate:+.2g} mm/m (one sigma {1e3 * error:.1g}) before any yaw, at both pulleys "
        "alike: something acts without a yaw, as a cone does. If the belt already ran before the record, enter that "
        "distance as run_in_m in runs.csv (run_in of the run in an import's mapping)"
    )
    return [Suspicion(None, (), "running_start", sentence, "look")]


def check_repeats(campaign: Campaign) -> list[Suspicion]:
    """Return repeats that differ by more than sensors and settings explain: what would make the difference, in numbers.

    Of three runs at one setting and more each is compared with the median of the others, so that one that is spoilt is
    named and adds nothing to its own error; of two the second with the first. The difference is compared, without a
    model, with what the same run would do at another tension (by the runs at the same yaw), after another yaw (in
    proportion), and with a further drift, beside what comes round with the belt; the time between the runs is told.
    """
    of_run: dict[str, dict[str, Record]] = defaultdict(dict)
    for record in counted_from_yaw([r for r in records_of(campaign) if r.sheet.kind == "lateral"]):
        of_run[record.run.name][record.sheet.name] = record
    series, found = defaultdict[str, list[Run]](list), []
    for run in campaign.runs:
        series[run.repeat_of or run.name].append(run)
    for runs in series.values():
        alike = [run for run in runs if of_run[run.name].keys() & of_run[runs[0].name].keys()]
        names = sorted(set.intersection(*(set(of_run[run.name]) for run in alike))) if len(alike) > 1 else []
        found += _odd_repeats(campaign, of_run, alike, names) if names else []
    return found


def _odd_repeats(
    campaign: Campaign, of_run: dict[str, dict[str, Record]], alike: list[Run], names: list[str]
) -> list[Suspicion]:
    """Return the runs of one setting that differ from the others; of_run: records of every run by signal."""
    first, several, found = alike[0], len(alike) > 2, []
    end = min(of_run[run.name][n].travel[-1] for run in alike for n in names)
    s = np.linspace(0.0, end, 4 * _GRID)
    # a curved edge comes round with the belt, in another phase where a run starts elsewhere
    turns = end / float(rig_of(campaign).belt_length)
    phases = 2.0 * np.pi * turns * np.outer(s / end, np.arange(1, 1 + min(WAVES, int(len(s) / (4.0 * turns)))))
    waves = np.concatenate([np.cos(phases), np.sin(phases)], axis=1) if turns > ROUNDS else np.zeros((len(s), 0))

    def curves_of(run: Run) -> np.ndarray:
        records = [of_run[run.name][n] for n in names]
        return np.array([np.interp(s, r.travel, r.readings) for r in records]) * np.sign(run.yaw or 1.0)

    curves = np.array([curves_of(run) for run in alike])
    judged = alike if several else alike[1:]
    of_others = [np.median(np.delete(curves, alike.index(run), axis=0), axis=0) for run in judged]
    apart = curves[-len(judged) :] - of_others  # (runs, signals, travel)
    basis = np.hstack([np.vander(s / end, DEGREE + 1), waves])
    sizes = np.linalg.lstsq(basis, apart.reshape(-1, len(s)).T, rcond=None)[0]
    rounds = (waves @ sizes[DEGREE + 1 :]).T.reshape(apart.shape)  # what comes round with the belt
    off = np.abs((apart - rounds)[..., -len(s) // 5 :].mean(axis=2))  # (runs, signals)
    same_start = np.ptp([r.start or 0.0 for r in alike]) == 0.0
    elsewhere, heights = not (several and same_start), rounds.std(axis=(1, 2))
    for k, run in enumerate(judged):
        name, size = names[int(np.argmax(off[k]))], float(off[k].max())
        its = of_run[first.name][name]
        error = math.hypot(its.drift_error, 0.5 * campaign.settings.yaw_u * end)  # drift per yaw is about a half
        # its height at the yaw stays in all that follows; of several that of the others, as a fault has one too
        height = max(np.median(heights), heights[k]) if elsewhere else np.median(np.delete(heights, k))
        error = math.sqrt(2.0) * math.hypot(error, campaign.settings.tension_rel * its.rms, height)
        usual = float(np.median(np.delete(off.max(axis=1), k))) if several else math.inf
        beyond = size >= REPEATS_APART * error
        # a mean of many readings errs less
        odd = len(alike) > FEWEST_RUNS and size >= max(ODD_REPEAT * usual, 0.5 * REPEATS_APART * its.drift_error)
        if not (beyond or odd):
            continue

        def share(shape: np.ndarray, apart: np.ndarray = (apart - rounds)[k]) -> tuple[float, float]:
            """Return how much of a shape the difference holds, and which share of its squares that explains."""
            size = float(np.sum(shape * apart)) / max(float(np.sum(shape**2)), 1e-300)
            return size, 1.0 - float(np.sum((apart - size * shape) ** 2)) / float(np.sum(apart**2))

        times, explained = share(of_others[k])
        likely = [(explained, f"as after {1.0 + times:.3g} times the yaw")]
        drift, explained = share(np.tile(s, (len(names), 1)))
        likely.append((explained, f"as with a further drift of {1e3 * drift * np.sign(first.yaw or 1.0):+.2g} mm/m"))
        for other in campaign.runs:
            same = other.direction == first.direction and abs(abs(other.yaw) - abs(first.yaw)) < 0.05 * abs(first.yaw)
            there = of_run[other.name]
            reaches = all(n in there and there[n].travel[-1] >= end for n in names)
            if same and reaches and other.tension != first.tension:
                part, explained = share(curves_of(other) - of_others[k])
                part = float(np.clip(part, -9.0, 9.0))  # a difference of thousands is of no tension
                tension = first.tension * (other.tension / first.tension) ** part
                words = f"as at {tension / N_PER_MM2:.3g} N/mm2 instead of {first.tension / N_PER_MM2:.3g}"
                likely.append((explained, words))
        best, words = max(likely)
        others = f"the {len(alike) - 1} other runs of its setting" if several else f"its first run {first.name}"
        sentence = f"differs from {others} by {size / MM:.2g} mm in {name} (one sigma {error / MM:.1g})"
        sentence += "" if beyond else f", {size / usual:.0f} times as far as they do, most of them"
        sentence += _hours_between(first, run) if run is not first else ""
        sentence += f", {words} ({100.0 * best:.0f} % of the squares)" if best > 0.6 else ""
        sentence += "; leave it out if it is spoilt (skip: true in an import's mapping), else something changes between"
        sentence += " the runs: log tension, yaw and temperature with the time of day"
        alone = turns > ROUNDS or same_start  # else it may be the belt's edge
        found.append(Suspicion(run.name, (), "repeats", sentence, "stop" if alone and beyond else "look"))
    return found


def _hours_between(first: Run, run: Run) -> str:
    """Return how much later a run started, in words; "" where their clocks do not tell."""
    try:
        clocks = (r.started if "-" in r.started[:5] else f"2000-01-01T{r.started}" for r in (first, run))
        begun, ended = map(datetime.fromisoformat, clocks)
        hours = (ended - begun).total_seconds() / 3600.0
    except (ValueError, TypeError):
        return ""
    return f", {abs(hours):.2g} h {'later' if hours >= 0.0 else 'earlier'}"


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


TAIL_AND_HEAD = (("point_1", "point_4"), ("point_2", "point_3"), ("point_1", "point_3"), ("point_2", "point_4"))

# Constants of the decisions. Leads are in units of beta L/2; an error is zero, wander and white noise together.

#: Sigmas of its error that a lead, a slope or a curve must exceed to be judged.
CLEAR_SIGMAS = 6.0
#: The lead is judged once the belt has travelled this many spans.
LEAD_SPANS = 1.2
#: A lead below -REVERSED is turned round; outside LOW..HIGH the yaw is of another magnitude. Linear belts give 0.5 to
#: 1.7, with a pulley offset as large as the yaw itself 0 to 3.
REVERSED, LOW, HIGH = 0.45, 0.12, 6.0
#: Leads, and yaws, within this ratio are alike.
ALIKE_LEADS = 3.0
#: If a pulley offset is the reason, the runs of the other yaw sign have a lead above this.
OFFSET = 1.8
#: Late slopes come from the last LATE of records longer than SETTLED spans; MOST: share of runs that must agree.
LATE, SETTLED, MOST = 0.4, 3.5, 0.8
#: How much better the exchanged order of two points across a wrap must fit, as a ratio of variances.
WRAP_RATIO = 4.0
#: Readings of one place may differ by so many sigmas (rms over a run); what a yaw moves apart must exceed so many.
SAME_PLACE, OTHER_PLACE = 4.0, 8.0
#: Lead that any belt reaches once it has travelled two spans.
LEAST_LEAD = 0.3
#: Runs are compared if their tensions differ by less than this share.
SAME_TENSION = 0.2
#: Sigmas of sensors and settings by which repeats must differ in the end to be told.
REPEATS_APART = 4.0
#: One of five repeats and more is off that ends this many times as far from the others' median as they do in the
#: median: of repeats that scatter normally one series in 400.
ODD_REPEAT = 8.0
#: A curve (over yaw) is turned round if its cosine with another is below this, and its size within this ratio.
OPPOSED, ALIKE_SIZE = -0.8, 1.5
_GRID = 100


class Lead(NamedTuple):
    """Mean lead and drift of one run over beta L/2 [1], from one tail and one head signal, after a span; yaw [rad]."""

    tail: Record
    head: Record
    yaw: float
    lead: float
    drift: float


def check_leads(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return exchanged columns, turned signs and slipped yaw units, from the lead of the tail over the head.

    A run is judged where the lead or the yaw exceeds the errors, and its yaw is that of the tail.
    """
    span = float(rig_of(campaign).span_length)
    found: dict[tuple[str | None, str | None], Suspicion] = {}
    for places in TAIL_AND_HEAD:
        leads = []
        for tail, head in pairs_at(records, *places):
            run, scale, end = tail.run, tail.run.yaw * span / 2.0, min(tail.travel[-1], head.travel[-1])
            if scale == 0.0 or abs(run.yaw_head) > 0.2 * abs(run.yaw) or end < LEAD_SPANS * span or run.runs_already:
                continue
            s = np.linspace(span, end, _GRID)
            y_tail, y_head = (np.interp(s, r.travel, r.readings) for r in (tail, head))
            lead, drift = float(np.mean(y_tail - y_head)), float(np.mean(y_tail + y_head))
            if max(abs(lead), abs(scale) * LOW) >= CLEAR_SIGMAS * math.hypot(tail.drift_error, head.drift_error):
                leads.append(Lead(tail, head, run.yaw, lead / scale, drift / scale))
        for suspicion in _judge(leads, span) if leads else ():
            found.setdefault((suspicion.run, suspicion.kind), suspicion)
    return list(found.values())


def _judge(leads: list[Lead], span: float) -> list[Suspicion]:
    factors = np.array([lead.lead for lead in leads])
    common = len(leads) > 1 and factors.min() > 0.0 and factors.max() <= ALIKE_LEADS * factors.min()
    if common and (factors.min() > HIGH or factors.max() < LOW):
        sentence = f"in every run {leads[0].tail.sheet.name} and {leads[0].head.sheet.name} differ by about"
        sentence += f" {float(np.median(factors)):.2g} times what the stated yaw gives: the yaw (or the readings) is in"
        sentence += " another unit (rad or mrad written as yaw_deg?)"
        return [Suspicion(None, (), "unit_slip", sentence)]
    usual = float(np.median([abs(lead.yaw) for lead in leads]))

    def is_odd(lead: Lead) -> bool:
        size, yaw = abs(lead.lead), abs(lead.yaw)
        small = size * yaw < LOW * usual / 2.0 or (size < LOW and yaw > HIGH * usual)
        return (lead.lead < -REVERSED and yaw > 0.5 * usual) or small or size > HIGH

    odd, found = [lead for lead in leads if is_odd(lead)], []
    if not odd:
        return _turned_column(leads, span)
    for lead in odd:
        across = [other.lead for other in leads if other.yaw * lead.yaw < 0.0]
        if across and lead.lead < LOW and float(np.median(across)) > OFFSET:
            continue  # the yaw offset of a pulley explains it
        certain = len(odd) < len(leads) or bool(across)
        if lead.lead >= 0.0:  # certain if the yaw implied by the lead, but not the stated one, is that of other runs
            others = [abs(other.yaw) for other in leads if other is not lead]
            stated = abs(lead.yaw) / float(np.median(others)) if others else 1.0
            implied, stated = (abs(math.log(max(x, 1e-300))) for x in (stated * abs(lead.lead), stated))
            certain = implied < math.log(ALIKE_LEADS) <= stated
        found.append(_odd_lead(lead, "stop" if certain else "look"))
    if len(found) == len(leads) > 1 and len({s.kind for s in found}) == 1:
        return [replace(found[0], run=None, sentence=f"in every run: {found[0].sentence}")]
    return found


def _odd_lead(lead: Lead, severity: Severity) -> Suspicion:
    """Return what a lead that no belt has could come from."""
    run, names = lead.tail.run, (lead.tail.sheet.name, lead.head.sheet.name)
    if run.run_in > 0.0 and run.travel[0] >= run.yaw_at:  # no reading shows the belt before its yaw
        given = f"what the yaw of {math.degrees(lead.yaw):.3g} deg, set when the record began, gives"
        sentence = f"{' and '.join(names)} differ by {lead.lead:.2g} times {given}: it was on before (yaw_at_m below 0,"
        sentence += " or run_in_m: unknown), or else the two columns are exchanged, or a sign or a unit is another"
        return Suspicion(run.name, (), "running_start", sentence, severity)
    times = f"{lead.lead + 0.0:.2g} times what the yaw of {math.degrees(lead.yaw):.3g} deg gives"
    seen = f"{' and '.join(names)} differ by {times} in the end"
    if not LOW < abs(lead.lead) < HIGH:
        sentence = f"{seen}: the yaw or the readings are in another unit"
        return Suspicion(run.name, (), "unit_slip", sentence, severity)
    if lead.drift > 0.0:
        sentence = f"{seen}, though they move to its side: the two columns are exchanged"
        sentence += ", or the yaw was on before the record (run_in_m)" if run.travel[0] >= run.yaw_at else ""
        sentence += ", or the yaw has the wrong sign"
        return Suspicion(run.name, names, "swapped", sentence, severity)
    sentence = f"{seen}, and they move away from its side: the yaw or the readings have the wrong sign"
    return Suspicion(run.name, (), "wrong_sign", sentence, severity)


def _turned_column(leads: list[Lead], span: float) -> list[Suspicion]:
    """Return a column of the wrong sign: tail and head drift apart in the end in nearly all runs."""
    slopes = []  # late slopes over the yaw of tail and head, where records are long and slopes are clear
    for lead in leads:
        end = min(lead.tail.travel[-1], lead.head.travel[-1])
        s = np.linspace((1.0 - LATE) * end, end, _GRID)
        pair = [np.polyfit(s, np.interp(s, r.travel, r.readings), 1)[0] for r in (lead.tail, lead.head)]
        clear = CLEAR_SIGMAS * max(lead.tail.drift_error, lead.head.drift_error) / (LATE * end)
        if end >= SETTLED * span and min(map(abs, pair)) >= clear:
            slopes.append([float(slope) / lead.yaw for slope in pair])
    apart = [(tail, head) for tail, head in slopes if abs(tail + head) < 0.5 * abs(tail - head)]
    if len(slopes) < 3 or len(apart) < MOST * len(slopes):
        return []
    against = sum(tail < 0.0 for tail, _ in apart)
    if max(against, len(apart) - against) < MOST * len(apart):
        return []  # what does not follow the yaw is no sign of a column
    turned = leads[0].tail if against > len(apart) / 2 else leads[0].head
    sentence = "drifts away from the other points to the end, in nearly all runs: the sign of this column is turned"
    both = len({lead.yaw > 0.0 for lead in leads}) == 2
    severity: Severity = "stop" if both and len(apart) == len(leads) else "look"
    return [Suspicion(None, (turned.sheet.name,), "wrong_sign", sentence, severity)]


def check_wraps(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return exchanged points of one pulley: the run-off must repeat the run-up one wrapped arc later, not earlier."""
    machine, found = campaign.machine, []
    wraps = {("point_1", "point_2"): machine.tail_radius.value, ("point_3", "point_4"): machine.head_radius.value}
    for pair, arc in ((p, math.pi * radius) for places, radius in wraps.items() for p in pairs_at(records, *places)):
        misfits = []  # of the run-off as the second of the pair, and as the first
        for up, off in (pair, pair[::-1]):
            s = off.travel[(off.travel >= arc) & (off.travel <= up.travel[-1])]
            rest = np.interp(s, off.travel, off.readings) - np.interp(s - arc, up.travel, up.readings)
            noise = up.sheet.white**2 + off.sheet.white**2 + up.sheet.wander_sd**2 + off.sheet.wander_sd**2
            misfits.append(float(np.var(rest)) + 0.5 * noise if len(s) >= 3 else 0.0)
        way = int(pair[0].run.direction)
        (up, off), (stated, exchanged) = pair[::way], misfits[::way]
        if exchanged * WRAP_RATIO < stated:
            sentence = f"{off.sheet.name} moves before {up.sheet.name}, where the belt comes from: exchanged"
            sentence += ", or the direction of travel is the other one"
            names = tuple(sorted((up.sheet.name, off.sheet.name)))
            found.append(Suspicion(up.run.name, names, "swapped", sentence))
    return found


def check_places(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return signals stated at one place that differ, and signals stated at two places that agree."""
    of_pair: dict[tuple[str, str], list[tuple[Record, Record]]] = defaultdict(list)
    judged = [r for r in records if r.sheet.kind == "lateral" and len(r.travel) >= FEWEST_READINGS]
    for a, b in (pair for pair in combinations(judged, 2) if pair[0].run.name == pair[1].run.name):
        of_pair[a.sheet.name, b.sheet.name].append((a, b))
    span, found = float(rig_of(campaign).span_length), []
    for names, pairs in of_pair.items():
        (first, second), apart, alike = (r.sheet.at for r in pairs[0]), [], []
        for a, b in pairs:  # by the scatter of their difference, which ignores errors of zero
            s = a.travel[(a.travel >= b.travel[0]) & (a.travel <= b.travel[-1])]
            difference = float(np.std(np.interp(s, a.travel, a.readings) - np.interp(s, b.travel, b.readings)))
            errors = (x for r in (a, b) for x in (r.measured_noise, r.sheet.white, r.sheet.wander_sd))
            noise = math.hypot(*errors, *(r.sheet.gain * float(np.std(r.readings)) for r in (a, b)))
            apart.append(difference / noise)
            least = LEAST_LEAD * abs(a.run.yaw) * span / 2.0
            if min(a.travel[-1], b.travel[-1]) > 2.0 * span and least > OTHER_PLACE * noise and not a.run.runs_already:
                alike.append(difference < SAME_PLACE * noise)
        if first == second and (off := float(np.median(apart))) >= OTHER_PLACE:
            sentence = f"both are stated at {first}, but differ by {off:.0f} times their noise: one is elsewhere"
            found.append(Suspicion(None, names, "same_place", sentence))
        equal = (np.array_equal(a.readings, b.readings) for a, b in pairs)
        copied = all(equal) and all(len(np.unique(a.readings)) > FEWEST_READINGS for a, _ in pairs)
        one = {first, second} in [{*places} for places in TAIL_AND_HEAD] and len(alike) > 1 and all(alike)
        if first != second and (copied or one):
            sentence = f"read the same, though stated at {first} and {second}: both are at one place, or a column was"
            found.append(Suspicion(None, names, "same_place", f"{sentence} copied"))
    return found


def check_places_across(campaign: Campaign) -> list[Suspicion]:
    """Return a place y0 off the middle of the pulleys that no belt has that lies on them, the largest of all runs."""
    width = campaign.belt.width.value
    far = [(run.y0, run.name) for run in campaign.runs if run.y0 is not None and abs(run.y0) > 0.5 * width]
    if not far:
        return []
    y0, name = max(far, key=lambda place: abs(place[0]))
    sentence = f"the belt stands y0 = {y0 / MM:.4g} mm off the middle of the pulleys, which is {abs(y0) / width:.3g}"
    sentence += " times its width: y0_mm in runs.csv counts from there"
    sentence += f" (so in {len(far)} of {len(campaign.runs)} runs)" if len(far) > 1 else ""
    return [Suspicion(name, (), "shifted", sentence, "stop" if abs(y0) > width else "look")]


def check_signs(records: list[Record]) -> list[Suspicion]:
    """Return signals that run opposite to the same signal of other runs at the same tension, after division by yaw.

    It is certain where one of the opposed runs has a yaw of the same sign.
    """
    found = []
    judged = [r for r in records if abs(r.run.yaw) > 2.0 * abs(r.run.yaw_head) and not r.run.runs_already]
    judged = [r for r in judged if r.rms > CLEAR_SIGMAS * r.drift_error and len(r.travel) > 2]
    for name in dict.fromkeys(r.sheet.name for r in judged):
        own = [r for r in judged if r.sheet.name == name]
        if len(own) < 3:
            continue
        s = np.linspace(0.0, min(r.travel[-1] for r in own), _GRID)
        curves = np.array([np.interp(s, r.travel, r.readings) / r.run.yaw for r in own])
        size = np.maximum(np.linalg.norm(curves, axis=1), 1e-300)
        cosine = (curves / size[:, None]) @ (curves / size[:, None]).T
        tension, direction, side = np.array([(r.run.tension, r.run.direction, np.sign(r.run.yaw)) for r in own]).T
        group = (np.abs(tension[:, None] / tension - 1.0) < SAME_TENSION) & (direction[:, None] == direction)
        alike = group & ~np.eye(len(own), dtype=bool)
        opposing = alike & (cosine < OPPOSED) & (np.abs(np.log(size[:, None] / size)) < math.log(ALIKE_SIZE))
        turned = np.flatnonzero(alike.any(axis=1) & (2 * opposing.sum(axis=1) >= alike.sum(axis=1)))
        if len(np.unique(group[turned], axis=0)) != 1:
            continue  # none, or the same conflict at several tensions: an effect that does not follow the yaw
        k = turned[np.argmin(cosine[turned].sum(axis=1))]
        severity: Severity = "stop" if (opposing[k] & (side == side[k])).any() else "look"
        sentence = "runs opposite to the runs at the same tension, yaw for yaw: its sign is turned round"
        found.append(Suspicion(own[k].run.name, (name,), "wrong_sign", sentence, severity))
    return found


def check_copies(records: list[Record]) -> list[Suspicion]:
    """Return runs that hold the readings of another run."""
    found, seen = [], dict[tuple[str, bytes], str]()
    for record in records:
        if len(np.unique(record.readings)) < FEWEST_READINGS:
            continue
        first = seen.setdefault((record.sheet.name, record.readings.tobytes()), record.run.name)
        if first != record.run.name:
            sentence = f"has the very readings of run {first}: one of the two was copied; leave it out"
            found.append(Suspicion(record.run.name, (record.sheet.name,), "same_place", sentence))
    return found


#: Spans that a record must cover; the first and the last part of it that are compared.
GUIDED_SPANS, GUIDED_EARLY, GUIDED_LATE = 3.0, 0.5, 0.3
#: Share of the early peak below which late readings have returned, and above which late swings are an oscillation.
BACK, SWING = 0.25, 0.3
#: A signal is judged if it exceeds this many sigmas of zero, wander and white noise.
CLEAR_SWING = 8.0
#: Fewest runs, and the share of the judged runs that must agree.
FEWEST_RECORDS, GUIDED_MOST = 3, 0.8
TURNS = 4  # changes of direction that make an oscillation
HALTED = 0.03  # of yaw times travel: a free belt has drifted further
#: Harmonics of the belt's length, degree of the drift polynomial, and the fewest revolutions that separate the two.
WAVES, DEGREE, ROUNDS = 8, 3, 2.0


def check_guide(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return signals that return to zero or oscillate in nearly all runs with a yaw: a guide acts, in closed loop.

    A free belt follows its yaw: it drifts, or a crown stops it off the middle on the side of the yaw. Only a guide
    returns it to zero against the yaw, or lets it oscillate for ever. A curved belt edge also oscillates, but with the
    belt's revolution and alike in all runs; it is subtracted first.
    """
    span, found = float(rig_of(campaign).span_length), []
    for name in dict.fromkeys(r.sheet.name for r in records if r.sheet.kind == "lateral"):
        judged = []  # does a run return to zero after an early peak on the side of the yaw, and does it oscillate?
        for record in _subtract_edge(campaign, [r for r in records if r.sheet.name == name]):
            run, error, s = record.run, record.drift_error, record.travel
            if run.yaw == 0.0 or len(s) <= 24 or s[-1] <= GUIDED_SPANS * span or s[0] >= GUIDED_EARLY * s[-1]:
                continue
            width = max(1, len(record.readings) // 50)
            padded = np.pad(record.readings, (width // 2, width - 1 - width // 2), mode="edge")
            y = np.convolve(padded, np.full(width, 1.0 / width), mode="valid")
            if (largest := float(np.abs(y).max())) <= CLEAR_SWING * error:
                continue
            part = s / s[-1]
            early, later, late = y[part < GUIDED_EARLY], y[part > GUIDED_EARLY], y[part > 1.0 - GUIDED_LATE]
            peak = early[np.argmax(np.abs(early))]
            returns = peak * run.yaw > 0.0 and abs(peak) > CLEAR_SWING * error
            returns = returns and np.abs(late).max() < BACK * abs(peak) + error
            swing, turns, extreme, way = 0.5 * float(np.ptp(later)), 0, later[0], 0.0
            for value in later:  # each turn comes back by more than half the swing
                step = value - extreme
                if abs(step) > swing / 2.0 and step * way <= 0.0:
                    turns, extreme, way = turns + 1, value, np.sign(step)
                elif step * way > 0.0:
                    extreme = value
            stays = abs(float(np.mean(later))) <= HALTED * abs(run.yaw) * float(s[-1])
            swings = stays and swing >= max(CLEAR_SWING * error, SWING * largest) and turns >= TURNS
            judged.append((bool(returns), swings))
        returning, swinging = np.sum(judged, axis=0) >= GUIDED_MOST * len(judged) if judged else (False, False)
        if len(judged) >= FEWEST_RECORDS and (returning or swinging):
            sentence = "comes back to y = 0 against the yaw" if returning else "swings to and fro"
            sentence += " in nearly all runs: a guide seems to steer the belt; switch it off, or record"
            found.append(Suspicion(None, (name,), "guided", f"{sentence} what it does as yaw in runs.csv"))
    return found


def _subtract_edge(campaign: Campaign, records: list[Record]) -> list[Record]:
    """Subtract from the records of one signal the periodic edge profile that all runs share."""
    length = float(rig_of(campaign).belt_length)
    rest, left, waves = [], [], dict[int, np.ndarray]()
    for r in (r for r in records if r.travel[-1] > ROUNDS * length):
        place = r.run.direction * (r.travel + r.run.yaw_at)
        phases = 2.0 * np.pi / length * place[:, None] * np.arange(1, WAVES + 1)
        waves[id(r)] = wave = np.concatenate([np.cos(phases), np.sin(phases)], axis=1)
        drift = np.linalg.qr(np.vander(r.travel / r.travel[-1], DEGREE + 1))[0]
        rest.append(wave - drift @ (drift.T @ wave))
        left.append(r.readings - drift @ (drift.T @ r.readings))
    if not waves:
        return records
    edge = np.linalg.lstsq(np.concatenate(rest), np.concatenate(left), rcond=None)[0]
    return [replace(r, readings=r.readings - waves[id(r)] @ edge) if id(r) in waves else r for r in records]


def suspicions(campaign: Campaign) -> tuple[Suspicion, ...]:
    """Return everything that looks like a slip of the hand or a broken sensor, severity "stop" first.

    Spikes and short dropouts, and records that one check finds broken, are left out of the later checks.
    """

    def others(records: list[Record], suspected: list[Suspicion]) -> list[Record]:
        """The records that none of these suspicions concerns."""
        of = {(s.run, s.signals) for s in suspected}
        return [r for r in records if not of & {(run, s) for run in (None, r.run.name) for s in ((), (r.sheet.name,))}]

    gaps = check_gaps(campaign)
    campaign, left_out = leave_out_bad_readings(campaign)
    records = records_of(campaign)
    broken = [s for record in records for s in check_record(record)]
    found = [*left_out, *broken, *gaps, *check_copies(records), *check_travel(campaign)]
    sound = others(records, broken)
    found += check_noise(sound)
    sound = counted_from_yaw(others(sound, [s for s in found if s.kind == "unit_slip"]))
    shifts = check_starts(campaign, sound)
    sound = others(sound, shifts)
    found += [*shifts, *check_running_start(campaign, sound), *check_leads(campaign, sound)]
    known = [s for s in found if s.kind in ("swapped", "wrong_sign", "unit_slip")]
    for turned in check_signs(sound):  # unless a suspicion that is known explains it too
        if not any(k.run in (None, turned.run) and (not k.signals or {*turned.signals} <= {*k.signals}) for k in known):
            found.append(turned)
    found += [*check_wraps(campaign, sound), *check_places(campaign, sound), *check_places_across(campaign)]
    if not any(s.severity == "stop" for s in found):
        found += check_guide(campaign, sound)
    return tuple(sorted(found, key=lambda s: s.severity != "stop"))
