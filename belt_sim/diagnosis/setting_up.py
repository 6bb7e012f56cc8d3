"""What looks wrong in a campaign once the model's own path is taken off its readings."""

from dataclasses import replace

import numpy as np

from belt_sim.campaign import Suspicion
from belt_sim.campaign.offsets import shifted_runs
from belt_sim.campaign.record import records
from belt_sim.diagnosis.workbench import Workbench


def offsets(bench: Workbench, values: np.ndarray) -> tuple[Suspicion, ...]:
    """Runs that do not begin where ``values`` (R, S, n) do, by more than the sheet's errors allow."""
    samples = bench.samples
    rest = samples.y - values
    runs = []
    for r, run in enumerate(samples.runs):
        own = np.concatenate([[True], np.diff(samples.travel[r]) > 0])  # shorter records are padded
        signals = {s.name: rest[r, k, own] for k, s in enumerate(samples.signals) if s.name in run.signals}
        runs.append(replace(run, travel=samples.travel[r, own], time=None, signals=signals))
    left = replace(bench.campaign, runs=tuple(runs))
    return tuple(shifted_runs(left, records(left), bent=0.0))
