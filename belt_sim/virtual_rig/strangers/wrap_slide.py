"""On the tail pulley a belt that lies too much askew slides on: by ``length`` times the angle beyond a limit."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class WrapSlide(Stranger):
    id = "wrap_slide"
    blind = True
    sizes = {"length": Size(unit="m", typical=0.5, limit=5.0)}
    positive = True
    place, variable, form = "wrap", "contact_angle", "threshold"
    also = (("contact_angle", "linear"),)
    length: float = 0.0
    limit: float = 1e-4

    def creep(self, s, line, alpha):
        beyond = np.sign(alpha[:1]) * np.maximum(np.abs(alpha[:1]) - self.limit, 0.0)
        return np.concatenate([-self.length * beyond, np.zeros_like(beyond)])

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"limit": float(rng.uniform(0.1, 0.4) * max(abs(run.yaw) for run in plan.runs))}
