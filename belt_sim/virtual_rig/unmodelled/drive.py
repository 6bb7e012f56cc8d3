"""Tension."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size, Unmodelled
from belt_sim.virtual_rig.time_courses import smooth_step


@dataclass(frozen=True, kw_only=True)
class TensionDecay(Unmodelled):
    """The belt loses ``share`` of its tension over ``length`` metres of travel."""

    id = "tension_decay"
    sizes = {"share": Size(unit="1", typical=0.15, limit=0.6)}
    positive = True
    place, variable, form = "tension", "travel", "exponential"
    also = (("travel", "saturating"), ("time_since_step", "exponential"))
    share: float = 0.0
    length: float = 20.0

    def tension(self, s, line):
        return -self.share * (1 - np.exp(-s / self.length))

    @property
    def swing(self):
        return -self.share, 0.0

    @classmethod
    def random_shape(cls, plan, rng):
        return {"length": float(rng.uniform(0.15, 0.6) * plan.length)}


@dataclass(frozen=True, kw_only=True)
class RatchetSlip(Unmodelled):
    """The take-up slips a tooth at travel ``at``: the belt loses a share of its tension at once."""

    id = "ratchet_slip"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.15, limit=0.6)}
    positive = True
    place, variable, form = "tension", "travel", "threshold"
    also = (("travel", "constant"), ("time_since_step", "threshold"))
    share: float = 0.0
    at: float = 15.0

    def tension(self, s, line):
        return -self.share * smooth_step(s, self.at, 1.0)

    @property
    def swing(self):
        return -self.share, 0.0

    @classmethod
    def random_shape(cls, plan, rng):
        return {"at": float(rng.uniform(0.15, 0.6) * plan.length)}


@dataclass(frozen=True, kw_only=True)
class TensionBeat(Unmodelled):
    """The tension swings by a share once a revolution of the belt, as a stiff splice goes round."""

    id = "tension_beat"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.1, limit=0.6)}
    positive = True
    place, variable, form = "tension", "belt_phase", "periodic"
    also = (("wave", "periodic"), ("travel", "periodic"))
    share: float = 0.0
    phase: float = 0.0

    def tension(self, s, line):
        return self.share * np.cos(2 * np.pi * (s + line.start) / line.belt_length + self.phase)

    @property
    def swing(self):
        return -self.share, self.share

    @classmethod
    def random_shape(cls, plan, rng):
        return {"phase": float(rng.uniform(0, 2 * np.pi))}
