"""Signs, exchanged columns and units of the yaw, by the lead of the tail over the head, which all belts share.

After a yaw beta of the tail pulley the points at the tail lead those at the head by about beta L/2, and all points move
to the same side, whatever the belt's stiffness and tension. With w = beta L (w1 - w0)/(2 (L + pi R)) and w0 + w1 = 1,
y_1 - y_4 = L (w1 beta - w), which is beta L/2 for pi R << L. In the transient the lead is 0.5 to 2 times that.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from belt_sim.campaign.quality.record import Record, Severity, Suspicion, pairs_at
from belt_sim.campaign.types import Campaign, rig_of

#: The lead is judged once the belt has travelled this many spans.
SPANS = 1.2
#: Lead over beta L/2: below -REVERSED it is turned round; outside LOW..HIGH the yaw is of another magnitude.
#: Linear belts give 0.5 to 1.7, with a pulley offset as large as the yaw itself 0 to 3.
REVERSED, LOW, HIGH = 0.45, 0.12, 6.0
#: Leads of all runs within this ratio have one common factor.
ALIKE = 3.0
#: If a pulley offset is the reason, the runs of the other yaw sign have a lead above this.
OFFSET = 1.8
#: A lead is judged if it exceeds this many sigmas of zero, wander and white noise.
CLEAR = 6.0
#: Late slopes come from the last LATE of records longer than SETTLED spans; MOST: share of runs that must agree.
LATE, SETTLED, MOST = 0.4, 3.5, 0.8
TAIL_AND_HEAD = (("point_1", "point_4"), ("point_2", "point_3"), ("point_1", "point_3"), ("point_2", "point_4"))
_GRID = 100


@dataclass(frozen=True)
class Lead:
    """Lead and drift of one run over beta L/2 [1], from one tail and one head signal; span [m]."""

    tail: Record
    head: Record
    span: float
    lead: float
    drift: float

    @property
    def yaw(self) -> float:
        """Size of the yaw of the tail pulley [rad]."""
        return abs(self.tail.run.yaw)

    @property
    def side(self) -> float:
        """Sign of the yaw."""
        return math.copysign(1.0, self.tail.run.yaw)


def check_leads(campaign: Campaign, records: list[Record]) -> list[Suspicion]:
    """Return exchanged columns, turned signs and slipped yaw units, from the lead of the tail over the head."""
    span = float(rig_of(campaign).span_length)
    found: dict[tuple[str | None, str | None], Suspicion] = {}
    for tail, head in TAIL_AND_HEAD:
        leads = [lead for pair in pairs_at(records, tail, head) if (lead := _lead_of(*pair, span)) is not None]
        for suspicion in _judge(leads) if leads else ():
            found.setdefault((suspicion.run, suspicion.kind), suspicion)
    return list(found.values())


def _lead_of(tail: Record, head: Record, span: float) -> Lead | None:
    """Return mean lead and drift after a span; None if neither the lead nor the yaw exceeds the errors."""
    run = tail.run
    scale = run.yaw * span / 2.0
    end = min(tail.travel[-1], head.travel[-1])
    if scale == 0.0 or abs(run.yaw_head) > 0.2 * abs(run.yaw) or end < SPANS * span:
        return None
    s = np.linspace(span, end, _GRID)
    y_tail, y_head = (np.interp(s, r.travel, r.readings) for r in (tail, head))
    lead, drift = float(np.mean(y_tail - y_head)), float(np.mean(y_tail + y_head))
    clear = CLEAR * math.hypot(tail.drift_error, head.drift_error)
    if max(abs(lead), abs(scale) * LOW) < clear:
        return None
    return Lead(tail=tail, head=head, span=span, lead=lead / scale, drift=drift / scale)


def _judge(leads: list[Lead]) -> list[Suspicion]:
    """Return what is wrong by the leads of one tail over one head signal in all runs."""
    if (slip := _yaw_in_another_unit(leads)) is not None:
        return [slip]
    usual = float(np.median([lead.yaw for lead in leads]))
    odd = [lead for lead in leads if _is_odd(lead, usual)]
    if not odd:
        return _turned_column(leads)
    found = []
    for lead in odd:
        across = [other.lead for other in leads if other.side != lead.side]
        if across and lead.lead < LOW and float(np.median(across)) > OFFSET:
            continue  # the yaw offset of a pulley explains it
        certain = (len(odd) < len(leads) or bool(across)) if lead.lead < 0.0 else _fits_other_runs(lead, leads)
        found.append(_suspicion(lead, "stop" if certain else "look"))
    if len(found) == len(leads) > 1 and len({s.kind for s in found}) == 1:
        return [replace(found[0], run=None, sentence=f"in every run: {found[0].sentence}")]
    return found


def _yaw_in_another_unit(leads: list[Lead]) -> Suspicion | None:
    """Return a slipped unit of the yaw: one factor in every run, far from the lead of any belt."""
    factors = np.array([lead.lead for lead in leads])
    if len(factors) < 2 or factors.min() <= 0.0 or factors.max() > ALIKE * factors.min():
        return None
    if not (factors.min() > HIGH or factors.max() < LOW):
        return None
    sentence = f"in every run {leads[0].tail.sheet.name} and {leads[0].head.sheet.name} differ by about"
    sentence += f" {float(np.median(factors)):.2g} times what the stated yaw gives: the yaw (or the readings) is in"
    sentence += " another unit (rad or mrad written as yaw_deg?)"
    return Suspicion(None, (), "unit_slip", sentence)


def _is_odd(lead: Lead, usual: float) -> bool:
    """Return whether a lead is turned round (at a yaw larger than machine faults) or of another magnitude."""
    size = abs(lead.lead)
    turned = lead.lead < -REVERSED and lead.yaw > 0.5 * usual
    small = size * lead.yaw < LOW * usual / 2.0 or (size < LOW and lead.yaw > HIGH * usual)
    return turned or small or size > HIGH


def _fits_other_runs(lead: Lead, leads: list[Lead]) -> bool:
    """Return whether the yaw implied by the lead, but not the stated yaw, is that of the other runs."""
    others = [other.yaw for other in leads if other is not lead]
    if not others:
        return False
    usual, implied = float(np.median(others)), lead.yaw * abs(lead.lead)
    return 0.4 < implied / usual < 2.5 and not 0.2 < lead.yaw / usual < 5.0


def _turned_column(leads: list[Lead]) -> list[Suspicion]:
    """Return a column of the wrong sign: tail and head drift apart in the end in nearly all runs."""
    slopes = [slopes for lead in leads if (slopes := _late_slopes(lead)) is not None]
    apart = [(tail, head) for tail, head in slopes if abs(tail + head) < 0.5 * abs(tail - head)]
    if len(slopes) < 3 or len(apart) < MOST * len(slopes):
        return []
    against = sum(tail < 0.0 for tail, _ in apart)
    if max(against, len(apart) - against) < MOST * len(apart):
        return []  # what does not follow the yaw is no sign of a column
    turned = leads[0].tail if against > len(apart) / 2 else leads[0].head
    sentence = "drifts away from the other points to the end, in nearly all runs: the sign of this column is turned"
    both = {lead.side for lead in leads} == {1.0, -1.0}
    severity: Severity = "stop" if both and len(apart) == len(leads) else "look"
    return [Suspicion(None, (turned.sheet.name,), "wrong_sign", sentence, severity)]


def _late_slopes(lead: Lead) -> tuple[float, float] | None:
    """Return late slopes over the yaw of tail and head; None if the record is short or the slopes are not clear."""
    end = min(lead.tail.travel[-1], lead.head.travel[-1])
    if end < SETTLED * lead.span:
        return None
    s = np.linspace((1.0 - LATE) * end, end, _GRID)
    values = [np.polyfit(s, np.interp(s, r.travel, r.readings), 1)[0] for r in (lead.tail, lead.head)]
    clear = CLEAR * max(lead.tail.drift_error, lead.head.drift_error) / (LATE * end)
    if min(map(abs, values)) < clear:
        return None
    return values[0] / lead.tail.run.yaw, values[1] / lead.head.run.yaw


def _suspicion(lead: Lead, severity: Severity) -> Suspicion:
    """Describe an odd lead: slipped unit, exchanged columns or wrong sign."""
    run, names = lead.tail.run, (lead.tail.sheet.name, lead.head.sheet.name)
    times = f"{lead.lead:.2g} times what the yaw of {math.degrees(run.yaw):.3g} deg gives"
    seen = f"{' and '.join(names)} differ by {times} in the end"
    if not LOW < abs(lead.lead) < HIGH:
        sentence = f"{seen}: the yaw or the readings are in another unit"
        return Suspicion(run.name, (), "unit_slip", sentence, severity)
    if lead.drift > 0.0:
        sentence = f"{seen}, though they move to its side: the two columns are exchanged"
        return Suspicion(run.name, names, "swapped", sentence, severity)
    sentence = f"{seen}, and they move away from its side: the yaw or the readings have the wrong sign"
    return Suspicion(run.name, (), "wrong_sign", sentence, severity)
