"""Shear flexibility of short, wide spans."""

from dataclasses import dataclass, replace

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class Shear(Effect):
    """K^2 = (F/EI) / (1 + n F/(G A)); n = (12 + 11 nu)/(10 + 10 nu) for a rectangle (paper eq. 8)."""

    id = "shear"
    law = "span"
    reference = "paper eq. 8; Cowper 1966 for n"
    parity = "odd"
    parameters = {
        "coefficient": Parameter(
            unit="1", meaning="shear coefficient n of the cross-section", plausible=(1.0, 1.3), scale=1.177
        )
    }
    coefficient: float = 1.177

    def span(self, span, case):
        stiffness = case.belt.shear_modulus * case.belt.area
        return replace(span, force=span.force / (1.0 + self.coefficient * span.force / stiffness))
