"""Wrapped round both pulleys, the belt goes on sideways by a share of what its contact angle asks for."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class WrapCreep(Stranger):
    id = "wrap_creep"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.3, limit=5.0)}
    place, variable, form = "wrap", "contact_angle", "linear"
    share: float = 0.0

    def creep(self, s, line, alpha):
        return -self.share * np.stack([line.wrap_tail * alpha[0], line.wrap_head * alpha[1]])
