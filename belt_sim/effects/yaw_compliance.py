"""Yaw compliance: the belt's bending moment turns the steered pulley back."""

from dataclasses import dataclass, replace

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class YawCompliance(Effect):
    """The tail pulley stands at beta - C_m M, M the moment of both spans on it."""

    id = "yaw_compliance"
    law = "drive"
    reference = "physics sheet, section 7"
    parity = "odd"
    parameters = {
        "c_m": Parameter(unit="rad/(N m)", meaning="yaw per unit of moment", plausible=(0.0, 5e-5), scale=3e-6)
    }
    c_m: float = 0.0

    def yaw(self, yaw, now, case):
        return replace(yaw, tail=yaw.tail - self.c_m * (now.moment[0] + now.moment_runoff[1]))
