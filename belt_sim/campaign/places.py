"""Two signals and the place where each is said to be: one place must read one thing, two places two."""

from collections import defaultdict
from itertools import combinations

import numpy as np

from belt_sim.campaign.lead import TAIL_AND_HEAD, span_of
from belt_sim.campaign.nouns import Campaign
from belt_sim.campaign.record import Record
from belt_sim.campaign.suspect import Suspicion

#: Readings of one place may differ by so many sigmas (rms over a run); what a yaw moves apart must exceed so many.
ALIKE, APART = 4.0, 8.0
#: Share of beta L/2 by which tail and head differ on any belt, once it has travelled a span.
LEAST_LEAD = 0.3
FEWEST = 12


def one_place(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Signals stated at one place that read different things, and at two places that read one."""
    of_pair: dict[tuple[str, str], list[tuple[Record, Record]]] = defaultdict(list)
    of_run: dict[str, list[Record]] = defaultdict(list)
    for record in records:
        of_run[record.run.name].append(record)
    for own in of_run.values():
        for a, b in combinations(own, 2):
            if a.sheet.kind == b.sheet.kind == "lateral" and min(len(a.travel), len(b.travel)) >= FEWEST:
                of_pair[a.sheet.name, b.sheet.name].append((a, b))
    found = []
    for names, pairs in of_pair.items():
        sentence = _same(pairs) if pairs[0][0].sheet.at == pairs[0][1].sheet.at else _different(campaign, pairs)
        if sentence:
            found.append(Suspicion(run=None, signal=" and ".join(names), kind="same_place", sentence=sentence))
    return found


def _same(pairs: list[tuple[Record, Record]]) -> str:
    """Stated at one place: what two sensors there may differ by is zero, gain and noise."""
    off = [_difference(a, b) / _noise(a, b) for a, b in pairs]
    if np.median(off) < APART:
        return ""
    at = pairs[0][0].sheet.at
    return f"both are stated at {at}, but differ by {np.median(off):.0f} times their noise: one of them is elsewhere"


def _different(campaign: Campaign, pairs: list[tuple[Record, Record]]) -> str:
    """Stated at two places: equal to the last digit, or alike where a yaw must have moved tail and head apart."""
    a, b = pairs[0]
    equal = all(np.array_equal(x.readings, y.readings) and len(np.unique(x.readings)) > FEWEST for x, y in pairs)
    told = {a.sheet.at, b.sheet.at} in [set(p) for p in TAIL_AND_HEAD]
    apart = [(x, y) for x, y in pairs if told and _must_differ(campaign, x, y)]
    alike = len(apart) > 1 and all(_difference(x, y) < ALIKE * _noise(x, y) for x, y in apart)
    if not (equal or alike):
        return ""
    return (
        f"read the same, though stated at {a.sheet.at} and {b.sheet.at}: both are at one place, or a column was copied"
    )


def _must_differ(campaign: Campaign, a: Record, b: Record) -> bool:
    span = span_of(campaign)
    least = LEAST_LEAD * abs(a.run.yaw) * span / 2.0
    return min(a.travel[-1], b.travel[-1]) > 2.0 * span and least > APART * _noise(a, b)


def _difference(a: Record, b: Record) -> float:
    """Standard deviation of a - b over the run [m]; a constant is an error of zero."""
    s = a.travel[(a.travel >= b.travel[0]) & (a.travel <= b.travel[-1])]
    return float(np.std(np.interp(s, a.travel, a.readings) - np.interp(s, b.travel, b.readings)))


def _noise(a: Record, b: Record) -> float:
    """One sigma of that by the instruments [m]."""
    parts = [r.measured_noise**2 + r.sheet.white**2 + r.sheet.wander_sd**2 for r in (a, b)]
    gains = [(r.sheet.gain * float(np.std(r.readings))) ** 2 for r in (a, b)]
    return float(np.sqrt(sum(parts) + sum(gains)))
