"""Idler skew: a roller under the upper span that does not stand square."""

from dataclasses import dataclass

from belt_sim.effects._upper_span import PLACE, along_machine
from belt_sim.effects.base import Effect, Parameter, effect
from belt_sim.laws.influence import add_load, force_at, on_upper_span, share_from_runoff, span_fields


@effect
@dataclass(frozen=True, kw_only=True)
class IdlerSkew(Effect):
    """A roller that points aside rubs the belt its own way: a constant side force, +y on forward travel.

    On reversed travel it rubs the other way. A support with friction on one side only does the same.
    """

    id = "idler_skew"
    law = "span"
    reference = "clamped span under a side force, any textbook; makers' guides: skewed and seized idlers"
    parity = "even"
    tension_exponent = -1.0
    parameters = {
        "force": Parameter(
            unit="N", meaning="side force on the upper span, forward travel", plausible=(-50.0, 50.0), scale=0.1
        ),
        "place": PLACE,
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
        return parts.with_push(span="upper", x=along_machine(self.place, case), across=across)
