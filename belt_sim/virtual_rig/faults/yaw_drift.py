"""The machine warms up: the tail pulley turns by rate tau (1 - exp(-t/tau)), t the time since travel 0."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.faults._warming import SLOWEST, time_by_lot, times, warmed


@dataclass(frozen=True, kw_only=True)
class YawDrift(Fault):
    id = "yaw_drift"
    sizes = {"rate": Size(unit="rad/s", typical=1e-6, limit=1e-4)}
    lot = 16
    rate: float = 0.0
    time_constant: float = SLOWEST

    def yaw(self, s, line):
        return self.rate * warmed(s, line, self.time_constant)

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return time_by_lot(plan, rng)

    @classmethod
    def shapes(cls, plan):
        return times(plan)
