"""Every lateral reading shows what was there ``delay`` seconds ago."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class SensorDelay(Fault):
    id = "sensor_delay"
    sizes = {"delay": Size(unit="s", typical=1.5, limit=5.0)}
    positive = True
    lot = 26
    delay: float = 0.0

    def seen_at(self, s, line):
        return s - self.delay * line.speed
