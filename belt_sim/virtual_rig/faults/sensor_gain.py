"""The sensor at point k shows (1 + gk) y."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault
from belt_sim.virtual_rig.faults._points import at_point, size_at_points


@dataclass(frozen=True, kw_only=True)
class SensorGain(Fault):
    id = "sensor_gain"
    sizes = size_at_points("g", "1", 0.05, 0.3)
    lot = 12
    g1: float = 0.0
    g2: float = 0.0
    g3: float = 0.0
    g4: float = 0.0

    def read(self, value, place, s, line):
        return value * (1 + at_point(self, "g", place))
