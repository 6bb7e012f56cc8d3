"""Where sensors stand, by what all belts share.

Two points of one pulley read the same path one wrapped arc apart; two sensors at one place read the same; two that a
yaw must part do not.
"""

import math
from collections import defaultdict
from itertools import combinations

import numpy as np

from belt_sim.campaign.quality.leads import TAIL_AND_HEAD
from belt_sim.campaign.quality.record import FEWEST, Record, Suspicion, pairs_at
from belt_sim.campaign.types import Campaign, rig_of

#: How much better the exchanged order of two points across a wrap must fit, as a ratio of variances.
WRAP_RATIO = 4.0
#: Readings of one place may differ by so many sigmas (rms over a run); what a yaw moves apart must exceed so many.
SAME_PLACE, OTHER_PLACE = 4.0, 8.0
#: Share of beta L/2 by which tail and head differ on any belt, once it has travelled a span.
LEAST_LEAD = 0.3


def check_wraps(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return exchanged points of one pulley: the run-off must repeat the run-up one wrapped arc later, not earlier."""
    machine = campaign.machine
    arcs = {("point_1", "point_2"): machine.tail_radius.value, ("point_3", "point_4"): machine.head_radius.value}
    found = []
    for places, radius in arcs.items():
        for up, off in pairs_at(records, *places):
            if up.run.direction < 0:
                up, off = off, up
            early = _misfit(up, off, math.pi * radius)
            if _misfit(off, up, math.pi * radius) * WRAP_RATIO < early:
                first, second = sorted((up.sheet.name, off.sheet.name))
                sentence = f"{off.sheet.name} moves before {up.sheet.name}, where the belt comes from: exchanged"
                sentence += ", or the direction of travel is the other one"
                found.append(Suspicion(up.run.name, (first, second), "swapped", sentence))
    return found


def _misfit(up: Record, off: Record, arc: float) -> float:
    """Return the variance of off(s) - up(s - arc) about its mean [m2], plus half the variance of the stated noise."""
    s = off.travel[(off.travel >= arc) & (off.travel <= up.travel[-1])]
    if len(s) < 3:
        return 0.0
    rest = np.interp(s, off.travel, off.readings) - np.interp(s - arc, up.travel, up.readings)
    noise = up.sheet.white**2 + off.sheet.white**2 + up.sheet.wander_sd**2 + off.sheet.wander_sd**2
    return float(np.var(rest)) + 0.5 * noise


def check_places(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return signals stated at one place that differ, and signals stated at two places that agree."""
    of_pair: dict[tuple[str, str], list[tuple[Record, Record]]] = defaultdict(list)
    judged = [r for r in records if r.sheet.kind == "lateral" and len(r.travel) >= FEWEST]
    for a, b in combinations(judged, 2):
        if a.run.name == b.run.name:
            of_pair[a.sheet.name, b.sheet.name].append((a, b))
    found = []
    for names, pairs in of_pair.items():
        sentence = _same(pairs) if pairs[0][0].sheet.at == pairs[0][1].sheet.at else _different(campaign, pairs)
        if sentence:
            found.append(Suspicion(None, names, "same_place", sentence))
    return found


def _same(pairs: list[tuple[Record, Record]]) -> str:
    """Describe two signals of one place that differ by more than zero, gain and noise; empty if they do not."""
    off = [_difference(a, b) / _noise(a, b) for a, b in pairs]
    if np.median(off) < OTHER_PLACE:
        return ""
    at = pairs[0][0].sheet.at
    return f"both are stated at {at}, but differ by {np.median(off):.0f} times their noise: one of them is elsewhere"


def _different(campaign: Campaign, pairs: list[tuple[Record, Record]]) -> str:
    """Describe two signals of two places that are equal, or agree although the yaw must part them; empty if not."""
    a, b = pairs[0]
    equal = all(np.array_equal(x.readings, y.readings) and len(np.unique(x.readings)) > FEWEST for x, y in pairs)
    ordered = {a.sheet.at, b.sheet.at} in [set(p) for p in TAIL_AND_HEAD]
    apart = [(x, y) for x, y in pairs if ordered and _must_differ(campaign, x, y)]
    alike = len(apart) > 1 and all(_difference(x, y) < SAME_PLACE * _noise(x, y) for x, y in apart)
    if not (equal or alike):
        return ""
    return (
        f"read the same, though stated at {a.sheet.at} and {b.sheet.at}: both are at one place, or a column was copied"
    )


def _must_differ(campaign: Campaign, a: Record, b: Record) -> bool:
    span = float(rig_of(campaign).span_length)
    least = LEAST_LEAD * abs(a.run.yaw) * span / 2.0
    return min(a.travel[-1], b.travel[-1]) > 2.0 * span and least > OTHER_PLACE * _noise(a, b)


def _difference(a: Record, b: Record) -> float:
    """Return the standard deviation of a - b over the run [m], which ignores errors of zero."""
    s = a.travel[(a.travel >= b.travel[0]) & (a.travel <= b.travel[-1])]
    return float(np.std(np.interp(s, a.travel, a.readings) - np.interp(s, b.travel, b.readings)))


def _noise(a: Record, b: Record) -> float:
    """Return the standard deviation of a - b that the instruments explain [m]."""

    def of_one(r: Record) -> float:
        gain_error = r.sheet.gain * float(np.std(r.readings))
        return math.hypot(r.measured_noise, r.sheet.white, r.sheet.wander_sd, gain_error)

    return math.hypot(of_one(a), of_one(b))
