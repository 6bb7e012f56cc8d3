"""The steering relaxes after its step: share (1 - exp(-t/time)) of the yaw is added in time."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class YawCreep(Stranger):
    id = "yaw_creep"
    sizes = {"share": Size(unit="1", typical=0.2, limit=3.0)}
    place, variable, form = "yaw_tail", "time_since_step", "exponential"
    also = (("time_since_step", "saturating"), ("travel", "exponential"))
    share: float = 0.0
    time: float = 25.0

    def yaw(self, s, line):
        t = np.maximum(s - line.yaw_at, 0.0) / line.speed
        return self.share * line.yaw * (1 - np.exp(-t / self.time))

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"time": float(rng.uniform(0.1, 0.5) * plan.length / plan.runs[0].speed)}
