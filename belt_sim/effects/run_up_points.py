"""Real positions of the run-up and run-off points of a sagging span."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import CHECK_MODEL, Cause, Effect, Parameter, effect
from belt_sim.laws.runup import sag_angle


@effect
@dataclass(frozen=True, kw_only=True)
class RunUpPoints(Effect):
    """The span meets the pulley psi = q L/(2 F) before its top: yaw beta cos(psi), roll beta sin(psi) at the tail and
    -beta_h sin(psi) at the head pulley, where the span slopes the other way."""

    id = "run_up_points"
    law = "drive"
    reference = "paper Fig. 10; physics sheet, section 6"
    parity = "odd"
    cause = Cause("a sagging span meets its pulley before the top", ("tail", "head"), CHECK_MODEL, of_model=True)
    parameters = {"share": Parameter(unit="1", meaning="share of psi that counts", plausible=(0.5, 1.5), scale=1.0)}
    share: float = 1.0

    def yaw(self, yaw, state, case):
        psi = self.share * sag_angle(case)
        roll = jnp.sin(psi) * jnp.stack([yaw.tail, -yaw.head])
        turned = replace(yaw, tail=yaw.tail * jnp.cos(psi), head=yaw.head * jnp.cos(psi))
        return replace(turned, roll_runup=yaw.roll_runup + roll, roll_runoff=yaw.roll_runoff + roll[::-1])
