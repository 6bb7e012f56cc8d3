"""Yaw backlash: play in the steering."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.case import Schedule
from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class YawBacklash(Effect):
    """The tail pulley follows its command through a play of +-half; it starts in the middle of the play."""

    id = "yaw_backlash"
    law = "drive"
    reference = "physics sheet, section 7; play operator of Prandtl"
    parity = "odd"
    parameters = {"half": Parameter(unit="rad", meaning="half of the play", plausible=(0.0, 5e-4), scale=5e-5)}
    half: float = 0.0

    def settings(self, settings, case):
        yaw = settings.yaw
        stands, moved = jnp.zeros(()), []
        for wanted in jnp.cumsum(yaw.change):
            then = jnp.clip(stands, wanted - self.half, wanted + self.half)
            moved.append(then - stands)
            stands = then
        return replace(settings, yaw=Schedule(at=yaw.at, over=yaw.over, change=jnp.stack(moved)))
