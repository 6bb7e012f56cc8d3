"""The records of a campaign without any belt model: their scatter, spikes and readings at the yaw; suspicions."""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from belt_sim.campaign.types import Campaign, Run, SignalSheet

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
