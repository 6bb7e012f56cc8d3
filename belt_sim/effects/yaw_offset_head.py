"""Zero error of the head pulley's yaw."""

from dataclasses import dataclass, replace

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class YawOffsetHead(Effect):
    """The head pulley stands at beta_h + beta_0."""

    id = "yaw_offset_head"
    law = "drive"
    reference = "physics sheet, section 7"
    parity = "even"
    tension_exponent = 0.0
    parameters = {"beta_0": Parameter(unit="rad", meaning="yaw at command zero", plausible=(-2e-3, 2e-3), scale=1e-4)}
    beta_0: float = 0.0

    def yaw(self, yaw, state, case):
        return replace(yaw, head=yaw.head + self.beta_0)

    def scene(self, parts, case):
        return parts.with_pulley("head", yaw_offset=self.beta_0)
