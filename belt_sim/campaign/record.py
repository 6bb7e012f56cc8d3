"""One signal of one run as it was recorded, and the noise that it should and does show."""

import math
from dataclasses import dataclass

import numpy as np

from belt_sim.campaign.nouns import Campaign, Run, SignalSheet

#: Median absolute deviation -> standard deviation of a normal distribution.
MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True, kw_only=True)
class Record:
    """travel since the yaw was applied [m] and readings [m or rad], shape (n,), blanks left out."""

    run: Run
    sheet: SignalSheet
    travel: np.ndarray
    readings: np.ndarray

    @property
    def stated_noise(self) -> float:
        """Standard deviation that the sheet lets one expect of ``measured_noise``.

        From the second differences of white noise (6 w^2) and of a wander with correlation exp(-d/length).
        """
        step = float(np.median(np.diff(self.travel))) if len(self.travel) > 1 else 0.0
        near = math.exp(-step / self.sheet.wander_length)
        wander = self.sheet.wander_sd**2 * (6.0 - 8.0 * near + 2.0 * near**2)
        return math.sqrt(self.sheet.white**2 + wander / 6.0)

    @property
    def measured_noise(self) -> float:
        """Standard deviation of the scatter from sample to sample, from the median second difference."""
        bend = np.abs(np.diff(self.readings, 2))
        return MAD_TO_SIGMA * float(np.median(bend)) / math.sqrt(6.0) if bend.size else 0.0

    @property
    def digit(self) -> float:
        """The smallest step between readings: scatter that is not seen is below it; 0 where all are alike."""
        steps = np.diff(np.unique(self.readings))
        return float(steps.min()) if steps.size else 0.0

    @property
    def drift_error(self) -> float:
        """One sigma of the slow errors of a mean over the record: zero and wander."""
        return math.hypot(self.sheet.zero, self.sheet.wander_sd, self.sheet.white)


def records(campaign: Campaign) -> list[Record]:
    """All signals of all runs that have at least one reading."""
    sheets = {sheet.name: sheet for sheet in campaign.signals}
    found = []
    for run in campaign.runs:
        for name, readings in run.signals.items():
            there = np.isfinite(readings)
            travel = run.travel[there] - run.yaw_at
            found.append(Record(run=run, sheet=sheets[name], travel=travel, readings=readings[there]))
    return found
