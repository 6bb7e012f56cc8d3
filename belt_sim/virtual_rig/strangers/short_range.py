"""The sensors' optics flatten towards the ends of their range: tanh(c y)/c instead of y."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class ShortRange(Stranger):
    id = "short_range"
    blind = True
    sizes = {"c": Size(unit="1/m", typical=40.0, limit=2e3)}
    positive = True
    place, variable, form = "sensor_all", "y", "saturating"
    also = (("y", "power"),)
    c: float = 0.0

    def read(self, value, place, s, line):
        if not place.startswith("point_"):
            return value
        x = self.c * value
        return value * np.where(np.abs(x) > 1e-6, np.tanh(x) / np.where(np.abs(x) > 1e-6, x, 1.0), 1.0)
