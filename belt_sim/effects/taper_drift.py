"""Warming up makes the steered pulley a cone."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects._warming import FOREVER, TIME_CONSTANT, warmed
from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class TaperDrift(Effect):
    """kappa_t = rate tau (1 - exp(-t/tau)) on the tail pulley: it grows thicker at its warmer end.

    One kelvin between the ends of a steel pulley of 0.2 m is a taper of 6e-5 1/m, half of what equals the paper's yaw.
    """

    id = "taper_drift"
    law = "run-up"
    reference = "physics sheet, section 7 (taper); expansion of steel 1.2e-5 1/K"
    parity = "even"
    parameters = {
        "rate": Parameter(
            unit="1/(m s)", meaning="growth of the tail's taper at first", plausible=(-5e-6, 5e-6), scale=2e-7
        ),
        "time_constant": TIME_CONSTANT,
    }
    rate: float = 0.0
    time_constant: float = FOREVER

    def runup(self, runup, state, case):
        taper = warmed(self.rate, self.time_constant, state, case)
        return replace(runup, turn=runup.turn + jnp.stack([taper, 0.0 * taper]))
