"""On the tail pulley the belt climbs by a power of its contact angle, |alpha|^(1 + p), alike at 0.1 mrad."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class FollowPower(Stranger):
    id = "follow_power"
    blind = True
    sizes = {"p": Size(unit="1", typical=0.2, limit=1.5)}
    place, variable, form = "runup_tail", "contact_angle", "power"
    p: float = 0.0
    REFERENCE, SMALLEST = 1e-4, 1e-5  # [rad]

    def slide(self, s, line, alpha):
        size = np.sqrt(alpha[:1] ** 2 + self.SMALLEST**2) / self.REFERENCE
        return np.concatenate([size**self.p, np.ones_like(size)])
