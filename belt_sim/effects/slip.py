"""Finite friction: the entry moment that a pulley can hold is limited."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Effect, Parameter, effect

LENGTH = 0.06  # [m] of travel over which an excess decays: short beside a span, long enough for the march's step


@effect
@dataclass(frozen=True, kw_only=True)
class Slip(Effect):
    """The entry moment is capped near mu F b/2; what exceeds it turns the belt on the pulley.

    Given as 1/mu, so that 0 is perfect sticking. The excess decays within LENGTH of travel.
    """

    id = "slip"
    law = "run-up"
    reference = "physics sheet, sections 5 and 7"
    parity = "odd"
    parameters = {
        "inverse_friction": Parameter(unit="1", meaning="1/mu of belt on pulley", plausible=(1.0, 20.0), scale=6.0)
    }
    inverse_friction: float = 0.0

    def runup(self, runup, now, case):
        capacity = case.tension_force * case.belt.width / 2.0
        excess = jnp.maximum(self.inverse_friction * jnp.abs(now.moment) - capacity, 0.0)
        held = jnp.where(self.inverse_friction > 0, self.inverse_friction, 1.0)
        share = jnp.sign(now.moment) * excess / held / jnp.where(now.moment == 0, 1.0, jnp.abs(now.moment))
        over = share * jnp.abs(now.kappa)
        return replace(runup, turn=runup.turn + over / (now.stiffness * LENGTH))
