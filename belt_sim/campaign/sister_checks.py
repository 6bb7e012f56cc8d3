"""Checks of runs against each other: signs, the order of points on one pulley, and units of the travel."""

import math
from collections import defaultdict

import numpy as np

from belt_sim.campaign.nouns import Campaign
from belt_sim.campaign.record import Record
from belt_sim.campaign.suspect import Severity, Suspicion

#: Readings that are judged must stand this many sigmas out of zero, wander and white noise.
CLEAR = 6.0
#: Runs are sisters when their tensions differ by less than this share.
SAME_TENSION = 0.2
#: Cosine between the curves (over yaw) of sisters below which one of them is turned round ...
OPPOSED = -0.8
#: ... and the ratio of their sizes is below this: turning a sign leaves the size as it is.
ALIKE_SIZE = 1.5
#: Factor on step and length of the travel, against other runs, or on travel/(speed time), that is a slip.
TRAVEL_FACTOR = 20.0
#: How much better the exchanged order of two points across a wrap must fit, as a ratio of variances.
WRAP_RATIO = 4.0
_GRID = 100


def against_sisters(records: list[Record]) -> list[Suspicion]:
    """A signal that runs opposite to the same signal of runs at the same tension, yaw for yaw."""
    found = []
    for name in dict.fromkeys(record.sheet.name for record in records):
        own = [r for r in records if r.sheet.name == name and abs(r.run.yaw) > 2.0 * abs(r.run.yaw_head)]
        own = [r for r in own if np.sqrt(np.mean(r.readings**2)) > CLEAR * r.drift_error and len(r.travel) > 2]
        if len(own) > 2 and (turned := _turned_round(own)) is not None:
            record, certain = turned
            sentence = "runs opposite to the runs at the same tension, yaw for yaw: its sign is turned round"
            severity: Severity = "stop" if certain else "look"
            found.append(
                Suspicion(run=record.run.name, signal=name, kind="wrong_sign", sentence=sentence, severity=severity)
            )
    return found


def _turned_round(own: list[Record]) -> tuple[Record, bool] | None:
    """The record that opposes its sisters; certain when one of these has a yaw of the same sign."""
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
    """Cosines between records over their yaw, shape (n, n), on the travel that all have; their sizes (n,)."""
    s = np.linspace(0.0, min(r.travel[-1] for r in records), _GRID)
    curves = np.array([np.interp(s, r.travel, r.readings) / r.run.yaw for r in records])
    size = np.maximum(np.linalg.norm(curves, axis=1), 1e-300)
    unit = curves / size[:, None]
    return unit @ unit.T, size


def exchanged_across_a_wrap(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Two points of one pulley: what runs off must repeat what ran up one wrapped arc before, not after."""
    machine = campaign.machine
    arcs = {
        ("point_1", "point_2"): machine.tail_radius.value,
        ("point_3", "point_4"): machine.head_radius.value,
    }
    of_run: dict[str, dict[str, Record]] = defaultdict(dict)
    for record in records:
        of_run[record.run.name].setdefault(record.sheet.at, record)
    found = []
    for places, radius in arcs.items():
        for of_place in of_run.values():
            if not all(place in of_place for place in places):
                continue
            up, off = (of_place[place] for place in places)
            if up.run.direction < 0:
                up, off = off, up
            early = _misfit(up, off, math.pi * radius)
            if _misfit(off, up, math.pi * radius) * WRAP_RATIO < early:
                both = " and ".join(sorted((up.sheet.name, off.sheet.name)))
                sentence = f"{off.sheet.name} moves before {up.sheet.name}, where the belt comes from: exchanged"
                sentence += ", or the direction of travel is the other one"
                found.append(Suspicion(run=up.run.name, signal=both, kind="swapped", sentence=sentence))
    return found


def _misfit(up: Record, off: Record, arc: float) -> float:
    """Variance of off(s) - up(s - arc) about its mean [m2], less what the stated noise explains."""
    s = off.travel[(off.travel >= arc) & (off.travel <= up.travel[-1])]
    if len(s) < 3:
        return 0.0
    rest = np.interp(s, off.travel, off.readings) - np.interp(s - arc, up.travel, up.readings)
    noise = up.sheet.white**2 + off.sheet.white**2 + up.sheet.wander_sd**2 + off.sheet.wander_sd**2
    return float(np.var(rest)) + 0.5 * noise


def travel_out_of_scale(campaign: Campaign) -> list[Suspicion]:
    """Runs whose travel has another magnitude than that of the others, or than speed times time."""
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
            found.append(Suspicion(run=run.name, signal=None, kind="unit_slip", sentence=sentence))
        elif run.time is not None and np.isfinite(run.time).sum() > 2:
            there = np.isfinite(run.time)
            seconds = run.time[there][-1] - run.time[there][0]
            pace = (run.travel[there][-1] - run.travel[there][0]) / (seconds * run.speed)
            if not 1.0 / TRAVEL_FACTOR < pace < TRAVEL_FACTOR:
                sentence = f"travel is {pace:.3g} times speed times time: one of them is in another unit"
                found.append(Suspicion(run=run.name, signal=None, kind="unit_slip", sentence=sentence))
    return found
