"""Finite friction: the entry moment that a pulley can hold is limited."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class Slip(Effect):
    """The entry moment is capped near mu F b/2; what exceeds it turns the belt on the pulley.

    Given as 1/mu, so that 0 is perfect sticking.
    """

    id = "slip"
    law = "run-up"
    reference = "physics sheet, sections 5 and 7"
    parity = "odd"
    parameters = {
        "inverse_friction": Parameter(unit="1", meaning="1/mu of belt on pulley", plausible=(1.0, 20.0), scale=6.0)
    }
    inverse_friction: float = 0.0

    def slide(self, alpha, state, case):
        capacity = case.tension_force * case.belt.width / 2.0
        excess = jnp.maximum(self.inverse_friction * jnp.abs(state.moment) - capacity, 0.0)
        held = jnp.where(self.inverse_friction > 0, self.inverse_friction, 1.0)
        share = excess / held / jnp.where(state.moment == 0, 1.0, jnp.abs(state.moment))
        return alpha - share * state.kappa / state.stiffness

    def scene(self, parts, case):
        return replace(parts, friction=1.0 / self.inverse_friction) if self.inverse_friction > 0 else parts
