"""The sensors' stand moves with the square root of time, as heat does."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class WarmingStand(Fault):
    id = "warming_stand"
    sizes = {"c": Size(unit="m/s^0.5", typical=3e-5, limit=2e-3)}
    c: float = 0.0

    def read(self, value, place, s, line):
        return value + self.c * np.sqrt(np.maximum(s - line.yaw_at, 0) / line.speed)
