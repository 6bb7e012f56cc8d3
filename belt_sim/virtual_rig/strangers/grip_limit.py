"""The belt follows its contact angle less and less, the larger it is: alpha becomes a tanh(alpha/a)."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class GripLimit(Stranger):
    id = "grip_limit"
    blind = True
    sizes = {"inverse_angle": Size(unit="1/rad", typical=2e3, limit=2e5)}
    positive = True
    place, variable, form = "runup_both", "contact_angle", "saturating"
    also = (("contact_angle", "power"),)
    inverse_angle: float = 0.0

    def slide(self, s, line, alpha):
        x = np.abs(alpha * self.inverse_angle)
        return np.where(x > 1e-6, np.tanh(x) / np.maximum(x, 1e-6), 1.0)
