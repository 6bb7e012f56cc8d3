"""The steering's lever turns the pulley more than in proportion: share yaw |yaw|/1 mrad is added."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class ProgressiveYaw(Stranger):
    id = "progressive_yaw"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.3, limit=5.0)}
    place, variable, form = "yaw_tail", "yaw", "power"
    also = (("yaw", "linear"),)
    share: float = 0.0

    def yaw(self, s, line):
        return self.share * line.yaw * np.abs(line.yaw) / 1e-3 * (s >= line.yaw_at)
