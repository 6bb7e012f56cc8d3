"""Wind presses on both spans, changing every 9 m: p bends a clamped span by p L^2/(12 EI) at its end."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.strangers._courses import chance


@dataclass(frozen=True, kw_only=True)
class WindSteps(Fault):
    id = "wind_steps"
    sizes = {"pressure": Size(unit="N/m", typical=0.03, limit=5.0)}
    positive = True
    pressure: float = 0.0
    seed: int = 0

    def turn(self, s, line, y, kappa):
        gust = chance(self.seed, line.run, s / 9.0)
        return np.broadcast_to(self.pressure * gust * line.span_length**2 / (12 * line.bending), y.shape)
