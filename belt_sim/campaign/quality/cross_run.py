"""Runs that contradict other runs, by a sign that is turned round, or that hold a copy of one."""

import math

import numpy as np

from belt_sim.campaign.quality.record import Record, Severity, Suspicion

#: Readings that are judged must stand this many sigmas out of zero, wander and white noise.
CLEAR = 6.0
#: Runs are compared if their tensions differ by less than this share.
SAME_TENSION = 0.2
#: Cosine between two curves (over yaw) below which one of them is turned round ...
OPPOSED = -0.8
#: ... and the ratio of their sizes is below this: turning a sign leaves the size as it is.
ALIKE_SIZE = 1.5
#: Fewest different readings by which a copy is known.
FEWEST_VALUES = 12
_GRID = 100


def check_signs(records: list[Record]) -> list[Suspicion]:
    """Return signals that run opposite to the same signal of other runs at the same tension, after division by yaw."""
    found = []
    for name in dict.fromkeys(record.sheet.name for record in records):
        own = [r for r in records if r.sheet.name == name and abs(r.run.yaw) > 2.0 * abs(r.run.yaw_head)]
        own = [r for r in own if r.rms > CLEAR * r.drift_error and len(r.travel) > 2]
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
    group = (np.abs(tension[:, None] / tension - 1.0) < SAME_TENSION) & (direction[:, None] == direction)
    opposed = (cosine < OPPOSED) & (np.abs(np.log(size[:, None] / size)) < math.log(ALIKE_SIZE))
    alike = group & ~np.eye(len(own), dtype=bool)
    opposing = alike & opposed
    turned = np.flatnonzero(alike.any(axis=1) & (2 * opposing.sum(axis=1) >= alike.sum(axis=1)))
    if len(np.unique(group[turned], axis=0)) != 1:
        return None  # none, or the same conflict at several tensions: an effect that does not follow the yaw
    k = turned[np.argmin(cosine[turned].sum(axis=1))]
    return own[k], bool((opposing[k] & (side == side[k])).any())


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
        if len(np.unique(record.readings)) < FEWEST_VALUES:
            continue
        first = seen.setdefault((record.sheet.name, record.readings.tobytes()), record.run.name)
        if first != record.run.name:
            sentence = f"has the very readings of run {first}: one of the two was copied; leave it out"
            found.append(Suspicion(record.run.name, (record.sheet.name,), "same_place", sentence))
    return found
