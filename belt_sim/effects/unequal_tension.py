"""Unequal tension: tensioners left and right do not pull alike."""

from dataclasses import dataclass, replace

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class UnequalTension(Effect):
    """The tail pulley is turned by what its tensioners give way unequally: yaw = commanded + yaw_per_force F.

    At one tension it is a zero error of the yaw (yaw_offset_tail); two tensions tell them apart.
    """

    id = "unequal_tension"
    law = "drive"
    reference = "equilibrium of an axle on two unequal springs"
    parity = "even"
    tension_exponent = 1.0
    parameters = {
        "yaw_per_force": Parameter(
            unit="rad/N", meaning="yaw of the tail per unit of belt force", plausible=(-2e-6, 2e-6), scale=1e-7
        )
    }
    yaw_per_force: float = 0.0

    def yaw(self, yaw, state, case):
        return replace(yaw, tail=yaw.tail + self.yaw_per_force * case.tension_force)

    def scene(self, parts, case):
        turned = self.yaw_per_force * float(case.tension_force)
        return parts.with_pulley("tail", yaw_offset=parts.tail.yaw_offset + turned)
