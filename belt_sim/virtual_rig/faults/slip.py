"""Both pulleys hold the belt by friction, given as 1/mu; 0 = they hold any moment.

At each change of yaw the run-ups let go once, and the run-offs let go all the time (grip.py, travel.py).
"""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class Slip(Fault):
    id = "slip"
    sizes = {"inverse_friction": Size(unit="1", typical=1 / 0.15, limit=20.0)}
    positive = True
    lot = 8
    inverse_friction: float = 0.0

    def set(self, line):
        slippery = np.broadcast_to(self.inverse_friction, line.friction.shape)
        with np.errstate(divide="ignore"):
            return replace(line, friction=np.minimum(line.friction, 1.0 / slippery))

    def scene(self, parts, case):
        held = 1 / self.inverse_friction if self.inverse_friction else np.inf
        return replace(parts, friction=min(parts.friction, held))
