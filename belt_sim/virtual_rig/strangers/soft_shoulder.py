"""The head pulley has shoulders: off the middle it turns the belt back by kappa at most, kappa tanh(y/y0)."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import HEAD, Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class SoftShoulder(Stranger):
    id = "soft_shoulder"
    blind = True
    sizes = {"kappa": Size(unit="1/m", typical=3e-5, limit=2e-3)}
    place, variable, form = "runup_head", "y", "saturating"
    also = (("y", "power"), ("y", "threshold"))
    kappa: float = 0.0
    width: float = 1e-3

    def turn(self, s, line, y, kappa):
        return -self.kappa * np.tanh(y / self.width) * HEAD

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"width": float(10 ** rng.uniform(-3.7, -2.5))}
