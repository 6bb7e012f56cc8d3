"""The sensor at point k shows y + ck in every run."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault
from belt_sim.virtual_rig.faults._points import at_point, size_at_points


@dataclass(frozen=True, kw_only=True)
class SensorOffset(Fault):
    id = "sensor_offset"
    sizes = size_at_points("c", "m", 5e-4, 2e-2)
    c1: float = 0.0
    c2: float = 0.0
    c3: float = 0.0
    c4: float = 0.0

    def read(self, value, place, s, line):
        return value + at_point(self, "c", place)
