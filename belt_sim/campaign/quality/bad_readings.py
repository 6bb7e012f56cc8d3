"""Readings that are none: spikes, stretches where a sensor stuck, clipping, and gaps."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter

from belt_sim.campaign.problems import shortlist
from belt_sim.campaign.quality.record import FEWEST, Record, Suspicion, SuspicionKind, records_of, scatter
from belt_sim.campaign.types import Campaign

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


# Sensors that stick or clip.


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


# Spikes.


def jumps(y: np.ndarray, least: float) -> np.ndarray:
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


def spike_sizes(y: np.ndarray, least: float, lone: float = LONE_SPIKE) -> np.ndarray:
    """Return the ``jumps`` of readings (n,) that are spikes, several by SPIKE or one by ``lone``; 0 of all others."""
    out = jumps(y, least)
    spikes = np.where(out > SPIKE, out, 0.0)
    return spikes if np.count_nonzero(spikes) >= SPIKES or spikes.max() > lone else np.zeros(len(y))


def few_spikes(y: np.ndarray, least: float, lone: float = LONE_SPIKE) -> np.ndarray:
    """Return the places (k,) of the spikes in readings (n,); none where so many jump that the sensor is broken."""
    spikes = np.flatnonzero(spike_sizes(y, least, lone)) if len(y) >= FEWEST else np.arange(0)
    return spikes if len(spikes) < MOST_SPIKES * len(y) else spikes[:0]


# Blanks.


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
