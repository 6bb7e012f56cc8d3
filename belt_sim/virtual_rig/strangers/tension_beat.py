"""The tension swings by a share once a revolution of the belt, as a stiff splice goes round."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class TensionBeat(Stranger):
    id = "tension_beat"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.1, limit=0.6)}
    positive = True
    place, variable, form = "tension", "belt_phase", "periodic"
    also = (("wave", "periodic"), ("travel", "periodic"))
    share: float = 0.0
    phase: float = 0.0

    def tension(self, s, line):
        return self.share * np.cos(2 * np.pi * s / line.belt_length + self.phase)

    @property
    def swing(self):
        return -self.share, self.share

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"phase": float(rng.uniform(0, 2 * np.pi))}
