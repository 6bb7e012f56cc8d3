"""The feeler at point 1 sticks: it follows the belt only once it is ``half`` behind."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class StickyGauge(Stranger):
    id = "sticky_gauge"
    blind = True
    sizes = {"half": Size(unit="m", typical=1e-4, limit=1e-2)}
    positive = True
    place, variable, form = "sensor_y1", "y", "threshold"
    also = (("y", "constant"), ("y", "saturating"))
    half: float = 0.0

    def read(self, value, place, s, line):
        if place != "point_1":
            return value
        shown = np.empty_like(value)
        last = value[0]
        for k, true in enumerate(value):
            last = shown[k] = np.clip(last, true - self.half, true + self.half)
        return shown
