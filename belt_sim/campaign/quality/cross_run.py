"""Checks across runs: signs that are turned round, slipped units of the travel, and runs that do not begin at y = 0.

y = 0 is where a point was when the yaw was applied, up to the stated error ``zero``. A straight line through the
first readings after the yaw is extended back to it; a belt that begins to run there has not moved yet. Where a record
begins before the yaw, readings are counted from the last rows before it, and any zero is allowed.
"""

import math
from collections import defaultdict
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from belt_sim.campaign.quality.kinematics import span_of
from belt_sim.campaign.quality.record import Record, Severity, Suspicion
from belt_sim.campaign.types import Campaign, case_of
from belt_sim.si import MM

#: Readings that are judged must stand this many sigmas out of zero, wander and white noise.
CLEAR = 6.0
#: Runs are compared if their tensions differ by less than this share.
SAME_TENSION = 0.2
#: Cosine between two curves (over yaw) below which one of them is turned round ...
OPPOSED = -0.8
#: ... and the ratio of their sizes is below this: turning a sign leaves the size as it is.
ALIKE_SIZE = 1.5
#: Factor on step and length of the travel, against other runs, or on travel/(speed time), that is a slip.
TRAVEL_FACTOR = 20.0
#: Length of the line as a share of a span, and its fewest readings.
SHARE, FEWEST = 0.08, 6
#: Error of the line by the curvature of the path, as a share of yaw times its length.
CURVATURE_SHARE = 0.2
#: One run this many sigmas off is shifted. This rms over all runs means that ``zero`` is stated too small, or that it
#: was forgotten if none is stated.
SHIFTED, UNSTATED, FORGOTTEN = 12.0, 5.0, 1.8
FEWEST_RUNS = 4
_GRID = 100


def check_signs(records: list[Record]) -> list[Suspicion]:
    """Return signals that run opposite to the same signal of other runs at the same tension, after division by yaw."""
    found = []
    for name in dict.fromkeys(record.sheet.name for record in records):
        own = [r for r in records if r.sheet.name == name and abs(r.run.yaw) > 2.0 * abs(r.run.yaw_head)]
        own = [r for r in own if np.sqrt(np.mean(r.readings**2)) > CLEAR * r.drift_error and len(r.travel) > 2]
        if len(own) > 2 and (turned := _turned_round(own)) is not None:
            record, certain = turned
            sentence = "runs opposite to the runs at the same tension, yaw for yaw: its sign is turned round"
            severity: Severity = "stop" if certain else "look"
            found.append(Suspicion(record.run.name, (name,), "wrong_sign", sentence, severity))
    return found


def _turned_round(own: list[Record]) -> tuple[Record, bool] | None:
    """Return the record that opposes comparable runs, and whether it is certain (one of them has a yaw of its sign)."""
    cosine, size = _cosines(own)
    tension = np.array([r.run.tension for r in own])
    direction = np.array([r.run.direction for r in own])
    side = np.sign([r.run.yaw for r in own])
    alike = np.abs(tension[:, None] / tension - 1.0) < SAME_TENSION
    alike &= (direction[:, None] == direction) & ~np.eye(len(own), dtype=bool)
    opposed = (cosine < OPPOSED) & (np.abs(np.log(size[:, None] / size)) < math.log(ALIKE_SIZE))
    turned = [k for k in range(len(own)) if alike[k].any() and 2 * (alike[k] & opposed[k]).sum() >= alike[k].sum()]
    groups = {tuple(np.flatnonzero(alike[k] | (np.arange(len(own)) == k))) for k in turned}
    if len(groups) != 1:
        return None  # none, or the same conflict at several tensions: an effect that does not follow the yaw
    trust = [float(np.mean(np.delete(cosine[k], k))) for k in turned]
    k = turned[int(np.argmin(trust))]
    same_side = (alike[k] & opposed[k] & (side == side[k])).any()
    return own[k], bool(same_side)


def _cosines(records: list[Record]) -> tuple[np.ndarray, np.ndarray]:
    """Return cosines (n, n) between records over their yaw on their common travel, and their norms (n,)."""
    s = np.linspace(0.0, min(r.travel[-1] for r in records), _GRID)
    curves = np.array([np.interp(s, r.travel, r.readings) / r.run.yaw for r in records])
    size = np.maximum(np.linalg.norm(curves, axis=1), 1e-300)
    unit = curves / size[:, None]
    return unit @ unit.T, size


def check_copies(records: list[Record]) -> list[Suspicion]:
    """Return runs that hold the readings of another run: no two runs of a machine scatter alike."""
    found, seen = [], dict[tuple[str, bytes], str]()
    for record in records:
        if len(np.unique(record.readings)) < 2 * FEWEST:
            continue
        first = seen.setdefault((record.sheet.name, record.readings.tobytes()), record.run.name)
        if first != record.run.name:
            sentence = f"has the very readings of run {first}: one of the two was copied; leave it out"
            found.append(Suspicion(record.run.name, (record.sheet.name,), "same_place", sentence))
    return found


