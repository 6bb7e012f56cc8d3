"""A steering guide in closed loop, whose action would hide the belt's own behaviour.

A free belt follows its yaw: it drifts, or a crown stops it off the middle on the side of the yaw. Only a guide
returns it to zero against the yaw, or lets it oscillate for ever. A curved belt edge also oscillates, but with the
belt's revolution and alike in all runs; it is subtracted first.
"""

from dataclasses import replace

import numpy as np

from belt_sim.campaign.quality.record import Record, Suspicion
from belt_sim.campaign.types import Campaign, rig_of

#: Spans that a record must cover; the first and the last part of it that are compared.
SPANS, EARLY, LATE = 3.0, 0.5, 0.3
#: Share of the early peak below which late readings have returned, and above which late swings are an oscillation.
BACK, SWING = 0.25, 0.3
#: A signal is judged if it exceeds this many sigmas of zero, wander and white noise.
CLEAR_SWING = 8.0
#: Fewest runs, and the share of the judged runs that must agree.
FEWEST_RECORDS, MOST = 3, 0.8
TURNS = 4  # changes of direction that make an oscillation
HALTED = 0.03  # of yaw times travel: a free belt has drifted further
#: Harmonics of the belt's length, degree of the drift polynomial, and the fewest revolutions that separate the two.
WAVES, DEGREE, ROUNDS = 8, 3, 2.0


def check_guide(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return signals that return to zero or oscillate in nearly all runs with a yaw."""
    span, found = float(rig_of(campaign).span_length), []
    for name in dict.fromkeys(r.sheet.name for r in records if r.sheet.kind == "lateral"):
        signal = _subtract_edge(campaign, [r for r in records if r.sheet.name == name])
        judged = [signs for r in signal if (signs := _guide_signs(r, span)) is not None]
        if len(judged) < FEWEST_RECORDS:
            continue
        returning, swinging = np.sum(judged, axis=0) >= MOST * len(judged)
        if returning or swinging:
            sentence = "comes back to y = 0 against the yaw" if returning else "swings to and fro"
            sentence += " in nearly all runs: a guide seems to steer the belt; switch it off, or record"
            sentence += " what it does as yaw in runs.csv"
            found.append(Suspicion(None, (name,), "guided", sentence))
    return found


def _subtract_edge(campaign: Campaign, records: list[Record]) -> list[Record]:
    """Subtract from the records of one signal the periodic edge profile that all runs share."""
    length = float(rig_of(campaign).belt_length)
    long = [r for r in records if r.travel[-1] > ROUNDS * length]
    if not long:
        return records
    waves, readings = [_waves(r, length) for r in long], [r.readings for r in long]
    drifts = [np.vander(r.travel / r.travel[-1], DEGREE + 1) for r in long]
    bases = [np.linalg.qr(drift)[0] for drift in drifts]
    rest = [w - q @ (q.T @ w) for q, w in zip(bases, waves, strict=True)]
    left = [y - q @ (q.T @ y) for q, y in zip(bases, readings, strict=True)]
    edge = np.linalg.lstsq(np.concatenate(rest), np.concatenate(left), rcond=None)[0]
    found = {id(r): replace(r, readings=r.readings - w @ edge) for r, w in zip(long, waves, strict=True)}
    return [found.get(id(r), r) for r in records]


def _waves(record: Record, length: float) -> np.ndarray:
    """Return cosines and sines (n, 2 WAVES) that repeat with the belt's length."""
    place = record.run.direction * (record.travel + record.run.yaw_at)
    phase = 2.0 * np.pi / length * place[:, None] * np.arange(1, WAVES + 1)
    return np.concatenate([np.cos(phase), np.sin(phase)], axis=1)


def _guide_signs(record: Record, span: float) -> tuple[bool, bool] | None:
    """Return whether a record returns to zero after an early peak on the side of the yaw, and whether it oscillates.

    None for one that is short or does not move clearly beyond its errors. It is averaged over a fiftieth of its length.
    """
    run, error, s = record.run, record.drift_error, record.travel
    if run.yaw == 0.0 or len(s) <= 24 or s[-1] <= SPANS * span or s[0] >= EARLY * s[-1]:
        return None
    from scipy.ndimage import uniform_filter1d  # a quarter of a second, which runs of a model need not wait for

    y = uniform_filter1d(record.readings, max(1, len(record.readings) // 50), mode="nearest")
    if np.abs(y).max() <= CLEAR_SWING * error:
        return None
    part = s / s[-1]
    early, late = y[part < EARLY], y[part > 1.0 - LATE]
    peak = early[np.argmax(np.abs(early))]
    returns = peak * run.yaw > 0.0 and abs(peak) > CLEAR_SWING * error
    returns = returns and np.abs(late).max() < BACK * abs(peak) + error
    later = y[part > EARLY]
    swing = 0.5 * float(np.ptp(later))
    drifted = abs(float(np.mean(later))) > HALTED * abs(run.yaw) * float(s[-1])
    swings = not drifted and swing >= max(CLEAR_SWING * error, SWING * float(np.abs(y).max()))
    return bool(returns), swings and _turns(later, swing / 2.0) >= TURNS


def _turns(y: np.ndarray, least: float) -> int:
    """Return how often readings change their direction; each time they come back by more than ``least``."""
    turns, extreme, direction = 0, y[0], 0.0
    for value in y:
        step = value - extreme
        if abs(step) > least and step * direction <= 0.0:
            turns, extreme, direction = turns + 1, value, np.sign(step)
        elif step * direction > 0.0:
            extreme = value
    return turns
