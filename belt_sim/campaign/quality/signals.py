"""What a signal shows by itself: spikes, sensors that stuck or clipped, gaps, slipped units, and where it begins.

y = 0 is where a point was when the yaw was applied, up to the stated error ``zero``. A straight line through the
first readings after the yaw is extended back to it; a belt that begins to run there has not moved yet. Where a record
begins before the yaw, readings are counted from the last rows before it, and any zero is allowed.
"""

import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from belt_sim.campaign.problems import shortlist
from belt_sim.campaign.quality.record import (
    FEWEST,
    Record,
    Severity,
    Suspicion,
    SuspicionKind,
    records_of,
    resolution,
    scatter,
)
from belt_sim.campaign.types import Campaign, Run
from belt_sim.si import MM

#: Equal readings in a row that are never taken for chance, and the factor on the longest streak expected.
STREAK, STREAK_FACTOR = 8, 3.0
#: Readings at the extreme value against those at the three values next to it.
PILE, PILE_FACTOR = 6, 4.0
#: A spike stands this many sigmas of scatter out of its neighbours; heavy tails (Student's t with
#: 3 degrees of freedom) reach 200 once in a million readings.
SPIKE, LONE_SPIKE, SPIKES = 40.0, 200.0, 3
#: Scatter of a record that is taken at least, over the stated noise: readings that hardly differ have no spikes.
LEAST_SCATTER = 0.1
#: Rows that one spike lasts at most, and the shares of a record that may be spikes and stuck readings: what is more
#: makes a broken sensor.
LONGEST_SPIKE, MOST_SPIKES, MOST_STUCK = 4, 0.05, 0.1
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
#: Length of the line as a share of a span, and its fewest readings.
LINE_SHARE, FEWEST_ON_LINE = 0.08, 6
#: Error of the line by the curvature of the path, as a share of yaw times its length.
CURVATURE_SHARE = 0.2
#: One run this many sigmas off is shifted. This rms over all runs means that ``zero`` is stated too small, or that it
#: was forgotten if none is stated.
SHIFTED, UNSTATED, FORGOTTEN = 12.0, 5.0, 1.8
FEWEST_RUNS = 4


# ---- readings that are none


def leave_out_bad_readings(campaign: Campaign) -> tuple[Campaign, tuple[Suspicion, ...]]:
    """Return the campaign with spikes and short dropouts blanked, and what was left out where.

    A record of which too many readings are bad stays as it is: its sensor is broken (``check_record``).
    """
    signals, found = {run.name: dict(run.signals) for run in campaign.runs}, []
    for record in records_of(campaign):
        run, name = record.run, record.sheet.name
        for what, rows in _bad_readings(record):
            readings = signals[run.name][name].copy()
            readings[rows] = np.nan
            signals[run.name][name] = readings
            places = shortlist((f"{s:.6g}" for s in run.travel[rows]), LISTED)
            sentence = f"{len(rows)} readings {what}, left out (travel {places} m)"
            found.append(Suspicion(run.name, (name,), "dropout", sentence, "look"))
    if found:
        campaign = replace(campaign, runs=tuple(replace(run, signals=signals[run.name]) for run in campaign.runs))
    return campaign, tuple(found)


def _bad_readings(record: Record) -> Iterator[tuple[str, np.ndarray]]:
    """Yield what is wrong with readings of a record that is sound but for them, and in which rows of the run."""
    if len(record.readings) < FEWEST:
        return
    stuck = _stuck_stretch(record)
    if len(stuck) > MOST_STUCK * len(record.readings):
        return
    if len(stuck):
        yield "in a row are one and the same value", record.rows[stuck]
        rows, travel, readings = (np.delete(x, stuck) for x in (record.rows, record.travel, record.readings))
        record = replace(record, rows=rows, travel=travel, readings=readings)
    spikes = few_spikes(record.readings, LEAST_SCATTER * record.stated_noise)
    if len(spikes):
        yield "jump away from their neighbours and back", record.rows[spikes]


