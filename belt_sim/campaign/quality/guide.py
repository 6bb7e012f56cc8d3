"""Check for a steering guide in closed loop, whose action would hide the belt's own behaviour.

A free belt follows its yaw: it drifts, or a crown stops it off the middle on the side of the yaw. Only a guide returns
it to zero against the yaw, or lets it oscillate for ever. A curved belt edge also oscillates, but with the belt's
revolution and alike in all runs; it is subtracted first.
"""

from dataclasses import replace

import numpy as np

from belt_sim.campaign.quality.kinematics import span_of
from belt_sim.campaign.quality.record import Record, Suspicion
from belt_sim.campaign.types import Campaign, case_of

#: Spans that a record must cover; the first and the last part of it that are compared.
SPANS, EARLY, LATE = 3.0, 0.5, 0.3
#: Share of the early peak below which late readings have returned, and above which late swings are an oscillation.
BACK, SWING = 0.25, 0.3
#: A signal is judged if it exceeds this many sigmas of zero, wander and white noise.
CLEAR = 8.0
#: Fewest runs, and the share of the judged runs that must agree.
FEWEST, MOST = 3, 0.8
TURNS = 4  # changes of direction that make an oscillation
HALTED = 0.03  # of yaw times travel: a free belt has drifted further
#: Harmonics of the belt's length, degree of the drift polynomial, and the fewest revolutions that separate the two.
WAVES, DEGREE, ROUNDS = 8, 3, 2.0


def check_guide(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return signals that return to zero or oscillate in nearly all runs with a yaw."""
    span, found = span_of(campaign), []
    for name in dict.fromkeys(r.sheet.name for r in records if r.sheet.kind == "lateral"):
        signal = [r for r in records if r.sheet.name == name]
        own = [r for r in _subtract_edge(campaign, signal) if _is_judged(r, span)]
        if len(own) < FEWEST:
            continue
        for shows, words in ((_returns, "comes back to y = 0 against the yaw"), (_oscillates, "swings to and fro")):
            if sum(shows(r) for r in own) >= MOST * len(own):
                sentence = f"{words} in nearly all runs: a guide seems to steer the belt; switch it off, or record"
                sentence += " what it does as yaw in runs.csv"
                found.append(Suspicion(run=None, signals=(name,), kind="guided", sentence=sentence))
                break
    return found


def _subtract_edge(campaign: Campaign, records: list[Record]) -> list[Record]:
    """Subtract from the records of one signal the periodic edge profile that all runs share."""
    length = float(case_of(campaign, campaign.runs[0]).rig.belt_length)
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


def _is_judged(record: Record, span: float) -> bool:
    """Return whether a record is long enough and moves clearly beyond its errors."""
    return (
        record.run.yaw != 0.0
        and len(record.travel) > 24
        and record.travel[-1] > SPANS * span
        and float(np.abs(_smooth(record)).max()) > CLEAR * record.drift_error
    )


def _returns(record: Record) -> bool:
    """Return whether the signal has an early peak on the side of the yaw and then returns to zero."""
    y, part = _smooth(record), record.travel / record.travel[-1]
    peak = float(np.abs(y[part < EARLY]).max(initial=0.0))
    late = y[part > 1.0 - LATE]
    on_its_side = y[part < EARLY][np.argmax(np.abs(y[part < EARLY]))] * record.run.yaw > 0.0
    return bool(
        on_its_side and peak > CLEAR * record.drift_error and np.abs(late).max() < BACK * peak + record.drift_error
    )


def _oscillates(record: Record) -> bool:
    """Return whether the smoothed late record turns back often, by much of what the belt has moved in all."""
    y, part = _smooth(record), record.travel / record.travel[-1]
    late = y[part > EARLY]
    swing = 0.5 * float(np.ptp(late))
    drifted = abs(float(np.mean(late))) > HALTED * abs(record.run.yaw) * float(record.travel[-1])
    if drifted or swing < CLEAR * record.drift_error or swing < SWING * float(np.abs(y).max()):
        return False
    level, turns, up = late[0], 0, None
    for value in late:  # a turn counts once the belt has come back by half a swing
        if up is not True and value > level + swing / 2.0:
            turns, up, level = turns + 1, True, value
        elif up is not False and value < level - swing / 2.0:
            turns, up, level = turns + 1, False, value
        level = max(level, value) if up is True else min(level, value) if up is False else level
    return turns >= TURNS


def _smooth(record: Record) -> np.ndarray:
    """Return the readings averaged over a fiftieth of the record."""
    width = max(1, len(record.readings) // 50)
    padded = np.pad(record.readings, width // 2, mode="edge")
    return np.convolve(padded, np.ones(width) / width, mode="same")[width // 2 :][: len(record.readings)]
