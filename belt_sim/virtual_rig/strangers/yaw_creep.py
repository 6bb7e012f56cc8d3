"""The steering relaxes after its step: share (1 - exp(-t/time)) of the yaw is added in time."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class YawCreep(Fault):
    id = "yaw_creep"
    sizes = {"share": Size(unit="1", typical=0.2, limit=3.0)}
    share: float = 0.0
    time: float = 25.0

    def yaw(self, s, line):
        t = np.maximum(s - line.yaw_at, 0.0) / line.speed
        return self.share * line.yaw * (1 - np.exp(-t / self.time))
