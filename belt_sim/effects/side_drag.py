"""Side drag: a scraper or skirt that rubs on one edge of the upper span."""

from dataclasses import dataclass

from belt_sim.effects._upper_span import PLACE, along_machine
from belt_sim.effects.base import Effect, Parameter, effect
from belt_sim.laws.influence import add_load, couple_at, on_upper_span, share_from_runoff, span_fields


@effect
@dataclass(frozen=True, kw_only=True)
class SideDrag(Effect):
    """A drag D against the travel at the edge y = b/2 turns the belt there by a couple about z, moment = D b/2.

    With x along the travel it turns x towards y, in either direction of travel. What D does to the tension is left out.
    """

    id = "side_drag"
    law = "span"
    reference = "clamped span under a couple, any textbook; makers' guides: scrapers and skirts"
    parity = "even"
    wide = True
    parameters = {
        "moment": Parameter(
            unit="N m",
            meaning="couple of a drag at the edge y > 0 of the upper span",
            plausible=(-50.0, 50.0),
            scale=0.2,
        ),
        "place": PLACE,
    }
    moment: float = 0.0
    place: float = 0.5

    def influence(self, span, case):
        return couple_at(span, share_from_runoff(self.place, case.settings.direction), span_fields(span))

    def bend(self, bend, boundary, known, case):
        return add_load(bend, known, on_upper_span(self.moment, boundary.direction))

    def scene(self, parts, case):
        direction, drag = float(case.settings.direction), 2.0 * abs(self.moment) / float(case.belt.width)
        x = along_machine(self.place, case)
        return parts.with_push(span="upper", x=x, along=-direction * drag, couple=direction * self.moment)
