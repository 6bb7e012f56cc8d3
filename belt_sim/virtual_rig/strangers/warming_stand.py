"""The sensors' stand moves with the square root of time, as heat does."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class WarmingStand(Stranger):
    id = "warming_stand"
    sizes = {"c": Size(unit="m/s^0.5", typical=3e-5, limit=2e-3)}
    place, variable, form = "sensor_all", "time_since_step", "power"
    also = (("travel", "power"), ("time_since_step", "saturating"))
    c: float = 0.0

    def read(self, value, place, s, line):
        return value + self.c * np.sqrt(np.maximum(s - line.yaw_at, 0) / line.speed)
