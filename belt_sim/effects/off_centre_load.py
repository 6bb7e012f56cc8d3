"""Off-centre load: what the upper span carries lies on one side."""

from dataclasses import dataclass, replace

from belt_sim.effects.base import Effect, Parameter, effect
from belt_sim.laws.influence import add_load, on_upper_span, span_fields, spread_roll


@effect
@dataclass(frozen=True, kw_only=True)
class OffCentreLoad(Effect):
    """A load of w newton per metre at the offset e rolls the span, its loaded side down: a couple w e a metre.

    A rolled span that hangs bends in its own plane, kappa = y'' + Z phi; one that does not hang feels nothing. What
    the load adds to the sag is left out.
    """

    id = "off_centre_load"
    law = "span"
    reference = "physics sheet, section 3 (strip) with a rolling couple; makers' guides: off-centre loading"
    parity = "even"
    hanging = True
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
