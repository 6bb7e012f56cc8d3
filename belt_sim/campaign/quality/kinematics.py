"""Signals and runs that contradict each other, by rules that hold for all belts, whatever their stiffness and tension.

- After a yaw beta of the tail pulley the points at the tail lead those at the head by about beta L/2, and all points
  move to the same side. With w = beta L (w1 - w0)/(2 (L + pi R)) and w0 + w1 = 1, y_1 - y_4 = L (w1 beta - w), which is
  beta L/2 for pi R << L. In the transient the lead is 0.5 to 2 times that.
- The run-off of a pulley repeats its run-up one wrapped arc later.
- Two sensors at one place read the same; two that a yaw must part do not.
- Runs at one tension and direction are alike, yaw for yaw; no two of them scatter alike.
"""

import math
from collections import defaultdict
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from belt_sim.campaign.quality.record import FEWEST, Record, Severity, Suspicion, pairs_at
from belt_sim.campaign.types import Campaign, rig_of

TAIL_AND_HEAD = (("point_1", "point_4"), ("point_2", "point_3"), ("point_1", "point_3"), ("point_2", "point_4"))

# Constants of the decisions. Leads are in units of beta L/2; an error is zero, wander and white noise together.

#: Sigmas of its error that a lead, a slope or a curve must exceed to be judged.
CLEAR = 6.0
#: The lead is judged once the belt has travelled this many spans.
SPANS = 1.2
#: A lead below -REVERSED is turned round; outside LOW..HIGH the yaw is of another magnitude. Linear belts give 0.5 to
#: 1.7, with a pulley offset as large as the yaw itself 0 to 3.
REVERSED, LOW, HIGH = 0.45, 0.12, 6.0
#: Leads, and yaws, within this ratio are alike.
ALIKE = 3.0
#: If a pulley offset is the reason, the runs of the other yaw sign have a lead above this.
OFFSET = 1.8
#: Late slopes come from the last LATE of records longer than SETTLED spans; MOST: share of runs that must agree.
LATE, SETTLED, MOST = 0.4, 3.5, 0.8
#: How much better the exchanged order of two points across a wrap must fit, as a ratio of variances.
WRAP_RATIO = 4.0
#: Readings of one place may differ by so many sigmas (rms over a run); what a yaw moves apart must exceed so many.
SAME_PLACE, OTHER_PLACE = 4.0, 8.0
#: Lead that any belt reaches once it has travelled two spans.
LEAST_LEAD = 0.3
#: Runs are compared if their tensions differ by less than this share.
SAME_TENSION = 0.2
#: A curve (over yaw) is turned round if its cosine with another is below this, and its size within this ratio.
OPPOSED, ALIKE_SIZE = -0.8, 1.5
_GRID = 100


# ---- the lead of the tail over the head


class Lead(NamedTuple):
    """Mean lead and drift of one run over beta L/2 [1], from one tail and one head signal, after a span; yaw [rad]."""

    tail: Record
    head: Record
    yaw: float
    lead: float
    drift: float


