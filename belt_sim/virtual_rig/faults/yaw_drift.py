"""The machine warms up: the tail pulley turns by rate tau (1 - exp(-t/tau)), t the time since travel 0."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.faults._warming import SLOWEST, Warming, warmed


@dataclass(frozen=True, kw_only=True)
class YawDrift(Warming, Fault):
    id = "yaw_drift"
    sizes = {"rate": Size(unit="rad/s", typical=1e-6, limit=1e-5)}
    lot = 16
    rate: float = 0.0
    time_constant: float = SLOWEST

    def yaw(self, s, line):
        return self.rate * warmed(s, line, self.time_constant)
