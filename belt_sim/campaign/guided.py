"""A guide in closed loop: something steers the belt back, so that the readings show the guide and not the belt.

A belt that is left alone follows its yaw: it drifts on, or stops where a crown holds it, off the middle by as much as
the yaw asks. Only a guide brings it back to zero against the yaw, or has it swing about a place for ever. An edge that
is not straight swings for ever as well, but once a turn of the belt and alike in all runs: that is taken off first.
"""

from dataclasses import replace

import numpy as np

from belt_sim.campaign.lead import span_of
from belt_sim.campaign.nouns import Campaign, case_of
from belt_sim.campaign.record import Record
from belt_sim.campaign.suspect import Suspicion

#: Spans that a record must cover; the first and the last part of it that are compared.
SPANS, EARLY, LATE = 3.0, 0.5, 0.3
#: Late readings below this share of the early peak have come back; late swings this large against it go on.
BACK, SWING = 0.25, 0.3
#: What is judged stands this many sigmas out of zero, wander and white noise.
CLEAR = 8.0
#: Runs that must show it, and their share of those that could.
FEWEST, MOST = 3, 0.8
TURNS = 4  # changes of direction, each clear of noise, that make a swing
HALTED = 0.03  # of yaw times travel: a belt that is left alone has drifted further, however it swings
#: What the belt carries: waves of its length, told from the drift of a run in records of so many turns and more.
WAVES, BEND, ROUNDS = 8, 3, 2.0


def closed_loop(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Signals that are pulled back to zero, or that swing, in nearly all runs with a yaw."""
    span, found = span_of(campaign), []
    for name in dict.fromkeys(r.sheet.name for r in records if r.sheet.kind == "lateral"):
        signal = [r for r in records if r.sheet.name == name]
        own = [r for r in _without_the_edge(campaign, signal) if _can_tell(r, span)]
        if len(own) < FEWEST:
            continue
        for seen, words in ((_comes_back, "comes back to y = 0 against the yaw"), (_swings, "swings to and fro")):
            if sum(seen(r) for r in own) >= MOST * len(own):
                sentence = f"{words} in nearly all runs: a guide seems to steer the belt; switch it off, or record"
                sentence += " what it does as yaw in runs.csv"
                found.append(Suspicion(run=None, signal=name, kind="guided", sentence=sentence))
                break
    return found


def _without_the_edge(campaign: Campaign, records: list[Record]) -> list[Record]:
    """Records of one signal without what all runs show alike at the same place of the belt, turn after turn."""
    length = float(case_of(campaign, campaign.runs[0]).rig.belt_length)
    long = [r for r in records if r.travel[-1] > ROUNDS * length]
    if not long:
        return records
    waves, readings = [_waves(r, length) for r in long], [r.readings for r in long]
    apart = [np.vander(r.travel / r.travel[-1], BEND + 1) for r in long]  # of its drift, each run has its own course
    bases = [np.linalg.qr(own)[0] for own in apart]
    rest = [w - q @ (q.T @ w) for q, w in zip(bases, waves, strict=True)]
    left = [y - q @ (q.T @ y) for q, y in zip(bases, readings, strict=True)]
    edge = np.linalg.lstsq(np.concatenate(rest), np.concatenate(left), rcond=None)[0]
    found = {id(r): replace(r, readings=r.readings - w @ edge) for r, w in zip(long, waves, strict=True)}
    return [found.get(id(r), r) for r in records]


def _waves(record: Record, length: float) -> np.ndarray:
    """Waves (n, 2 WAVES) that repeat with the belt's length."""
    place = record.run.direction * (record.travel + record.run.yaw_at)
    phase = 2.0 * np.pi / length * place[:, None] * np.arange(1, WAVES + 1)
    return np.concatenate([np.cos(phase), np.sin(phase)], axis=1)


def _can_tell(record: Record, span: float) -> bool:
    return (
        record.run.yaw != 0.0
        and len(record.travel) > 24
        and record.travel[-1] > SPANS * span
        and float(np.abs(_smooth(record)).max()) > CLEAR * record.drift_error
    )


def _comes_back(record: Record) -> bool:
    y, part = _smooth(record), record.travel / record.travel[-1]
    peak = float(np.abs(y[part < EARLY]).max(initial=0.0))
    late = y[part > 1.0 - LATE]
    on_its_side = y[part < EARLY][np.argmax(np.abs(y[part < EARLY]))] * record.run.yaw > 0.0
    return bool(
        on_its_side and peak > CLEAR * record.drift_error and np.abs(late).max() < BACK * peak + record.drift_error
    )


def _swings(record: Record) -> bool:
    """Turns of a smoothed late record whose swings are large against all that the belt has moved."""
    y, part = _smooth(record), record.travel / record.travel[-1]
    late = y[part > EARLY]
    swing = 0.5 * float(np.ptp(late))
    drifted = abs(float(np.mean(late))) > HALTED * abs(record.run.yaw) * float(record.travel[-1])
    if drifted or swing < CLEAR * record.drift_error or swing < SWING * float(np.abs(y).max()):
        return False
    level, turns, up = late[0], 0, None
    for value in late:  # a turn counts when the belt has come back by half a swing
        if up is not True and value > level + swing / 2.0:
            turns, up, level = turns + 1, True, value
        elif up is not False and value < level - swing / 2.0:
            turns, up, level = turns + 1, False, value
        level = max(level, value) if up is True else min(level, value) if up is False else level
    return turns >= TURNS


def _smooth(record: Record) -> np.ndarray:
    """Readings averaged over a fiftieth of the record."""
    width = max(1, len(record.readings) // 50)
    padded = np.pad(record.readings, width // 2, mode="edge")
    return np.convolve(padded, np.ones(width) / width, mode="same")[width // 2 :][: len(record.readings)]
