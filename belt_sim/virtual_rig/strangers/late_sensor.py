"""The sensor at point 4 shows what was there ``delay`` seconds ago."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class LateSensor(Fault):
    id = "late_sensor"
    sizes = {"delay": Size(unit="s", typical=1.5, limit=30.0)}
    positive = True
    delay: float = 0.0

    def read(self, value, place, s, line):
        if place != "point_4":
            return value
        back = self.delay * line.speed + 0 * s[0]
        lanes = [np.interp(s[:, b] - back[b], s[:, b], value[:, b]) for b in range(s.shape[1])]
        return np.stack(lanes, axis=1)
