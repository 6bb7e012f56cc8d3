"""Curvature below kappa_d does not turn the belt on the pulley."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class DeadZone(Stranger):
    id = "dead_zone"
    sizes = {"kappa_d": Size(unit="1/m", typical=1e-5, limit=5e-4)}
    positive = True
    place, variable, form = "runup_both", "curvature", "threshold"
    also = (("curvature", "saturating"),)
    kappa_d: float = 0.0

    def turn(self, s, line, y, kappa):
        return -np.clip(kappa, -self.kappa_d, self.kappa_d)
