"""Zero error of the yaw of the tail or the head pulley."""

from dataclasses import dataclass, replace

from belt_sim.effects.base import Effect, Parameter, effect

_BETA_0 = Parameter(unit="rad", meaning="yaw at command zero", plausible=(-2e-3, 2e-3), scale=1e-4)


@effect
@dataclass(frozen=True, kw_only=True)
class YawOffsetTail(Effect):
    """The yaw of the tail pulley is beta + beta_0: the lines w(beta) of all tensions cross at -beta_0."""

    id = "yaw_offset_tail"
    title = "Zero error of the tail pulley's yaw"
    law = "drive"
    reference = "physics sheet, section 7"
    parity = "even"
    tension_exponent = 0.0
    parameters = {"beta_0": _BETA_0}
    beta_0: float = 0.0

    def yaw(self, yaw, state, case):
        return replace(yaw, tail=yaw.tail + self.beta_0)

    def scene(self, parts, case):
        return parts.with_pulley("tail", yaw_offset=parts.tail.yaw_offset + self.beta_0)


@effect
@dataclass(frozen=True, kw_only=True)
class YawOffsetHead(Effect):
    """The yaw of the head pulley is beta_h + beta_0."""

    id = "yaw_offset_head"
    title = "Zero error of the head pulley's yaw"
    law = "drive"
    reference = "physics sheet, section 7"
    parity = "even"
    tension_exponent = 0.0
    parameters = {"beta_0": _BETA_0}
    beta_0: float = 0.0

    def yaw(self, yaw, state, case):
        return replace(yaw, head=yaw.head + self.beta_0)

    def scene(self, parts, case):
        return parts.with_pulley("head", yaw_offset=self.beta_0)
