"""The measuring wheel wears down while it runs: the recorder shows s + c s^2."""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class WearingWheel(Stranger):
    id = "wearing_wheel"
    blind = True
    sizes = {"c": Size(unit="1/m", typical=5e-4, limit=2e-3)}
    place, variable, form = "travel", "travel", "power"
    also = (("travel", "linear"),)
    c: float = 0.0

    def set(self, line):
        return replace(line, yaw_at=self.travelled(line.yaw_at, line))

    def travelled(self, shown, line):
        root = np.sqrt(np.maximum(1 + 4 * self.c * shown, 0.05))
        return 2 * shown / (1 + root)
