"""Yaw compliance: the belt's bending moment turns the steered pulley back."""

from dataclasses import dataclass, replace

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class YawCompliance(Effect):
    """The tail pulley stands at beta - C_m M, M the moment of both spans on it.

    M itself grows with the yaw, by D = 2 EI dkappa/dtheta_u, both spans alike; the equation is solved for the yaw.
    """

    id = "yaw_compliance"
    law = "drive"
    reference = "physics sheet, section 7"
    parity = "odd"
    needs = frozenset({"moment"})
    parameters = {
        "c_m": Parameter(unit="rad/(N m)", meaning="yaw per unit of moment", plausible=(0.0, 5e-5), scale=3e-6)
    }
    c_m: float = 0.0

    def yaw(self, yaw, state, case):
        grows = 2.0 * state.bending * state.stiffness[0]
        at_rest = state.moment[0] + state.moment_runoff[1] - grows * state.turned[0]
        return replace(yaw, tail=(yaw.tail - self.c_m * at_rest) / (1.0 + self.c_m * grows))

    def scene(self, parts, case):
        return parts.with_pulley("tail", yaw_compliance=self.c_m)
