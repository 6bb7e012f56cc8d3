"""The tail pulley's rubber stays askew after a yaw step and recovers in time: it turns the belt meanwhile.

Fully from a yaw of ``_FULL`` on; a pulley that is set to no yaw, and errs by a microradian, sets nothing.
"""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import TAIL, Size
from belt_sim.virtual_rig.strangers._stranger import Stranger

_FULL = 1e-4  # [rad]


@dataclass(frozen=True, kw_only=True)
class LaggingSet(Stranger):
    id = "lagging_set"
    blind = True
    sizes = {"kappa": Size(unit="1/m", typical=1e-4, limit=5e-3)}
    place, variable, form = "runup_tail", "time_since_step", "exponential"
    also = (("travel", "exponential"), ("time_since_step", "saturating"))
    kappa: float = 0.0
    time: float = 20.0

    def turn(self, s, line, y, kappa):
        t = (s - line.yaw_at) / line.speed
        left = np.where(t >= 0, np.exp(-np.maximum(t, 0.0) / self.time), 0.0)
        return self.kappa * np.clip(line.yaw / _FULL, -1.0, 1.0) * left * TAIL

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"time": float(rng.uniform(0.08, 0.5) * plan.length / plan.runs[0].speed)}
