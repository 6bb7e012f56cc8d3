"""The sensor at point k shows y + dk t, t since the yaw was applied."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault
from belt_sim.virtual_rig.faults._points import at_point, size_at_points


@dataclass(frozen=True, kw_only=True)
class SensorDrift(Fault):
    id = "sensor_drift"
    sizes = size_at_points("d", "m/s", 5e-6, 2e-5)
    lot = 13
    d1: float = 0.0
    d2: float = 0.0
    d3: float = 0.0
    d4: float = 0.0

    def read(self, value, place, s, line):
        return value + at_point(self, "d", place) * (s - line.yaw_at) / line.speed
