"""Runs that do not begin at y = 0.

y = 0 is where a point was when the yaw was applied, up to the stated error ``zero``. A straight line through the
first readings after the yaw is extended back to it; a belt that begins to run there has not moved yet. Where a record
begins before the yaw, readings are counted from the last rows before it, and any zero is allowed.
"""

from dataclasses import replace

import numpy as np

from belt_sim.campaign.quality.record import Record, Suspicion
from belt_sim.campaign.types import Campaign
from belt_sim.si import MM

#: Length of the line as a share of a span, and its fewest readings.
SHARE, FEWEST = 0.08, 6
#: Error of the line by the curvature of the path, as a share of yaw times its length.
CURVATURE_SHARE = 0.2
#: One run this many sigmas off is shifted. This rms over all runs means that ``zero`` is stated too small, or that it
#: was forgotten if none is stated.
SHIFTED, UNSTATED, FORGOTTEN = 12.0, 5.0, 1.8
FEWEST_RUNS = 4


def check_starts(
    campaign: Campaign, records: list[Record], *, curvature_share: float = CURVATURE_SHARE
) -> list[Suspicion]:
    """Return runs that are shifted, and signals whose runs begin further from zero than the sheet allows.

    curvature_share: 0 for residuals of a model, which have no path of their own.
    """
    found, reach = [], SHARE * campaign.machine.centre_distance.value
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
    before = np.flatnonzero((travel < 0.0) & np.isfinite(readings))[-FEWEST:]
    s, y = travel[before], readings[before]
    if len(before) == FEWEST:
        return float(np.polynomial.Polynomial.fit(s, y, 1)(0.0))
    return float(np.mean(y)) if len(before) else 0.0


def _start(record: Record, reach: float, curvature_share: float) -> tuple[float, float] | None:
    """Return the reading at the yaw and its sigma [m], from a line over ``reach`` [m]; None without data there."""
    after = record.travel >= 0.0
    s, y = record.travel[after], record.readings[after]
    if len(s) < 4 * FEWEST or s[0] > max(reach, s[1] - s[0]):
        return None
    count = max(FEWEST, int(np.searchsorted(s, reach)))
    line = np.polynomial.Polynomial.fit(s[:count], y[:count], 1)
    sheet, path = record.sheet, curvature_share * abs(record.run.yaw) * float(s[count - 1])
    white = max(sheet.white, record.measured_noise)
    return float(line(0.0)), float(np.sqrt(4.0 * white**2 / count + sheet.wander_sd**2 + sheet.zero**2)) + path
