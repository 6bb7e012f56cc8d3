"""Taper: a pulley that is a cone."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class Taper(Effect):
    """kappa_t = (dR/dy)/R turns the landing belt: dtheta_u/ds = -(kappa_u + kappa_t), towards the larger radius."""

    id = "taper"
    law = "run-up"
    reference = "physics sheet, section 7"
    parity = "even"
    parameters = {
        "kappa_t": Parameter(unit="1/m", meaning="taper of the tail pulley", plausible=(-1e-3, 1e-3), scale=2e-5),
        "kappa_t_head": Parameter(unit="1/m", meaning="taper of the head pulley", plausible=(-1e-3, 1e-3), scale=2e-5),
    }
    kappa_t: float = 0.0
    kappa_t_head: float = 0.0

    def runup(self, runup, state, case):
        return replace(runup, turn=runup.turn + jnp.stack([self.kappa_t, self.kappa_t_head]))

    def scene(self, parts, case):
        return parts.with_pulley("tail", taper=self.kappa_t).with_pulley("head", taper=self.kappa_t_head)