def check_record(record: Record) -> list[Suspicion]:
    """Return at most one suspicion: stuck at a value, clipped, or jumping away from its neighbours and back."""
    y, s = record.readings, record.travel + record.run.yaw_at
    if len(y) < FEWEST:
        return []
    stuck, clipped = _stuck_stretch(record), _clipped_values(y)
    spikes = spike_sizes(y, LEAST_SCATTER * record.stated_noise)
    kind: SuspicionKind = "dropout"
    if len(stuck):
        what = "exactly 0" if y[stuck[0]] == 0.0 else "one and the same value"
        sentence = f"{len(stuck)} readings in a row are {what}, from travel {s[stuck[0]]:.6g} to {s[stuck[-1]]:.6g} m"
        sentence += ": the sensor dropped out or stuck"
    elif clipped:
        kind, side = "clipped", "above" if clipped[0] == y.max() else "below"
        sentence = f"{np.sum(y == clipped[0])} readings are exactly the extreme value and none is {side} it: clipped"
    elif spikes.any():
        sentence = f"{np.count_nonzero(spikes)} readings jump by more than {SPIKE:g} times the scatter, the largest at"
        sentence += f" {s[int(np.argmax(spikes))]:.6g} m: the sensor drops out"
    else:
        return []
    return [Suspicion(record.run.name, (record.sheet.name,), kind, sentence)]


# ---- sensors that stick or clip


def _stuck_stretch(record: Record) -> np.ndarray:
    """Return the places (k,) of the longest streak of equal readings.

    There are none where no streak is too long for chance, and where it is at an extreme (that is clipping).
    """
    y = record.readings
    starts = np.concatenate([[0], np.flatnonzero(np.diff(y) != 0.0) + 1])
    lengths = np.diff(np.concatenate([starts, [len(y)]]))
    longest = int(np.argmax(lengths))
    streak = starts[longest] + np.arange(lengths[longest])
    first, last, value = streak[0], streak[-1], y[streak[0]]
    if len(streak) < _chance_streak(lengths) or (value == 0.0 and record.travel[last] <= 0.0):
        return streak[:0]
    jump = max(abs(value - y[max(first - 1, 0)]), abs(value - y[min(last + 1, len(y) - 1)]))
    is_clipped = value in _clipped_values(y) and jump < SPIKE * record.stated_noise
    return streak[:0] if is_clipped else streak


def _chance_streak(lengths: np.ndarray) -> float:
    """Return the length of a streak of equal readings that a sensor of this resolution does not reach by chance.

    lengths: of all streaks of the record, the longest of which says nothing about its resolution.
    """
    others = lengths[lengths < max(lengths.max(), 2)]
    equal = float((others - 1).sum()) / max(int(others.sum()), 1)
    expected = math.log(lengths.sum()) / -math.log(equal) if 0.0 < equal < 1.0 else 0.0
    return max(STREAK, STREAK_FACTOR * expected)


def _clipped_values(y: np.ndarray) -> list[float]:
    """Return the extremes at which readings pile up, more than at the three values next to it; the largest first."""
    levels, counts = np.unique(y, return_counts=True)
    if len(levels) < 2:
        return []
    ends = (levels[-1], counts[-1], counts[-4:-1].max()), (levels[0], counts[0], counts[1:4].max())
    return [
        float(value) for value, count, beside in ends if value != 0.0 and count >= PILE and count > PILE_FACTOR * beside
    ]


# ---- spikes


def jumps(y: np.ndarray, least: float) -> np.ndarray:
    """Return how far readings (n,) stand off the median of their neighbours, over their scatter (``least`` at least).

    Near the ends the neighbours are those of the nearest whole window, carried on along their median slope. 0 where
    nothing scatters.
    """
    from scipy.ndimage import median_filter  # a quarter of a second, which runs of a model need not wait for

    width, last = 2 * LONGEST_SPIKE + 1, len(y) - 1 - LONGEST_SPIKE
    local, place = median_filter(y, width), np.arange(len(y))
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
    spikes = np.flatnonzero(spike_sizes(y, least, lone)) if len(y) >= FEWEST else np.arange(0)
    return spikes if len(spikes) < MOST_SPIKES * len(y) else spikes[:0]


# ---- blanks


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


# ---- travel and scatter of another magnitude than stated, or than in other runs: a unit slipped


def check_travel(campaign: Campaign) -> list[Suspicion]:
    """Return runs whose travel has another magnitude than the other runs, or than speed times time."""
    recorded = [run for run in campaign.runs if len(run.travel) > 2]
    step_and_length = {run.name: (np.median(np.diff(run.travel)), np.ptp(run.travel)) for run in recorded}
    found = []
    for run in recorded:
        others = [sizes for name, sizes in step_and_length.items() if name != run.name]
        ratios = np.array(step_and_length[run.name]) / np.median(others, axis=0) if len(others) > 1 else np.ones(2)
        if ratios.min() > TRAVEL_FACTOR or ratios.max() < 1.0 / TRAVEL_FACTOR:
            sentence = f"its travel is {ratios[1]:.3g} times that of the other runs: its unit has slipped"
            found.append(Suspicion(run.name, (), "unit_slip", sentence))
        elif not 1.0 / TRAVEL_FACTOR < (pace := _pace(run)) < TRAVEL_FACTOR:
            sentence = f"travel is {pace:.3g} times speed times time: one of them is in another unit"
            found.append(Suspicion(run.name, (), "unit_slip", sentence))
    return found


