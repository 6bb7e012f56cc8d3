"""Wind presses on both spans, changing every 9 m: p bends a clamped span by p L^2/(12 EI) at its end."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._courses import chance
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class WindSteps(Stranger):
    id = "wind_steps"
    sizes = {"pressure": Size(unit="N/m", typical=0.03, limit=5.0)}
    positive = True
    place, variable, form = "span", "travel", "random"
    pressure: float = 0.0
    seed: int = 0

    def turn(self, s, line, y, kappa):
        gust = chance(self.seed, line.run, s / 9.0)
        return np.broadcast_to(self.pressure * gust * line.span_length**2 / (12 * line.bending), y.shape)

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"seed": int(rng.integers(2**31))}
