"""The sensor at point 1 shows y + c y^3."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class SensorCubic(Stranger):
    id = "sensor_cubic"
    sizes = {"c": Size(unit="1/m2", typical=1000.0, limit=1e5)}
    place, variable, form = "sensor_y1", "y", "power"
    c: float = 0.0

    def read(self, value, place, s, line):
        return value + self.c * value**3 if place == "point_1" else value