def check_travel(campaign: Campaign) -> list[Suspicion]:
    """Return runs whose travel has another magnitude than the other runs, or than speed times time."""
    recorded = [run for run in campaign.runs if len(run.travel) > 2]
    steps = {run.name: float(np.median(np.diff(run.travel))) for run in recorded}
    lengths = {run.name: float(run.travel[-1] - run.travel[0]) for run in recorded}
    found = []
    for run in recorded:
        ratios = [
            of_run[run.name] / float(np.median([v for name, v in of_run.items() if name != run.name]))
            for of_run in (steps, lengths)
            if len(of_run) > 2
        ]
        if ratios and (min(ratios) > TRAVEL_FACTOR or max(ratios) < 1.0 / TRAVEL_FACTOR):
            sentence = f"its travel is {ratios[1]:.3g} times that of the other runs: its unit has slipped"
            found.append(Suspicion(run.name, (), "unit_slip", sentence))
        elif run.time is not None and np.isfinite(run.time).sum() > 2:
            there = np.isfinite(run.time)
            seconds = run.time[there][-1] - run.time[there][0]
            pace = (run.travel[there][-1] - run.travel[there][0]) / (seconds * run.speed)
            if not 1.0 / TRAVEL_FACTOR < pace < TRAVEL_FACTOR:
                sentence = f"travel is {pace:.3g} times speed times time: one of them is in another unit"
                found.append(Suspicion(run.name, (), "unit_slip", sentence))
    return found


def check_starts(
    campaign: Campaign, records: list[Record], *, curvature_share: float = CURVATURE_SHARE
) -> list[Suspicion]:
    """Return runs that are shifted, and signals whose runs begin further from zero than the sheet allows.

    curvature_share: 0 for residuals of a model, which have no path of their own.
    """
    of_signal: dict[str, dict[str, tuple[float, float]]] = defaultdict(dict)
    for record in records:
        reach = SHARE * campaign.machine.centre_distance.value
        start = _start(record, reach, curvature_share) if record.sheet.kind == "lateral" else None
        if start is not None:
            of_signal[record.sheet.name][record.run.name] = start
    found = []
    for signal, starts in of_signal.items():
        score = {run: abs(y) / sigma for run, (y, sigma) in starts.items()}
        typical = float(np.median(list(score.values())))
        off = [run for run in score if score[run] > SHIFTED * max(typical, 1.0)]
        for run in off:
            sentence = f"begins at {starts[run][0] / MM:.3g} mm, where y = 0 should be: this run is shifted"
            sentence += "; take its readings from where the point was when the yaw was applied"
            found.append(Suspicion(run, (signal,), "shifted", sentence))
        rest = [run for run in score if run not in off]
        zeros = {r.sheet.zero for r in records if r.sheet.name == signal}
        forgotten = curvature_share == 0.0 and zeros == {0.0}
        limit = FORGOTTEN if forgotten else UNSTATED
        if len(rest) >= FEWEST_RUNS and np.sqrt(np.mean([min(score[r], 20.0) ** 2 for r in rest])) > limit:
            size, zero = float(np.sqrt(np.mean([starts[r][0] ** 2 for r in rest]))), max(zeros)
            stated = f"states zero: {zero / MM:g} mm" if zero > 0.0 else "states no zero"
            sentence = f"its runs begin {size / MM:.2g} mm (rms) off y = 0, while the sheet {stated}: "
            sentence += "the zero of every run is what is left when belt and effects are fitted"
            found.append(Suspicion(None, (signal,), "zero", sentence, "look"))
    return found


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


# A steering guide in closed loop, whose action would hide the belt's own behaviour.
#
# A free belt follows its yaw: it drifts, or a crown stops it off the middle on the side of the yaw. Only a guide
# returns it to zero against the yaw, or lets it oscillate for ever. A curved belt edge also oscillates, but with the
# belt's revolution and alike in all runs; it is subtracted first.


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
    span, found = span_of(campaign), []
    for name in dict.fromkeys(r.sheet.name for r in records if r.sheet.kind == "lateral"):
        signal = _subtract_edge(campaign, [r for r in records if r.sheet.name == name])
        judged = [signs for r in signal if (signs := _guide_signs(r, span)) is not None]
        if len(judged) < FEWEST_RECORDS:
            continue
        for shown, words in zip(
            np.sum(judged, axis=0), ("comes back to y = 0 against the yaw", "swings to and fro"), strict=True
        ):
            if shown >= MOST * len(judged):
                sentence = f"{words} in nearly all runs: a guide seems to steer the belt; switch it off, or record"
                sentence += " what it does as yaw in runs.csv"
                found.append(Suspicion(None, (name,), "guided", sentence))
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


def _guide_signs(record: Record, span: float) -> tuple[bool, bool] | None:
    """Return whether a record returns to zero after an early peak on the side of the yaw, and whether it oscillates.

    None for one that is short or does not move clearly beyond its errors. It is averaged over a fiftieth of its length.
    """
    run, error, s = record.run, record.drift_error, record.travel
    if run.yaw == 0.0 or len(s) <= 24 or s[-1] <= SPANS * span or s[0] >= EARLY * s[-1]:
        return None
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
    """Return how often readings change their direction; each time they come back by ``least``."""
    level, turns, up = y[0], 0, None
    for value in y:
        if up is not True and value > level + least:
            turns, up, level = turns + 1, True, value
        elif up is not False and value < level - least:
            turns, up, level = turns + 1, False, value
        level = max(level, value) if up is True else min(level, value) if up is False else level
    return turns
