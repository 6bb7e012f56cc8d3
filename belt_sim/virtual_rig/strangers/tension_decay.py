"""The belt loses ``share`` of its tension over ``length`` metres of travel."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class TensionDecay(Stranger):
    id = "tension_decay"
    sizes = {"share": Size(unit="1", typical=0.15, limit=0.6)}
    positive = True
    place, variable, form = "tension", "travel", "exponential"
    also = (("travel", "saturating"), ("time_since_step", "exponential"))
    share: float = 0.0
    length: float = 20.0

    def tension(self, s, line):
        return -self.share * (1 - np.exp(-s / self.length))

    @property
    def swing(self):
        return -self.share, 0.0

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"length": float(rng.uniform(0.15, 0.6) * plan.length)}
