"""Slipped units: scatter and travel of another magnitude than stated, or than in other runs."""

from collections import defaultdict

import numpy as np

from belt_sim.campaign.quality.record import FEWEST, Record, Severity, Suspicion, resolution
from belt_sim.campaign.types import Campaign, Run

#: Scatter over its stated size beyond which it is a slip (inch: 25; milli: 1000); stated noise errs by 40 %.
NOISE_FACTOR = 6.0
#: Root mean square of lateral readings over |yaw| times travel: linear belts give 0.05 to 0.4.
TINY, HUGE = 0.01, 3.0
#: Factor on step and length of the travel, against other runs, or on travel/(speed time), that is a slip.
TRAVEL_FACTOR = 20.0


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
