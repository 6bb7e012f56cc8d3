"""Contact of belt and pulleys: a soft cover, a film of air or water."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Cause, Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class SoftCover(Effect):
    """The edge under more tension sinks deeper and runs on a smaller radius: extra turn c M per metre of travel."""

    id = "soft_cover"
    title = "Soft cover, rolling-radius compliance: the belt turns under its own entry moment"
    law = "run-up"
    reference = "physics sheet, section 7"
    parity = "odd"
    cause = Cause(
        "a soft pulley cover gives way under one edge",
        ("tail", "head"),
        "Measure thickness and hardness of the covers.",
    )
    parameters = {
        "c": Parameter(unit="1/(N m2)", meaning="turn per metre and unit of moment", plausible=(0.0, 2e-4), scale=5e-6)
    }
    c: float = 0.0

    def runup(self, runup, state, case):
        return replace(runup, turn=runup.turn + self.c * state.moment)


@effect
@dataclass(frozen=True, kw_only=True)
class TractionLoss(Effect):
    """A belt that half floats climbs sideways by a share of its contact angle: dy/ds = -(1 - loss (v - onset)) alpha.

    Below ``onset`` nothing is lost. Rates of one tension and yaw that differ with speed and nothing else give it away.
    """

    id = "traction_loss"
    title = "Traction lost above a speed: a film of air or liquid between belt and pulley"
    law = "run-up"
    reference = "Knox and Sweeney 1971 (Ind. Eng. Chem. Process Des. Dev. 10(2) 201), air films; here linear"
    parity = "odd"
    tension_exponent = 0.0
    cause = Cause(
        "the belt floats on a film of air or liquid at speed",
        ("tail", "head"),
        "Look for water at the run-ups, and repeat a run slowly.",
    )
    parameters = {
        "loss": Parameter(unit="s/m", meaning="share lost per unit of speed", plausible=(0.0, 2.0), scale=0.1),
        "onset": Parameter(
            unit="m/s",
            meaning="speed at which it begins",
            plausible=(0.0, 20.0),
            scale=0.1,
            modifier=True,
            grid=(0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0),
        ),
    }
    loss: float = 0.0
    onset: float = 0.0

    def runup(self, runup, state, case):
        share = self.loss * jnp.maximum(case.settings.speed - self.onset, 0.0)
        return replace(runup, drift=runup.drift + share * state.alpha)