def check_leads(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return exchanged columns, turned signs and slipped yaw units, from the lead of the tail over the head."""
    span = float(rig_of(campaign).span_length)
    found: dict[tuple[str | None, str | None], Suspicion] = {}
    for tail, head in TAIL_AND_HEAD:
        leads = [lead for pair in pairs_at(records, tail, head) if (lead := _lead_of(*pair, span)) is not None]
        for suspicion in _judge(leads, span) if leads else ():
            found.setdefault((suspicion.run, suspicion.kind), suspicion)
    return list(found.values())


def _lead_of(tail: Record, head: Record, span: float) -> Lead | None:
    """Return the lead of a run; None if neither the lead nor the yaw exceeds the errors."""
    run, scale, end = tail.run, tail.run.yaw * span / 2.0, min(tail.travel[-1], head.travel[-1])
    if scale == 0.0 or abs(run.yaw_head) > 0.2 * abs(run.yaw) or end < SPANS * span:
        return None
    s = np.linspace(span, end, _GRID)
    y_tail, y_head = (np.interp(s, r.travel, r.readings) for r in (tail, head))
    lead, drift = float(np.mean(y_tail - y_head)), float(np.mean(y_tail + y_head))
    if max(abs(lead), abs(scale) * LOW) < CLEAR * math.hypot(tail.drift_error, head.drift_error):
        return None
    return Lead(tail, head, run.yaw, lead / scale, drift / scale)


def _judge(leads: list[Lead], span: float) -> list[Suspicion]:
    """Return what is wrong by the leads of one tail over one head signal in all runs."""
    factors = np.array([lead.lead for lead in leads])
    common = len(leads) > 1 and factors.min() > 0.0 and factors.max() <= ALIKE * factors.min()
    if common and (factors.min() > HIGH or factors.max() < LOW):
        sentence = f"in every run {leads[0].tail.sheet.name} and {leads[0].head.sheet.name} differ by about"
        sentence += f" {float(np.median(factors)):.2g} times what the stated yaw gives: the yaw (or the readings) is in"
        sentence += " another unit (rad or mrad written as yaw_deg?)"
        return [Suspicion(None, (), "unit_slip", sentence)]
    usual = float(np.median([abs(lead.yaw) for lead in leads]))
    odd = [lead for lead in leads if _is_odd(lead, usual)]
    if not odd:
        return _turned_column(leads, span)
    found = []
    for lead in odd:
        across = [other.lead for other in leads if other.yaw * lead.yaw < 0.0]
        if across and lead.lead < LOW and float(np.median(across)) > OFFSET:
            continue  # the yaw offset of a pulley explains it
        certain = (len(odd) < len(leads) or bool(across)) if lead.lead < 0.0 else _fits_other_runs(lead, leads)
        found.append(_suspicion(lead, "stop" if certain else "look"))
    if len(found) == len(leads) > 1 and len({s.kind for s in found}) == 1:
        return [replace(found[0], run=None, sentence=f"in every run: {found[0].sentence}")]
    return found


def _is_odd(lead: Lead, usual: float) -> bool:
    """Return whether a lead is turned round (at a yaw larger than machine faults) or of another magnitude."""
    size, yaw = abs(lead.lead), abs(lead.yaw)
    turned = lead.lead < -REVERSED and yaw > 0.5 * usual
    small = size * yaw < LOW * usual / 2.0 or (size < LOW and yaw > HIGH * usual)
    return turned or small or size > HIGH


def _fits_other_runs(lead: Lead, leads: list[Lead]) -> bool:
    """Return whether the yaw implied by the lead, but not the stated yaw, is that of the other runs."""
    others = [abs(other.yaw) for other in leads if other is not lead]
    if not others:
        return False
    stated = abs(lead.yaw) / float(np.median(others))
    implied = stated * abs(lead.lead)
    return 1.0 / ALIKE < implied < ALIKE and not 1.0 / ALIKE < stated < ALIKE


def _suspicion(lead: Lead, severity: Severity) -> Suspicion:
    """Describe an odd lead: slipped unit, exchanged columns or wrong sign."""
    run, names = lead.tail.run, (lead.tail.sheet.name, lead.head.sheet.name)
    times = f"{lead.lead:.2g} times what the yaw of {math.degrees(lead.yaw):.3g} deg gives"
    seen = f"{' and '.join(names)} differ by {times} in the end"
    if not LOW < abs(lead.lead) < HIGH:
        sentence = f"{seen}: the yaw or the readings are in another unit"
        return Suspicion(run.name, (), "unit_slip", sentence, severity)
    if lead.drift > 0.0:
        sentence = f"{seen}, though they move to its side: the two columns are exchanged"
        return Suspicion(run.name, names, "swapped", sentence, severity)
    sentence = f"{seen}, and they move away from its side: the yaw or the readings have the wrong sign"
    return Suspicion(run.name, (), "wrong_sign", sentence, severity)


def _turned_column(leads: list[Lead], span: float) -> list[Suspicion]:
    """Return a column of the wrong sign: tail and head drift apart in the end in nearly all runs."""
    slopes = [slopes for lead in leads if (slopes := _late_slopes(lead, span)) is not None]
    apart = [(tail, head) for tail, head in slopes if abs(tail + head) < 0.5 * abs(tail - head)]
    if len(slopes) < 3 or len(apart) < MOST * len(slopes):
        return []
    against = sum(tail < 0.0 for tail, _ in apart)
    if max(against, len(apart) - against) < MOST * len(apart):
        return []  # what does not follow the yaw is no sign of a column
    turned = leads[0].tail if against > len(apart) / 2 else leads[0].head
    sentence = "drifts away from the other points to the end, in nearly all runs: the sign of this column is turned"
    both = len({lead.yaw > 0.0 for lead in leads}) == 2
    severity: Severity = "stop" if both and len(apart) == len(leads) else "look"
    return [Suspicion(None, (turned.sheet.name,), "wrong_sign", sentence, severity)]


def _late_slopes(lead: Lead, span: float) -> tuple[float, float] | None:
    """Return late slopes over the yaw of tail and head; None if the record is short or the slopes are not clear."""
    end = min(lead.tail.travel[-1], lead.head.travel[-1])
    if end < SETTLED * span:
        return None
    s = np.linspace((1.0 - LATE) * end, end, _GRID)
    tail, head = (float(np.polyfit(s, np.interp(s, r.travel, r.readings), 1)[0]) for r in (lead.tail, lead.head))
    clear = CLEAR * max(lead.tail.drift_error, lead.head.drift_error) / (LATE * end)
    return None if min(abs(tail), abs(head)) < clear else (tail / lead.yaw, head / lead.yaw)


# ---- the way across a pulley


def check_wraps(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return exchanged points of one pulley: the run-off must repeat the run-up one wrapped arc later, not earlier."""
    machine, found = campaign.machine, []
    arcs = {("point_1", "point_2"): machine.tail_radius.value, ("point_3", "point_4"): machine.head_radius.value}
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


# ---- two sensors at one place, or at two


def check_places(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return signals stated at one place that differ, and signals stated at two places that agree."""
    of_pair: dict[tuple[str, str], list[tuple[Record, Record]]] = defaultdict(list)
    judged = [r for r in records if r.sheet.kind == "lateral" and len(r.travel) >= FEWEST]
    for a, b in combinations(judged, 2):
        if a.run.name == b.run.name:
            of_pair[a.sheet.name, b.sheet.name].append((a, b))
    found = []
    for names, pairs in of_pair.items():
        first, second = (r.sheet.at for r in pairs[0])
        sentence = ""
        if first != second and _read_the_same(campaign, pairs):
            sentence = f"read the same, though stated at {first} and {second}: both are at one place, or a column was"
            sentence += " copied"
        off = float(np.median([_difference(*pair) / _noise(*pair) for pair in pairs]))
        if first == second and off >= OTHER_PLACE:
            sentence = (
                f"both are stated at {first}, but differ by {off:.0f} times their noise: one of them is elsewhere"
            )
        if sentence:
            found.append(Suspicion(None, names, "same_place", sentence))
    return found


def _read_the_same(campaign: Campaign, pairs: list[tuple[Record, Record]]) -> bool:
    """Return whether two signals of two places are equal, or agree although the yaw must part them."""
    if all(np.array_equal(a.readings, b.readings) and len(np.unique(a.readings)) > FEWEST for a, b in pairs):
        return True
    if {r.sheet.at for r in pairs[0]} not in [set(places) for places in TAIL_AND_HEAD]:
        return False
    span, apart = float(rig_of(campaign).span_length), []
    for a, b in pairs:
        least = LEAST_LEAD * abs(a.run.yaw) * span / 2.0
        if min(a.travel[-1], b.travel[-1]) > 2.0 * span and least > OTHER_PLACE * _noise(a, b):
            apart.append(_difference(a, b) < SAME_PLACE * _noise(a, b))
    return len(apart) > 1 and all(apart)


def _difference(a: Record, b: Record) -> float:
    """Return the standard deviation of a - b over the run [m], which ignores errors of zero."""
    s = a.travel[(a.travel >= b.travel[0]) & (a.travel <= b.travel[-1])]
    return float(np.std(np.interp(s, a.travel, a.readings) - np.interp(s, b.travel, b.readings)))


def _noise(a: Record, b: Record) -> float:
    """Return the standard deviation of a - b that the instruments explain [m]."""
    gains = [r.sheet.gain * float(np.std(r.readings)) for r in (a, b)]
    return math.hypot(*gains, *(x for r in (a, b) for x in (r.measured_noise, r.sheet.white, r.sheet.wander_sd)))


# ---- one run against the others


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
    s = np.linspace(0.0, min(r.travel[-1] for r in own), _GRID)
    curves = np.array([np.interp(s, r.travel, r.readings) / r.run.yaw for r in own])
    size = np.maximum(np.linalg.norm(curves, axis=1), 1e-300)
    cosine = (curves / size[:, None]) @ (curves / size[:, None]).T
    tension, direction, side = np.array([(r.run.tension, r.run.direction, np.sign(r.run.yaw)) for r in own]).T
    group = (np.abs(tension[:, None] / tension - 1.0) < SAME_TENSION) & (direction[:, None] == direction)
    opposed = (cosine < OPPOSED) & (np.abs(np.log(size[:, None] / size)) < math.log(ALIKE_SIZE))
    alike = group & ~np.eye(len(own), dtype=bool)
    opposing = alike & opposed
    turned = np.flatnonzero(alike.any(axis=1) & (2 * opposing.sum(axis=1) >= alike.sum(axis=1)))
    if len(np.unique(group[turned], axis=0)) != 1:
        return None  # none, or the same conflict at several tensions: an effect that does not follow the yaw
    k = turned[np.argmin(cosine[turned].sum(axis=1))]
    return own[k], bool((opposing[k] & (side == side[k])).any())


def check_copies(records: list[Record]) -> list[Suspicion]:
    """Return runs that hold the readings of another run."""
    found, seen = [], dict[tuple[str, bytes], str]()
    for record in records:
        if len(np.unique(record.readings)) < FEWEST:
            continue
        first = seen.setdefault((record.sheet.name, record.readings.tobytes()), record.run.name)
        if first != record.run.name:
            sentence = f"has the very readings of run {first}: one of the two was copied; leave it out"
            found.append(Suspicion(record.run.name, (record.sheet.name,), "same_place", sentence))
    return found
