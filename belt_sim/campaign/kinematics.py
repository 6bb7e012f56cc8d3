"""Data-quality checks by the motion that all belts share (repeats, exchanged columns, turned signs, guides), and all
checks in one.
"""

import math
from collections import defaultdict
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from itertools import combinations
from typing import NamedTuple

import numpy as np

from belt_sim.campaign.quality import (
    FEWEST_ON_LINE,
    FEWEST_READINGS,
    FEWEST_RUNS,
    Record,
    Severity,
    Suspicion,
    SuspicionKind,
    check_gaps,
    check_noise,
    check_record,
    check_starts,
    check_travel,
    counted_from_yaw,
    leave_out_bad_readings,
    off_the_pulleys,
    pairs_at,
    records_of,
)
from belt_sim.campaign.types import Campaign, Run, rig_of
from belt_sim.units import MM, N_PER_MM2

TAIL_AND_HEAD = (("point_1", "point_4"), ("point_2", "point_3"), ("point_1", "point_3"), ("point_2", "point_4"))

# Constants of the decisions. Leads are in units of beta L/2; an error is zero, wander and white noise together.

#: Sigmas of its error that a lead, a slope or a curve must exceed to be judged.
CLEAR_SIGMAS = 6.0
#: The lead is judged once the belt has travelled this many spans.
LEAD_SPANS = 1.2
#: A lead below -REVERSED_LEAD is turned round; outside LOW..HIGH the yaw is of another magnitude. Linear belts give 0.5
#: to 1.7, with a pulley offset as large as the yaw itself 0 to 3.
REVERSED_LEAD, LOW, HIGH = 0.45, 0.12, 6.0
#: Leads, and yaws, within this ratio are alike.
ALIKE_LEADS = 3.0
#: If a pulley offset is the reason, the runs of the other yaw sign have a lead above this.
OFFSET = 1.8
#: Late slopes come from the last LATE of records longer than SETTLED_SPANS; AGREEING_SHARE: of runs, that must agree.
LATE, SETTLED_SPANS, AGREEING_SHARE = 0.4, 3.5, 0.8
#: How much better the exchanged order of two points across a wrap must fit, as a ratio of variances.
WRAP_RATIO = 4.0
#: Readings of one place may differ by so many sigmas (rms over a run); what a yaw moves apart must exceed so many.
SAME_PLACE, OTHER_PLACE = 4.0, 8.0
#: Lead that any belt reaches once it has travelled two spans.
LEAST_LEAD = 0.3
#: Runs are compared if their tensions differ by less than this share.
SAME_TENSION = 0.2
#: Sigmas of sensors and settings by which repeats must differ in the end to be told.
REPEATS_APART = 4.0
#: One of five repeats and more is off that ends this many times as far from the others' median as they do in the
#: median: of repeats that scatter normally one series in 400.
ODD_REPEAT = 8.0
#: A curve (over yaw) is turned round if its cosine with another is below this, and its size within this ratio.
OPPOSED, ALIKE_SIZE = -0.8, 1.5
_GRID = 100
#: Spans that a record must cover; the first and the last part of it that are compared.
GUIDED_SPANS, GUIDED_EARLY, GUIDED_LATE = 3.0, 0.5, 0.3
#: Share of the early peak below which late readings have returned, and above which late swings are an oscillation.
BACK, SWING = 0.25, 0.3
#: A signal is judged if it exceeds this many sigmas of zero, wander and white noise.
CLEAR_SWING = 8.0
#: Fewest runs, and the share of the judged runs that must agree.
FEWEST_RECORDS, GUIDED_MOST = 3, 0.8
TURNS = 4  # changes of direction that make an oscillation
HALTED = 0.03  # of yaw times travel: a free belt has drifted further
#: Harmonics of the belt's length, degree of the drift polynomial, and the fewest revolutions that separate the two.
BELT_HARMONICS, DRIFT_DEGREE, ROUNDS = 8, 3, 2.0


