"""The tensioners pull unequally on both sides: the tail pulley turns in proportion to the belt's force."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.faults._pulleys import with_more


@dataclass(frozen=True, kw_only=True)
class UnequalTension(Fault):
    id = "unequal_tension"
    sizes = {"yaw_per_force": Size(unit="rad/N", typical=1e-7, limit=2e-6)}
    lot = 21
    yaw_per_force: float = 0.0

    def yaw(self, s, line):
        return self.yaw_per_force * line.force

    def scene(self, parts, case):
        force = float(case.settings.tension * case.belt.area)
        return with_more(parts, "tail", yaw_offset=self.yaw_per_force * force)
