"""Records of single signals with their noise, and what a check says of them."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from belt_sim.campaign.types import Campaign, Run, SignalSheet

SuspicionKind = Literal[
    "unit_slip",
    "clipped",
    "swapped",
    "wrong_sign",
    "dropout",
    "shifted",
    "zero",
    "same_place",
    "guided",
    "sheet",
    "repeats",
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
#: Readings below which a record says nothing about its noise or its repetitions.
FEWEST = 12


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
        """Standard deviation of the scatter from sample to sample, from the median second difference."""
        return scatter(self.readings)

    @property
    def rms(self) -> float:
        """Root mean square of the readings."""
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
    """Return the smallest step between distinct readings (n,); 0 if all are equal."""
    steps = np.diff(np.unique(y))
    return float(steps.min()) if steps.size else 0.0


def records_of(campaign: Campaign) -> list[Record]:
    """Return the records of all signals of all runs that have a reading."""
    sheets = {sheet.name: sheet for sheet in campaign.signals}
    found = []
    for run in campaign.runs:
        for name, readings in run.signals.items():
            rows = np.flatnonzero(np.isfinite(readings))
            travel = run.travel[rows] - run.yaw_at
            found.append(Record(run=run, sheet=sheets[name], rows=rows, travel=travel, readings=readings[rows]))
    return found


def pairs_at(records: list[Record], one: str, other: str) -> list[tuple[Record, Record]]:
    """Return the records of two places in every run that has both; of two sensors at a place, the first."""
    at, also = ({r.run.name: r for r in reversed(records) if r.sheet.at == place} for place in (one, other))
    runs = dict.fromkeys(r.run.name for r in records)
    return [(at[run], also[run]) for run in runs if run in at and run in also]
