"""Axes of the pulleys: zero errors of the yaw, play, compliance, unequal tensioners, cant."""

from dataclasses import replace

import jax.numpy as jnp

from belt_sim.case import Schedule
from belt_sim.effects.base import Cause, Effect, effect, parameter
from belt_sim.laws.runup import sag_angle


def _zero_error():
    return parameter("rad", "yaw at command zero", plausible=(-2e-3, 2e-3), scale=1e-4)


@effect
class YawOffsetTail(Effect):
    """The yaw of the tail pulley is beta + beta_0: the lines w(beta) of all tensions cross at -beta_0."""

    id = "yaw_offset_tail"
    title = "Zero error of the tail pulley's yaw"
    law = "drive"
    reference = "physics sheet, section 7"
    parity = "even"
    tension_exponent = 0.0
    cause = Cause(
        "the zero of the tail pulley's steering is off",
        ("tail",),
        "Measure the axes' distance at both sides, and set the steering's zero.",
    )
    beta_0: float = _zero_error()

    def yaw(self, yaw, state, case):
        return replace(yaw, tail=yaw.tail + self.beta_0)

    def scene(self, parts, case):
        return parts.with_pulley("tail", yaw_offset=parts.tail.yaw_offset + self.beta_0)


@effect
class YawOffsetHead(Effect):
    """The yaw of the head pulley is beta_h + beta_0."""

    id = "yaw_offset_head"
    title = "Zero error of the head pulley's yaw"
    law = "drive"
    reference = "physics sheet, section 7"
    parity = "even"
    tension_exponent = 0.0
    cause = Cause(
        "the head pulley is not square to the machine",
        ("head",),
        "Measure the axes' distance at both sides of the machine.",
    )
    beta_0: float = _zero_error()

    def yaw(self, yaw, state, case):
        return replace(yaw, head=yaw.head + self.beta_0)

    def scene(self, parts, case):
        return parts.with_pulley("head", yaw_offset=self.beta_0)


@effect
class YawBacklash(Effect):
    """The tail pulley follows its command through a play of +-half; it starts in the middle of the play."""

    id = "yaw_backlash"
    title = "Yaw backlash: play in the steering"
    law = "drive"
    reference = "physics sheet, section 7; play operator of Prandtl"
    parity = "odd"
    cause = Cause(
        "the steering of the tail pulley has play",
        ("tail",),
        "Push the steered shaft to and fro with a dial gauge on it.",
    )
    half: float = parameter("rad", "half of the play", plausible=(0.0, 5e-4), scale=5e-5)

    def settings(self, settings, case):
        yaw = settings.yaw
        stands, moved = jnp.zeros(()), []
        for wanted in jnp.cumsum(yaw.change):
            then = jnp.clip(stands, wanted - self.half, wanted + self.half)
            moved.append(then - stands)
            stands = then
        return replace(settings, yaw=Schedule(at=yaw.at, over=yaw.over, change=jnp.stack(moved)))


@effect
class YawCompliance(Effect):
    """The tail pulley stands at beta - C_m M, M the moment of both spans on it.

    M itself grows with the yaw, by D = 2 EI dkappa/dtheta_u, both spans alike; the equation is solved for the yaw.
    """

    id = "yaw_compliance"
    title = "Yaw compliance: the belt's bending moment turns the steered pulley back"
    law = "drive"
    reference = "physics sheet, section 7"
    parity = "odd"
    needs = frozenset({"moment"})
    cause = Cause(
        "the belt turns the steered pulley back",
        ("tail",),
        "Put a dial gauge on the steered bearing while the belt is tensioned and steered.",
    )
    c_m: float = parameter("rad/(N m)", "yaw per unit of moment", plausible=(0.0, 5e-5), scale=3e-6)

    def yaw(self, yaw, state, case):
        grows = 2.0 * state.bending * state.stiffness[0]
        at_rest = state.moment[0] + state.moment_runoff[1] - grows * state.turned[0]
        return replace(yaw, tail=(yaw.tail - self.c_m * at_rest) / (1.0 + self.c_m * grows))

    def scene(self, parts, case):
        return parts.with_pulley("tail", yaw_compliance=self.c_m)


@effect
class UnequalTension(Effect):
    """The tail pulley is turned by what its tensioners give way unequally: yaw = commanded + yaw_per_force F.

    At one tension it is a zero error of the yaw (yaw_offset_tail); two tensions tell them apart.
    """

    id = "unequal_tension"
    title = "Unequal tension: tensioners left and right do not pull alike"
    law = "drive"
    reference = "equilibrium of an axle on two unequal springs"
    parity = "even"
    tension_exponent = 1.0
    cause = Cause(
        "the left and the right tensioner do not pull alike",
        ("tensioner",),
        "Compare both tensioners' pressures or strokes, and free a guide that sticks.",
    )
    yaw_per_force: float = parameter(
        "rad/N", "yaw of the tail per unit of belt force", plausible=(-2e-6, 2e-6), scale=1e-7
    )

    def yaw(self, yaw, state, case):
        return replace(yaw, tail=yaw.tail + self.yaw_per_force * case.tension_force)

    def scene(self, parts, case):
        turned = self.yaw_per_force * float(case.tension_force)
        return parts.with_pulley("tail", yaw_offset=parts.tail.yaw_offset + turned)


@effect
class Cant(Effect):
    """An axis raised by gamma towards +y moves the belt along the wrap, y + gamma z = const, by 2 R gamma.

    Where the span sags and meets the pulley psi before its top, gamma also turns the surface's direction
    (-gamma sin psi on the tail, + on the head pulley). Material that lay on the pulley at the start moves only
    through the rest of its wrap.
    """

    id = "cant"
    title = "Cant: a pulley axis that is not level"
    law = "wrap"
    reference = "Zhang 2011 (10.1115/1.4004975); physics sheet, section 7"
    parity = "even"
    tension_exponent = 0.0
    cause = Cause(
        "the axis of the {pulley} pulley is not level",
        ("tail", "head"),
        "Put a machinist's level on the shaft of the {pulley} pulley.",
    )
    gamma: float = parameter("rad", "cant of the tail pulley", plausible=(-5e-3, 5e-3), scale=2e-4)
    gamma_head: float = parameter("rad", "cant of the head pulley", plausible=(-5e-3, 5e-3), scale=2e-4)

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
