"""The steering swings about its new position after the step, by a share of it that dies out in time."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class RingingYaw(Stranger):
    id = "ringing_yaw"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.3, limit=3.0)}
    place, variable, form = "yaw_tail", "time_since_step", "exponential"
    also = (("time_since_step", "periodic"), ("wave", "periodic"), ("travel", "exponential"))
    share: float = 0.0
    time: float = 30.0
    period: float = 20.0

    def yaw(self, s, line):
        t = np.maximum(s - line.yaw_at, 0.0) / line.speed
        return self.share * line.yaw * np.exp(-t / self.time) * np.sin(2 * np.pi * t / self.period)

    @classmethod
    def shape_by_lot(cls, plan, rng):
        lasts = plan.length / plan.runs[0].speed
        return {"time": float(rng.uniform(0.1, 0.6) * lasts), "period": float(rng.uniform(0.1, 0.4) * lasts)}
