"""Cant: a pulley axis that is not level."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Cause, Effect, Parameter, effect
from belt_sim.laws.runup import sag_angle


@effect
@dataclass(frozen=True, kw_only=True)
class Cant(Effect):
    """An axis raised by gamma towards +y moves the belt along the wrap, y + gamma z = const, by 2 R gamma.

    Where the span sags and meets the pulley psi before its top, gamma also turns the surface's direction
    (-gamma sin psi on the tail, + on the head pulley). Material that lay on the pulley at the start moves only
    through the rest of its wrap.
    """

    id = "cant"
    law = "wrap"
    reference = "Zhang 2011 (10.1115/1.4004975); physics sheet, section 7"
    parity = "even"
    tension_exponent = 0.0
    cause = Cause(
        "the axis of the {pulley} pulley is not level",
        ("tail", "head"),
        "Put a machinist's level on the shaft of the {pulley} pulley.",
    )
    parameters = {
        "gamma": Parameter(unit="rad", meaning="cant of the tail pulley", plausible=(-5e-3, 5e-3), scale=2e-4),
        "gamma_head": Parameter(unit="rad", meaning="cant of the head pulley", plausible=(-5e-3, 5e-3), scale=2e-4),
    }
    gamma: float = 0.0
    gamma_head: float = 0.0

    def wrap(self, runoff, state, case):
        rig = case.rig
        radius = jnp.stack([rig.tail_radius, rig.head_radius])
        turned = jnp.minimum(state.travel / radius, jnp.pi)
        gamma = jnp.stack([self.gamma, -self.gamma_head]) * state.direction
        return replace(runoff, y=runoff.y + gamma * radius * (1.0 - jnp.cos(turned)))

    def yaw(self, yaw, state, case):
        lean = jnp.sin(sag_angle(case))
        return replace(yaw, tail=yaw.tail - self.gamma * lean, head=yaw.head + self.gamma_head * lean)

    def scene(self, parts, case):
        return parts.with_pulley("tail", cant=self.gamma).with_pulley("head", cant=self.gamma_head)
