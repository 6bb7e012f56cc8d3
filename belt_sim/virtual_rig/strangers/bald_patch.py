"""The tail pulley's lagging is gone on one side of a patch: a taper that acts while the patch takes the belt up."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import TAIL, Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class BaldPatch(Stranger):
    id = "bald_patch"
    blind = True
    sizes = {"kappa": Size(unit="1/m", typical=1e-4, limit=1e-2)}
    place, variable, form = "runup_tail", "pulley_phase", "periodic"
    also = (("wave", "periodic"), ("travel", "periodic"))
    kappa: float = 0.0
    phase: float = 0.0
    narrow: float = 3.0

    def turn(self, s, line, y, kappa):
        return self.kappa * np.exp(self.narrow * (np.cos(s / line.tail_radius - self.phase) - 1)) * TAIL

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"phase": float(rng.uniform(0, 2 * np.pi)), "narrow": float(rng.uniform(1.5, 5.0))}
