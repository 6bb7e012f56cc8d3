"""A stretch of the belt is greasy: while it runs up on a pulley, the belt follows its contact angle less."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class GreasyStretch(Stranger):
    id = "greasy_stretch"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.3, limit=1.0)}
    positive = True
    place, variable, form = "runup_both", "belt_phase", "periodic"
    also = (("belt_phase", "threshold"), ("wave", "periodic"))
    share: float = 0.0
    at: float = 0.3
    stretch: float = 0.3

    def slide(self, s, line, alpha):
        """at, stretch: shares of the belt's length, from what runs up to the tail pulley at travel 0, backwards."""
        run = np.stack([s / line.belt_length, (s - line.span_length - line.wrap_tail) / line.belt_length])
        off = np.mod(run - self.at + 0.5, 1.0) - 0.5
        return 1 - self.share * np.where(np.abs(off) < self.stretch / 2, np.cos(np.pi * off / self.stretch) ** 2, 0.0)

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"at": float(rng.uniform(0.0, 1.0)), "stretch": float(rng.uniform(0.15, 0.5))}
