"""The cover gives way more than in proportion: both pulleys turn the belt by c kappa |kappa| more."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class SquareMoment(Stranger):
    id = "square_moment"
    blind = True
    sizes = {"c": Size(unit="m", typical=800.0, limit=2e5)}
    place, variable, form = "runup_both", "curvature", "power"
    c: float = 0.0

    def turn(self, s, line, y, kappa):
        return kappa * np.maximum(self.c * np.abs(kappa), -0.95)
