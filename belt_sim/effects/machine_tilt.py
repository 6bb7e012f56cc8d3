"""Machine tilt: a machine that leans to one side about its long axis."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Effect, Parameter, effect
from belt_sim.laws.influence import add_load, span_fields, spread_force


@effect
@dataclass(frozen=True, kw_only=True)
class MachineTilt(Effect):
    """The share ``angle`` of the belt's weight pulls both spans sideways: a side load q angle per metre towards +y.

    The spans bow towards the lower side and climb there on both pulleys alike, as a rope by q angle L / (2 F (1 +
    pi R / L)): strongest when slack. To those who lean with it the belt's weight is where it was and both pulleys are
    canted; the wraps, which friction holds, feel nothing of it.
    """

    id = "machine_tilt"
    law = "span"
    reference = "clamped span under an even side load, any textbook; physics sheet, section 3 for the hanging strip"
    parity = "even"
    tension_exponent = -1.0
    parameters = {
        "angle": Parameter(unit="rad", meaning="lean of the machine towards +y", plausible=(-0.05, 0.05), scale=1e-3)
    }
    angle: float = 0.0

    def influence(self, span, case):
        return spread_force(span, span_fields(span))

    def bend(self, bend, boundary, known, case):
        return add_load(bend, known, jnp.full(2, self.angle * case.weight_per_length))

    def scene(self, parts, case):
        return replace(parts, lean=parts.lean + self.angle)
