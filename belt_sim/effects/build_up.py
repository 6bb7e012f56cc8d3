"""Build-up: dirt that grows on one side of a pulley as the belt brings it."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class BuildUp(Effect):
    """The tail pulley's taper grows with the belt that has passed: kappa_t = rate s, whatever the speed."""

    id = "build_up"
    law = "run-up"
    reference = "physics sheet, section 7 (taper); makers' guides: carry-back on return pulleys"
    parity = "even"
    parameters = {
        "rate": Parameter(
            unit="1/m2", meaning="growth of the tail's taper per metre of travel", plausible=(-1e-5, 1e-5), scale=4e-7
        )
    }
    rate: float = 0.0

    def runup(self, runup, state, case):
        taper = self.rate * state.travel
        return replace(runup, turn=runup.turn + jnp.stack([taper, 0.0 * taper]))
