"""A rest under the upper span sticks to the belt up to a force, then slides with it: it remembers the belt."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.load import force_at
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class StickyRest(Stranger):
    id = "sticky_rest"
    blind = True
    sizes = {"force": Size(unit="N", typical=0.5, limit=100.0)}
    positive = True
    place, variable, form = "span", "y", "saturating"
    also = (("y", "threshold"), ("y", "linear"), ("contact_angle", "threshold"), ("contact_angle", "constant"))
    force: float = 0.0
    stiffness: float = 5e3
    share: float = 0.5

    def loads(self, line):
        return (force_at(line, True, self.share),)

    def push(self, s, line, load, free, kept):
        stiffness = self.stiffness / (1 + self.stiffness * load.give)
        held = np.clip(stiffness * (free - kept), -self.force, self.force)
        return -held, free - held / stiffness

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"stiffness": float(10 ** rng.uniform(2.5, 4.5)), "share": float(rng.uniform(0.2, 0.8))}
