"""The tail pulley follows its command through a play of +-half, from the middle of the play."""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class YawBacklash(Fault):
    id = "yaw_backlash"
    sizes = {"half": Size(unit="rad", typical=5e-5, limit=5e-4)}
    positive = True
    half: float = 0.0

    def set(self, line):
        return replace(line, yaw=np.sign(line.yaw) * np.maximum(np.abs(line.yaw) - self.half, 0.0))