def _pace(run: Run) -> float:
    """Return travel over speed times time; 1 without a record of time."""
    if run.time is None or np.isfinite(run.time).sum() < 3:
        return 1.0
    there = np.isfinite(run.time)
    return float(np.ptp(run.travel[there]) / (np.ptp(run.time[there]) * run.speed))


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
        r.rms / (abs(r.run.yaw) * float(r.travel[-1]))
        for r in records
        if r.sheet.name == signal and r.sheet.kind == "lateral" and r.run.yaw != 0.0 and r.travel[-1] > 0.0
    ]
    return bool(sizes) and not TINY < float(np.median(sizes)) < HUGE


# ---- where a run begins


def check_starts(
    campaign: Campaign, records: list[Record], *, curvature_share: float = CURVATURE_SHARE
) -> list[Suspicion]:
    """Return runs that are shifted, and signals whose runs begin further from zero than the sheet allows.

    curvature_share: 0 for residuals of a model, which have no path of their own.
    """
    found, reach = [], LINE_SHARE * campaign.machine.centre_distance.value
    for sheet in campaign.signals:
        own = [r for r in records if r.sheet.name == sheet.name and sheet.kind == "lateral"]
        starts = {r.run.name: start for r in own if (start := _start(r, reach, curvature_share)) is not None}
        if not starts:
            continue
        score = {run: abs(y) / sigma for run, (y, sigma) in starts.items()}
        shifted = [run for run in score if score[run] > SHIFTED * max(float(np.median([*score.values()])), 1.0)]
        for run in shifted:
            sentence = f"begins at {starts[run][0] / MM:.3g} mm, where y = 0 should be: this run is shifted"
            sentence += "; take its readings from where the point was when the yaw was applied"
            found.append(Suspicion(run, (sheet.name,), "shifted", sentence))
        rest = [run for run in score if run not in shifted]
        limit = FORGOTTEN if curvature_share == 0.0 and sheet.zero == 0.0 else UNSTATED
        if len(rest) >= FEWEST_RUNS and _rms([min(score[run], 20.0) for run in rest]) > limit:
            size = _rms([starts[run][0] for run in rest])
            stated = f"states zero: {sheet.zero / MM:g} mm" if sheet.zero > 0.0 else "states no zero"
            sentence = f"its runs begin {size / MM:.2g} mm (rms) off y = 0, while the sheet {stated}: "
            sentence += "the zero of every run is what is left when belt and effects are fitted"
            found.append(Suspicion(None, (sheet.name,), "zero", sentence, "look"))
    return found


def _rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def counted_from_yaw(records: list[Record]) -> list[Record]:
    """Return records with their readings counted from the last rows before the yaw, where there are such rows.

    What a machine does before the yaw is no error of zero, wherever its sensors were set to zero.
    """
    return [
        replace(r, readings=r.readings - reading_at_yaw(r.travel, r.readings)) if r.sheet.kind == "lateral" else r
        for r in records
    ]


def reading_at_yaw(travel: np.ndarray, readings: np.ndarray) -> float:
    """The reading at the yaw, by a line through the last of the rows before it; travel (n,): from the yaw [m].

    The mean of these rows where they are too few for a line; 0 where there are none.
    """
    before = np.flatnonzero((travel < 0.0) & np.isfinite(readings))[-FEWEST_ON_LINE:]
    s, y = travel[before], readings[before]
    if len(before) == FEWEST_ON_LINE:
        return float(np.polynomial.Polynomial.fit(s, y, 1)(0.0))
    return float(np.mean(y)) if len(before) else 0.0


def _start(record: Record, reach: float, curvature_share: float) -> tuple[float, float] | None:
    """Return the reading at the yaw and its sigma [m], from a line over ``reach`` [m]; None without data there."""
    after = record.travel >= 0.0
    s, y = record.travel[after], record.readings[after]
    if len(s) < 4 * FEWEST_ON_LINE or s[0] > max(reach, s[1] - s[0]):
        return None
    count = max(FEWEST_ON_LINE, int(np.searchsorted(s, reach)))
    line = np.polynomial.Polynomial.fit(s[:count], y[:count], 1)
    sheet, path = record.sheet, curvature_share * abs(record.run.yaw) * float(s[count - 1])
    white = max(sheet.white, record.measured_noise)
    return float(line(0.0)), float(np.sqrt(4.0 * white**2 / count + sheet.wander_sd**2 + sheet.zero**2)) + path