def check_running_start(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return a campaign whose records begin on a belt that runs off already, before any yaw could move it.

    Of a straight belt at rest the two pulleys begin unlike, as the lean spreads with the travel, and an edge that is
    not straight shows in opposite phases. So the rate before the yaw (or at the start of a run without yaw) is
    judged by its mean over both pulleys and all runs, against its scatter between them.
    """
    reach, rates, errors = 0.5 * float(rig_of(campaign).span_length), [], []
    for pair in (p for places in TAIL_AND_HEAD for p in pairs_at(records, *places) if p[0].run.run_in == 0.0):
        own = []  # rate and its error at tail and head
        for record in pair:
            early = record.travel - record.travel[0] < reach
            if record.run.yaw or record.run.yaw_head:
                early &= record.travel < 0.0
            s, y = record.travel[early], record.readings[early]
            if len(s) >= FEWEST_ON_LINE:
                error = math.hypot(record.sheet.white * math.sqrt(12.0 / len(s)), 2.0 * record.sheet.wander_sd)
                own.append((float(np.polynomial.Polynomial.fit(s, y, 1).deriv()(0.0)), error / float(np.ptp(s))))
        if len(own) == 2:
            rates.append(float(np.mean([rate for rate, _ in own])))
            errors.append(math.hypot(*(error for _, error in own)) / 2.0)
    if len(rates) < FEWEST_RUNS:
        return []
    rate = float(np.mean(rates))
    error = max(float(np.mean(errors)), float(np.std(rates, ddof=1))) / math.sqrt(len(rates))
    if abs(rate) < CLEAR_SIGMAS * error:
        return []
    sentence = (
        f"the belt runs off by {1e3 * rate:+.2g} mm/m (one sigma {1e3 * error:.1g}) before any yaw, at both pulleys "
        "alike: something acts without a yaw, as a cone does. If the belt already ran before the record, enter that "
        "distance as run_in_m in runs.csv (run_in of the run in an import's mapping)"
    )
    return [Suspicion(None, (), "running_start", sentence, "look")]


def check_repeats(campaign: Campaign) -> list[Suspicion]:
    """Return repeats that differ by more than sensors and settings explain: what would make the difference, in numbers.

    Of three runs at one setting and more each is compared with the median of the others, so that one that is spoilt is
    named and adds nothing to its own error; of two the second with the first. The difference is compared, without a
    model, with what the same run would do at another tension (by the runs at the same yaw), after another yaw (in
    proportion), and with a further drift, beside what comes round with the belt; the time between the runs is told.
    """
    of_run: dict[str, dict[str, Record]] = defaultdict(dict)
    for record in counted_from_yaw([r for r in records_of(campaign) if r.sheet.kind == "lateral"]):
        of_run[record.run.name][record.sheet.name] = record
    series, found = defaultdict[str, list[Run]](list), []
    for run in campaign.runs:
        series[run.repeat_of or run.name].append(run)
    for runs in series.values():
        alike = [run for run in runs if of_run[run.name].keys() & of_run[runs[0].name].keys()]
        names = sorted(set.intersection(*(set(of_run[run.name]) for run in alike))) if len(alike) > 1 else []
        found += _odd_repeats(campaign, of_run, alike, names) if names else []
    return found


def _odd_repeats(
    campaign: Campaign, of_run: dict[str, dict[str, Record]], alike: list[Run], names: list[str]
) -> list[Suspicion]:
    """Return the runs of one setting that differ from the others; of_run: records of every run by signal."""
    first, several, found = alike[0], len(alike) > 2, []
    end = min(of_run[run.name][n].travel[-1] for run in alike for n in names)
    s = np.linspace(0.0, end, 4 * _GRID)
    # a curved edge comes round with the belt, in another phase where a run starts elsewhere
    turns = end / float(rig_of(campaign).belt_length)
    phases = 2.0 * np.pi * turns * np.outer(s / end, np.arange(1, 1 + min(BELT_HARMONICS, int(len(s) / (4.0 * turns)))))
    waves = np.concatenate([np.cos(phases), np.sin(phases)], axis=1) if turns > ROUNDS else np.zeros((len(s), 0))
    curves = np.array([_curves_of(run, of_run, names, s) for run in alike])
    judged = alike if several else alike[1:]
    of_others = [np.median(np.delete(curves, alike.index(run), axis=0), axis=0) for run in judged]
    apart = curves[-len(judged) :] - of_others  # (runs, signals, travel)
    basis = np.hstack([np.vander(s / end, DRIFT_DEGREE + 1), waves])
    sizes = np.linalg.lstsq(basis, apart.reshape(-1, len(s)).T, rcond=None)[0]
    rounds = (waves @ sizes[DRIFT_DEGREE + 1 :]).T.reshape(apart.shape)  # what comes round with the belt
    off = np.abs((apart - rounds)[..., -len(s) // 5 :].mean(axis=2))  # (runs, signals)
    same_start = np.ptp([r.start or 0.0 for r in alike]) == 0.0
    elsewhere, heights = not (several and same_start), rounds.std(axis=(1, 2))
    for k, run in enumerate(judged):
        name, size = names[int(np.argmax(off[k]))], float(off[k].max())
        its = of_run[first.name][name]
        error = math.hypot(its.drift_error, 0.5 * campaign.settings.yaw_u * end)  # drift per yaw is about a half
        # its height at the yaw stays in all that follows; of several that of the others, as a fault has one too
        height = max(np.median(heights), heights[k]) if elsewhere else np.median(np.delete(heights, k))
        error = math.sqrt(2.0) * math.hypot(error, campaign.settings.tension_rel * its.rms, height)
        usual = float(np.median(np.delete(off.max(axis=1), k))) if several else math.inf
        beyond = size >= REPEATS_APART * error
        # a mean of many readings errs less
        odd = len(alike) > FEWEST_RUNS and size >= max(ODD_REPEAT * usual, 0.5 * REPEATS_APART * its.drift_error)
        if not (beyond or odd):
            continue
        others = f"the {len(alike) - 1} other runs of its setting" if several else f"its first run {first.name}"
        sentence = f"differs from {others} by {size / MM:.2g} mm in {name} (one sigma {error / MM:.1g})"
        sentence += "" if beyond else f", {size / usual:.0f} times as far as they do, most of them"
        sentence += _likely_cause(campaign, of_run, (first, run), names, s, of_others[k], (apart - rounds)[k])
        sentence += "; leave it out if it is spoilt (skip: true in an import's mapping), else something changes between"
        sentence += " the runs: log tension, yaw and temperature with the time of day"
        alone = turns > ROUNDS or same_start  # else it may be the belt's edge
        found.append(Suspicion(run.name, (), "repeats", sentence, "stop" if alone and beyond else "look"))
    return found


def _curves_of(run: Run, of_run: dict[str, dict[str, Record]], names: list[str], s: np.ndarray) -> np.ndarray:
    """Return readings of a run over travels s (n,) [m], (signals, n), turned to the side of a positive yaw."""
    return np.array([of_run[run.name][n].at(s) for n in names]) * np.sign(run.yaw or 1.0)


def _likely_cause(
    campaign: Campaign, of_run: dict[str, dict[str, Record]], runs: tuple[Run, Run], names: list[str], s: np.ndarray,
    usual: np.ndarray, apart: np.ndarray,
) -> str:  # fmt: skip
    """Return how much later than the first of its setting a run began, and the setting that would best explain by how
    much it is ``apart`` from its ``usual`` curves, both (signals, n) over travels s (n,), in words."""
    (first, run), said = runs, ""
    clocks = [r.started if "-" in r.started[:5] else f"2000-01-01T{r.started}" for r in runs]
    with suppress(ValueError, TypeError):  # their clocks may not tell
        hours = (datetime.fromisoformat(clocks[1]) - datetime.fromisoformat(clocks[0])).total_seconds() / 3600.0
        said = f", {abs(hours):.2g} h {'later' if hours >= 0.0 else 'earlier'}" if run is not first else ""
    drift = np.tile(s, (len(names), 1))
    shapes = [(usual, "as after {0:.3g} times the yaw"), (drift, "as with a further drift of {1:+.2g} mm/m")]
    tensions = [0.0, 0.0]
    for other in campaign.runs:
        same = other.direction == first.direction and abs(abs(other.yaw) - abs(first.yaw)) < 0.05 * abs(first.yaw)
        there = of_run[other.name]
        reaches = all(n in there and there[n].travel[-1] >= s[-1] for n in names)
        if same and reaches and other.tension != first.tension:
            words = f"as at {{2:.3g}} N/mm2 instead of {first.tension / N_PER_MM2:.3g}"
            shapes.append((_curves_of(other, of_run, names, s) - usual, words))
            tensions.append(other.tension)
    likely = []  # share of the squares that each shape explains, and the setting that gives as much of it as there is
    for (shape, words), tension in zip(shapes, tensions, strict=True):
        much = float(np.sum(shape * apart)) / max(float(np.sum(shape**2)), 1e-300)
        explained = 1.0 - float(np.sum((apart - much * shape) ** 2)) / float(np.sum(apart**2))
        # a difference of thousands is of no tension
        like = first.tension * (tension / first.tension) ** float(np.clip(much, -9.0, 9.0)) if tension else 0.0
        likely.append((explained, words.format(1.0 + much, 1e3 * much * np.sign(first.yaw or 1.0), like / N_PER_MM2)))
    best, words = max(likely)
    return said + (f", {words} ({100.0 * best:.0f} % of the squares)" if best > 0.6 else "")


class Lead(NamedTuple):
    """Mean lead and drift of one run over beta L/2 [1], from one tail and one head signal, after a span; yaw [rad]."""

    tail: Record
    head: Record
    yaw: float
    lead: float
    drift: float


def check_leads(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return exchanged columns, turned signs and slipped yaw units, from the lead of the tail over the head.

    A run is judged where the lead or the yaw exceeds the errors, and its yaw is that of the tail.
    """
    span = float(rig_of(campaign).span_length)
    found: dict[tuple[str | None, str | None], Suspicion] = {}
    for places in TAIL_AND_HEAD:
        leads = []
        for tail, head in pairs_at(records, *places):
            run, scale, end = tail.run, tail.run.yaw * span / 2.0, min(tail.travel[-1], head.travel[-1])
            if scale == 0.0 or abs(run.yaw_head) > 0.2 * abs(run.yaw) or end < LEAD_SPANS * span or run.runs_already:
                continue
            s = np.linspace(span, end, _GRID)
            lead, drift = float(np.mean(tail.at(s) - head.at(s))), float(np.mean(tail.at(s) + head.at(s)))
            if max(abs(lead), abs(scale) * LOW) >= CLEAR_SIGMAS * math.hypot(tail.drift_error, head.drift_error):
                leads.append(Lead(tail, head, run.yaw, lead / scale, drift / scale))
        for suspicion in _judge(leads, span) if leads else ():
            found.setdefault((suspicion.run, suspicion.kind), suspicion)
    return list(found.values())


def _judge(leads: list[Lead], span: float) -> list[Suspicion]:
    """Return what leads that no belt has could come from."""
    factors = np.array([lead.lead for lead in leads])
    common = len(leads) > 1 and factors.min() > 0.0 and factors.max() <= ALIKE_LEADS * factors.min()
    if common and (factors.min() > HIGH or factors.max() < LOW):
        sentence = f"in every run {leads[0].tail.sheet.name} and {leads[0].head.sheet.name} differ by about"
        sentence += f" {float(np.median(factors)):.2g} times what the stated yaw gives: the yaw (or the readings) is in"
        sentence += " another unit (rad or mrad written as yaw_deg?)"
        return [Suspicion(None, (), "unit_slip", sentence)]
    sizes, yaws = np.abs(factors), np.abs([lead.yaw for lead in leads])
    usual = float(np.median(yaws))
    small = (sizes * yaws < LOW * usual / 2.0) | ((sizes < LOW) & (yaws > HIGH * usual))
    is_odd = ((factors < -REVERSED_LEAD) & (yaws > 0.5 * usual)) | small | (sizes > HIGH)
    if not is_odd.any():
        return _turned_column(leads, span)
    found = []
    for lead in (lead for lead, odd in zip(leads, is_odd, strict=True) if odd):
        across = [other.lead for other in leads if other.yaw * lead.yaw < 0.0]
        if across and lead.lead < LOW and float(np.median(across)) > OFFSET:
            continue  # the yaw offset of a pulley explains it
        certain = not is_odd.all() or bool(across)
        if lead.lead >= 0.0:  # certain if the yaw implied by the lead, but not the stated one, is that of other runs
            others = [abs(other.yaw) for other in leads if other is not lead]
            stated = abs(lead.yaw) / float(np.median(others)) if others else 1.0
            implied, stated = (abs(math.log(max(x, 1e-300))) for x in (stated * abs(lead.lead), stated))
            certain = implied < math.log(ALIKE_LEADS) <= stated
        # what it could come from
        run, names = lead.tail.run, (lead.tail.sheet.name, lead.head.sheet.name)
        kind: SuspicionKind = "wrong_sign"
        concerned: tuple[str, ...] = ()
        times = f"{lead.lead + 0.0:.2g} times what the yaw of {math.degrees(lead.yaw):.3g} deg gives"
        sentence = f"{' and '.join(names)} differ by {times} in the end"
        if run.run_in > 0.0 and run.travel[0] >= run.yaw_at:  # no reading shows the belt before its yaw
            given = f"what the yaw of {math.degrees(lead.yaw):.3g} deg, set when the record began, gives"
            kind, sentence = "running_start", f"{' and '.join(names)} differ by {lead.lead:.2g} times {given}"
            sentence += ": it was on before (yaw_at_m below 0, or run_in_m: unknown), or else the two columns are"
            sentence += " exchanged, or a sign or a unit is another"
        elif not LOW < abs(lead.lead) < HIGH:
            kind, sentence = "unit_slip", f"{sentence}: the yaw or the readings are in another unit"
        elif lead.drift > 0.0:
            kind, concerned = "swapped", names
            sentence += ", though they move to its side: the two columns are exchanged"
            sentence += ", or the yaw was on before the record (run_in_m)" if run.travel[0] >= run.yaw_at else ""
            sentence += ", or the yaw has the wrong sign"
        else:
            sentence += ", and they move away from its side: the yaw or the readings have the wrong sign"
        found.append(Suspicion(run.name, concerned, kind, sentence, "stop" if certain else "look"))
    if len(found) == len(leads) > 1 and len({s.kind for s in found}) == 1:
        return [replace(found[0], run=None, sentence=f"in every run: {found[0].sentence}")]
    return found


def _turned_column(leads: list[Lead], span: float) -> list[Suspicion]:
    """Return a column of the wrong sign: tail and head drift apart in the end in nearly all runs."""
    slopes = []  # late slopes over the yaw of tail and head, where records are long and slopes are clear
    for lead in leads:
        end = min(lead.tail.travel[-1], lead.head.travel[-1])
        s = np.linspace((1.0 - LATE) * end, end, _GRID)
        pair = [np.polyfit(s, r.at(s), 1)[0] for r in (lead.tail, lead.head)]
        clear = CLEAR_SIGMAS * max(lead.tail.drift_error, lead.head.drift_error) / (LATE * end)
        if end >= SETTLED_SPANS * span and min(map(abs, pair)) >= clear:
            slopes.append([float(slope) / lead.yaw for slope in pair])
    apart = [(tail, head) for tail, head in slopes if abs(tail + head) < 0.5 * abs(tail - head)]
    if len(slopes) < 3 or len(apart) < AGREEING_SHARE * len(slopes):
        return []
    against = sum(tail < 0.0 for tail, _ in apart)
    if max(against, len(apart) - against) < AGREEING_SHARE * len(apart):
        return []  # what does not follow the yaw is no sign of a column
    turned = leads[0].tail if against > len(apart) / 2 else leads[0].head
    sentence = "drifts away from the other points to the end, in nearly all runs: the sign of this column is turned"
    both = len({lead.yaw > 0.0 for lead in leads}) == 2
    severity: Severity = "stop" if both and len(apart) == len(leads) else "look"
    return [Suspicion(None, (turned.sheet.name,), "wrong_sign", sentence, severity)]


def check_wraps(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return exchanged points of one pulley: the run-off must repeat the run-up one wrapped arc later, not earlier."""
    machine, found = campaign.machine, []
    wraps = {("point_1", "point_2"): machine.tail_radius.value, ("point_3", "point_4"): machine.head_radius.value}
    for pair, arc in ((p, math.pi * radius) for places, radius in wraps.items() for p in pairs_at(records, *places)):
        misfits = []  # of the run-off as the second of the pair, and as the first
        for up, off in (pair, pair[::-1]):
            s = off.travel[(off.travel >= arc) & (off.travel <= up.travel[-1])]
            rest = off.at(s) - up.at(s - arc)
            noise = up.sheet.white**2 + off.sheet.white**2 + up.sheet.wander_sd**2 + off.sheet.wander_sd**2
            misfits.append(float(np.var(rest)) + 0.5 * noise if len(s) >= 3 else 0.0)
        way = int(pair[0].run.direction)
        (up, off), (stated, exchanged) = pair[::way], misfits[::way]
        if exchanged * WRAP_RATIO < stated:
            sentence = f"{off.sheet.name} moves before {up.sheet.name}, where the belt comes from: exchanged"
            sentence += ", or the direction of travel is the other one"
            names = tuple(sorted((up.sheet.name, off.sheet.name)))
            found.append(Suspicion(up.run.name, names, "swapped", sentence))
    return found


def check_places(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return signals stated at one place that differ, and signals stated at two places that agree."""
    of_pair: dict[tuple[str, str], list[tuple[Record, Record]]] = defaultdict(list)
    judged = [r for r in records if r.sheet.kind == "lateral" and len(r.travel) >= FEWEST_READINGS]
    for a, b in (pair for pair in combinations(judged, 2) if pair[0].run.name == pair[1].run.name):
        of_pair[a.sheet.name, b.sheet.name].append((a, b))
    span, found = float(rig_of(campaign).span_length), []
    for names, pairs in of_pair.items():
        (first, second), apart, alike = (r.sheet.at for r in pairs[0]), [], []
        for a, b in pairs:  # by the scatter of their difference, which ignores errors of zero
            s = a.travel[(a.travel >= b.travel[0]) & (a.travel <= b.travel[-1])]
            difference = float(np.std(a.at(s) - b.at(s)))
            errors = (x for r in (a, b) for x in (r.measured_noise, r.sheet.white, r.sheet.wander_sd))
            noise = math.hypot(*errors, *(r.sheet.gain * float(np.std(r.readings)) for r in (a, b)))
            apart.append(difference / noise)
            least = LEAST_LEAD * abs(a.run.yaw) * span / 2.0
            if min(a.travel[-1], b.travel[-1]) > 2.0 * span and least > OTHER_PLACE * noise and not a.run.runs_already:
                alike.append(difference < SAME_PLACE * noise)
        if first == second and (off := float(np.median(apart))) >= OTHER_PLACE:
            sentence = f"both are stated at {first}, but differ by {off:.0f} times their noise: one is elsewhere"
            found.append(Suspicion(None, names, "same_place", sentence))
        equal = (np.array_equal(a.readings, b.readings) for a, b in pairs)
        copied = all(equal) and all(len(np.unique(a.readings)) > FEWEST_READINGS for a, _ in pairs)
        one = {first, second} in [{*places} for places in TAIL_AND_HEAD] and len(alike) > 1 and all(alike)
        if first != second and (copied or one):
            sentence = f"read the same, though stated at {first} and {second}: both are at one place, or a column was"
            found.append(Suspicion(None, names, "same_place", f"{sentence} copied"))
    return found


def check_signs(records: list[Record]) -> list[Suspicion]:
    """Return signals that run opposite to the same signal of other runs at the same tension, after division by yaw.

    It is certain where one of the opposed runs has a yaw of the same sign.
    """
    found = []
    judged = [r for r in records if abs(r.run.yaw) > 2.0 * abs(r.run.yaw_head) and not r.run.runs_already]
    judged = [r for r in judged if r.rms > CLEAR_SIGMAS * r.drift_error and len(r.travel) > 2]
    for name in dict.fromkeys(r.sheet.name for r in judged):
        own = [r for r in judged if r.sheet.name == name]
        if len(own) < 3:
            continue
        s = np.linspace(0.0, min(r.travel[-1] for r in own), _GRID)
        curves = np.array([r.at(s) / r.run.yaw for r in own])
        size = np.maximum(np.linalg.norm(curves, axis=1), 1e-300)
        cosine = (curves / size[:, None]) @ (curves / size[:, None]).T
        tension, direction, side = np.array([(r.run.tension, r.run.direction, np.sign(r.run.yaw)) for r in own]).T
        group = (np.abs(tension[:, None] / tension - 1.0) < SAME_TENSION) & (direction[:, None] == direction)
        alike = group & ~np.eye(len(own), dtype=bool)
        opposing = alike & (cosine < OPPOSED) & (np.abs(np.log(size[:, None] / size)) < math.log(ALIKE_SIZE))
        turned = np.flatnonzero(alike.any(axis=1) & (2 * opposing.sum(axis=1) >= alike.sum(axis=1)))
        if len(np.unique(group[turned], axis=0)) != 1:
            continue  # none, or the same conflict at several tensions: an effect that does not follow the yaw
        k = turned[np.argmin(cosine[turned].sum(axis=1))]
        severity: Severity = "stop" if (opposing[k] & (side == side[k])).any() else "look"
        sentence = "runs opposite to the runs at the same tension, yaw for yaw: its sign is turned round"
        found.append(Suspicion(own[k].run.name, (name,), "wrong_sign", sentence, severity))
    return found


def check_guide(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return signals that return to zero or oscillate in nearly all runs with a yaw: a guide acts, in closed loop.

    A free belt follows its yaw: it drifts, or a crown stops it off the middle on the side of the yaw. Only a guide
    returns it to zero against the yaw, or lets it oscillate for ever. A curved belt edge also oscillates, but with the
    belt's revolution and alike in all runs; it is subtracted first.
    """
    span, length, found = float(rig_of(campaign).span_length), float(rig_of(campaign).belt_length), []
    for name in dict.fromkeys(r.sheet.name for r in records if r.sheet.kind == "lateral"):
        judged = []  # does a run return to zero after an early peak on the side of the yaw, and does it oscillate?
        own, rest, left, waves = [r for r in records if r.sheet.name == name], [], [], dict[int, np.ndarray]()
        for r in (r for r in own if r.travel[-1] > ROUNDS * length):  # the edge's periodic profile, which all share
            place = r.run.direction * (r.travel + r.run.yaw_at)
            phases = 2.0 * np.pi / length * place[:, None] * np.arange(1, BELT_HARMONICS + 1)
            waves[id(r)] = wave = np.concatenate([np.cos(phases), np.sin(phases)], axis=1)
            drift = np.linalg.qr(np.vander(r.travel / r.travel[-1], DRIFT_DEGREE + 1))[0]
            rest.append(wave - drift @ (drift.T @ wave))
            left.append(r.readings - drift @ (drift.T @ r.readings))
        edge = np.linalg.lstsq(np.concatenate(rest), np.concatenate(left), rcond=None)[0] if waves else None
        for record in own:
            run, error, s = record.run, record.drift_error, record.travel
            readings = record.readings - waves[id(record)] @ edge if id(record) in waves else record.readings
            if run.yaw == 0.0 or len(s) <= 24 or s[-1] <= GUIDED_SPANS * span or s[0] >= GUIDED_EARLY * s[-1]:
                continue
            width = max(1, len(readings) // 50)
            padded = np.pad(readings, (width // 2, width - 1 - width // 2), mode="edge")
            y = np.convolve(padded, np.full(width, 1.0 / width), mode="valid")
            if (largest := float(np.abs(y).max())) <= CLEAR_SWING * error:
                continue
            part = s / s[-1]
            early, later, late = y[part < GUIDED_EARLY], y[part > GUIDED_EARLY], y[part > 1.0 - GUIDED_LATE]
            peak = early[np.argmax(np.abs(early))]
            returns = peak * run.yaw > 0.0 and abs(peak) > CLEAR_SWING * error
            returns = returns and np.abs(late).max() < BACK * abs(peak) + error
            swing, turns, extreme, way = 0.5 * float(np.ptp(later)), 0, later[0], 0.0
            for value in later:  # each turn comes back by more than half the swing
                step = value - extreme
                if abs(step) > swing / 2.0 and step * way <= 0.0:
                    turns, extreme, way = turns + 1, value, np.sign(step)
                elif step * way > 0.0:
                    extreme = value
            stays = abs(float(np.mean(later))) <= HALTED * abs(run.yaw) * float(s[-1])
            swings = stays and swing >= max(CLEAR_SWING * error, SWING * largest) and turns >= TURNS
            judged.append((bool(returns), swings))
        returning, swinging = np.sum(judged, axis=0) >= GUIDED_MOST * len(judged) if judged else (False, False)
        if len(judged) >= FEWEST_RECORDS and (returning or swinging):
            sentence = "comes back to y = 0 against the yaw" if returning else "swings to and fro"
            sentence += " in nearly all runs: a guide seems to steer the belt; switch it off, or record"
            found.append(Suspicion(None, (name,), "guided", f"{sentence} what it does as yaw in runs.csv"))
    return found


def suspicions(campaign: Campaign) -> tuple[Suspicion, ...]:
    """Return everything that looks like a slip of the hand or a broken sensor, severity "stop" first.

    Spikes and short dropouts, and records that one check finds broken, are left out of the later checks.
    """

    def others(records: list[Record], suspected: list[Suspicion]) -> list[Record]:
        """The records that none of these suspicions concerns."""
        of = {(s.run, s.signals) for s in suspected}
        return [r for r in records if not of & {(run, s) for run in (None, r.run.name) for s in ((), (r.sheet.name,))}]

    gaps = check_gaps(campaign)
    campaign, left_out = leave_out_bad_readings(campaign)
    records = records_of(campaign)
    broken = [s for record in records for s in check_record(record)]
    found, seen = [*left_out, *broken, *gaps], dict[tuple[str, bytes], str]()
    for record in records:  # runs that hold the readings of another run
        if len(np.unique(record.readings)) < FEWEST_READINGS:
            continue
        first = seen.setdefault((record.sheet.name, record.readings.tobytes()), record.run.name)
        if first != record.run.name:
            sentence = f"has the very readings of run {first}: one of the two was copied; leave it out"
            found.append(Suspicion(record.run.name, (record.sheet.name,), "same_place", sentence))
    found += check_travel(campaign)
    sound = others(records, broken)
    found += check_noise(sound)
    sound = counted_from_yaw(others(sound, [s for s in found if s.kind == "unit_slip"]))
    shifts = check_starts(campaign, sound)
    sound = others(sound, shifts)
    found += [*shifts, *check_running_start(campaign, sound), *check_leads(campaign, sound)]
    known = [s for s in found if s.kind in ("swapped", "wrong_sign", "unit_slip")]
    for turned in check_signs(sound):  # unless a suspicion that is known explains it too
        if not any(k.run in (None, turned.run) and (not k.signals or {*turned.signals} <= {*k.signals}) for k in known):
            found.append(turned)
    found += [*check_wraps(campaign, sound), *check_places(campaign, sound)]
    width = campaign.belt.width.value
    if far := off_the_pulleys(campaign.runs, width):
        share = abs(far[0].y0 or 0.0) / width
        sentence = f"the belt stands y0 = {(far[0].y0 or 0.0) / MM:.4g} mm off the middle of the pulleys, which is"
        sentence += f" {share:.3g} times its width: y0_mm in runs.csv counts from there"
        sentence += f" (so in {len(far)} of {len(campaign.runs)} runs)" if len(far) > 1 else ""
        found.append(Suspicion(far[0].name, (), "shifted", sentence, "stop" if share > 1.0 else "look"))
    if not any(s.severity == "stop" for s in found):
        found += check_guide(campaign, sound)
    return tuple(sorted(found, key=lambda s: s.severity != "stop"))
