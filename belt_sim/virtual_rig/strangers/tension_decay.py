"""The belt loses ``share`` of its tension over ``length`` metres of travel."""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class TensionDecay(Fault):
    id = "tension_decay"
    sizes = {"share": Size(unit="1", typical=0.15, limit=0.6)}
    positive = True
    share: float = 0.0
    length: float = 20.0

    def set(self, line):
        both = np.broadcast_to(self.share, line.decay.shape), np.broadcast_to(self.length, line.decay.shape)
        return replace(line, decay=both[0], decay_length=both[1])
