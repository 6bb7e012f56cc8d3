"""A film above a speed: the belt follows its contact angle in part, by 1 - loss (v - onset), on both pulleys."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class TractionLoss(Fault):
    id = "traction_loss"
    sizes = {"loss": Size(unit="s/m", typical=0.2, limit=1.0)}
    positive = True
    lot = 20
    loss: float = 0.0
    onset: float = 0.0

    def slide(self, s, line, alpha):
        return np.maximum(1 - self.loss * np.maximum(line.speed - self.onset, 0.0), 0.0)

    @classmethod
    def shape_by_lot(cls, plan, rng):
        """The film begins somewhere below the fastest run."""
        return {"onset": float(rng.uniform(0.0, 0.8) * max(run.speed for run in plan.runs))}

    @classmethod
    def shapes(cls, plan):
        return tuple({"onset": share * max(run.speed for run in plan.runs)} for share in (0.0, 0.7))
