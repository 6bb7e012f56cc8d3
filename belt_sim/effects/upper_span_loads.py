"""Loads on the upper span: a skewed idler, a drag at one edge, a load off the centre line."""

from dataclasses import dataclass, replace

from belt_sim.case import Case
from belt_sim.effects.base import Effect, Parameter, effect
from belt_sim.laws.influence import (
    add_load,
    couple_at,
    force_at,
    on_upper_span,
    share_from_runoff,
    span_fields,
    spread_roll,
)

_PLACE = Parameter(
    unit="1",
    meaning="share of the span's length, counted from the head pulley",
    plausible=(0.1, 0.9),
    scale=0.5,
    null=0.5,
    modifier=True,
    grid=(0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9),
)


def _position(place: float, case: Case) -> float:
    """Return x [m] of a place, counted from the axis of the head pulley."""
    return place * float(case.rig.centre_distance)


@effect
@dataclass(frozen=True, kw_only=True)
class IdlerSkew(Effect):
    """A roller askew under the upper span exerts a constant side force, +y on forward travel, -y on reversed travel.

    A support with friction on one side only does the same.
    """

    id = "idler_skew"
    title = "Idler skew: a roller under the upper span that does not stand square"
    law = "span"
    reference = "clamped span under a side force, any textbook; makers' guides: skewed and seized idlers"
    parity = "even"
    tension_exponent = -1.0
    parameters = {
        "force": Parameter(
            unit="N", meaning="side force on the upper span, forward travel", plausible=(-50.0, 50.0), scale=0.1
        ),
        "place": _PLACE,
    }
    force: float = 0.0
    place: float = 0.5

    def influence(self, span, case):
        return force_at(span, share_from_runoff(self.place, case.settings.direction), span_fields(span))

    def bend(self, bend, boundary, known, case):
        direction = boundary.direction
        return add_load(bend, known, on_upper_span(self.force * direction, direction))

    def scene(self, parts, case):
        across = self.force * float(case.settings.direction)
        return parts.with_push(span="upper", x=_position(self.place, case), across=across)


@effect
@dataclass(frozen=True, kw_only=True)
class SideDrag(Effect):
    """A drag D against the travel at the edge y = b/2 turns the belt there by a couple about z, moment = D b/2.

    With x along the travel the couple turns x towards y, in either direction of travel. The change of tension by D is
    neglected.
    """

    id = "side_drag"
    title = "Side drag: a scraper or skirt that rubs on one edge of the upper span"
    law = "span"
    reference = "clamped span under a couple, any textbook; makers' guides: scrapers and skirts"
    parity = "even"
    needs = frozenset({"width"})
    parameters = {
        "moment": Parameter(
            unit="N m",
            meaning="couple of a drag at the edge y > 0 of the upper span",
            plausible=(-50.0, 50.0),
            scale=0.2,
        ),
        "place": _PLACE,
    }
    moment: float = 0.0
    place: float = 0.5

    def influence(self, span, case):
        return couple_at(span, share_from_runoff(self.place, case.settings.direction), span_fields(span))

    def bend(self, bend, boundary, known, case):
        return add_load(bend, known, on_upper_span(self.moment, boundary.direction))

    def scene(self, parts, case):
        direction, drag = float(case.settings.direction), 2.0 * abs(self.moment) / float(case.belt.width)
        x = _position(self.place, case)
        return parts.with_push(span="upper", x=x, along=-direction * drag, couple=direction * self.moment)


@effect
@dataclass(frozen=True, kw_only=True)
class OffCentreLoad(Effect):
    """A load of w newton per metre at the offset e rolls the span, its loaded side down: a couple w e a metre.

    A hanging span that rolls bends in its own plane, kappa = y'' + Z phi; a span without sag does not respond. The
    additional sag is neglected.
    """

    id = "off_centre_load"
    title = "Off-centre load: what the upper span carries lies on one side"
    law = "span"
    reference = "physics sheet, section 3 (strip) with a rolling couple; makers' guides: off-centre loading"
    parity = "even"
    needs = frozenset({"sag"})
    parameters = {
        "moment": Parameter(
            unit="N", meaning="couple per metre of the upper span, side y > 0 loaded", plausible=(-2.0, 2.0), scale=5e-3
        )
    }
    moment: float = 0.0

    def influence(self, span, case):
        return spread_roll(span, span_fields(span))

    def bend(self, bend, boundary, known, case):
        return add_load(bend, known, on_upper_span(-self.moment, boundary.direction))

    def scene(self, parts, case):
        return replace(parts, roll=parts.roll - self.moment)
