"""Sag-roll coupling: a hanging belt relieves its in-plane bending by tilting."""

from dataclasses import dataclass, replace

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class SagRoll(Effect):
    """Adds kappa = y'' + phi Z to a beam of second order; strength multiplies Z = q/F (1 = the full strip law)."""

    id = "sag_roll"
    law = "span"
    reference = "physics sheet, section 3 (strip); edge ropes of Ritzinger 1997 and Ernst 1965 describe the same sag"
    parity = "odd"
    parameters = {
        "strength": Parameter(
            unit="1", meaning="share of the sag curvature q/F that couples", plausible=(0.5, 1.5), scale=1.0
        )
    }
    strength: float = 1.0

    def span(self, span, case):
        return replace(span, sag_curvature=span.sag_curvature + self.strength * case.sag_curvature)
