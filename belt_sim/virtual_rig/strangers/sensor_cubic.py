"""The sensor at point 1 shows y + c y^3."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class SensorCubic(Fault):
    id = "sensor_cubic"
    sizes = {"c": Size(unit="1/m2", typical=1000.0, limit=1e5)}
    c: float = 0.0

    def read(self, value, place, s, line):
        return value + self.c * value**3 if place == "point_1" else value
