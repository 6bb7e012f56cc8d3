"""Yaw of the pulleys: set, offset, drifting, yielding."""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size, add_to_pulley
from belt_sim.virtual_rig.time_courses import SLOWEST, Warming, warm_up


@dataclass(frozen=True, kw_only=True)
class YawOffsetTail(Fault):
    """The tail pulley stands at beta_0 when zero is commanded."""

    id = "yaw_offset_tail"
    sizes = {"beta_0": Size(unit="rad", typical=1e-4, limit=2e-3)}
    draw_order = 1
    beta_0: float = 0.0

    def set(self, line):
        return replace(line, offset_tail=line.offset_tail + self.beta_0)

    def scene(self, parts, case):
        return add_to_pulley(parts, "tail", yaw_offset=self.beta_0)


@dataclass(frozen=True, kw_only=True)
class YawOffsetHead(Fault):
    """The head pulley stands at beta_0 when zero is commanded."""

    id = "yaw_offset_head"
    sizes = {"beta_0": Size(unit="rad", typical=1e-4, limit=2e-3)}
    draw_order = 2
    beta_0: float = 0.0

    def set(self, line):
        return replace(line, offset_head=line.offset_head + self.beta_0)

    def scene(self, parts, case):
        return add_to_pulley(parts, "head", yaw_offset=self.beta_0)


@dataclass(frozen=True, kw_only=True)
class YawBacklash(Fault):
    """The tail pulley follows its command through a play of +-half, from the middle of the play."""

    id = "yaw_backlash"
    sizes = {"half": Size(unit="rad", typical=5e-5, limit=5e-4)}
    positive = True
    half: float = 0.0

    def set(self, line):
        return replace(line, yaw=np.sign(line.yaw) * np.maximum(np.abs(line.yaw) - self.half, 0.0))


@dataclass(frozen=True, kw_only=True)
class YawCompliance(Fault):
    """The tail pulley's bearings yield to the spans' end moments: yaw beta - c_m (M_1 + M_2)."""

    id = "yaw_compliance"
    sizes = {"c_m": Size(unit="rad/(N m)", typical=5e-6, limit=5e-5)}
    positive = True
    draw_order = 9
    c_m: float = 0.0

    def set(self, line):
        return replace(line, compliance=line.compliance + self.c_m)

    def scene(self, parts, case):
        return add_to_pulley(parts, "tail", yaw_compliance=self.c_m)


@dataclass(frozen=True, kw_only=True)
class YawDrift(Warming, Fault):
    """The machine warms up: the tail pulley turns by rate tau (1 - exp(-t/tau)), t the time since travel 0."""

    id = "yaw_drift"
    sizes = {"rate": Size(unit="rad/s", typical=1e-6, limit=1e-5)}
    draw_order = 16
    rate: float = 0.0
    time_constant: float = SLOWEST

    def yaw(self, s, line):
        return self.rate * warm_up(s, line, self.time_constant)


@dataclass(frozen=True, kw_only=True)
class UnequalTension(Fault):
    """The tensioners pull unequally on both sides: the tail pulley turns in proportion to the belt's force."""

    id = "unequal_tension"
    sizes = {"yaw_per_force": Size(unit="rad/N", typical=1e-7, limit=2e-6)}
    draw_order = 21
    yaw_per_force: float = 0.0

    def yaw(self, s, line):
        return self.yaw_per_force * line.force

    def scene(self, parts, case):
        force = float(case.settings.tension * case.belt.area)
        return add_to_pulley(parts, "tail", yaw_offset=self.yaw_per_force * force)
