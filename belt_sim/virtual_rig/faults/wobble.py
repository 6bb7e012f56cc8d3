"""The tail pulley swings once a turn: yaw beta_1 cos(s/R + phase)."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class Wobble(Fault):
    id = "wobble"
    sizes = {"beta_1": Size(unit="rad", typical=1e-3, limit=1e-2)}
    lot = 6
    beta_1: float = 0.0
    phase: float = 0.0

    def yaw(self, s, line):
        return self.beta_1 * np.cos(s / line.tail_radius + self.phase)

    def scene(self, parts, case):
        """The scene counts the pulley's turn from head to tail on top, the fault along the travel."""
        phase = self.phase * float(case.settings.direction)
        return parts.with_pulley("tail", wobble=self.beta_1, wobble_phase=phase) if self.beta_1 else parts

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"phase": float(rng.uniform(0.0, 2 * np.pi))}

    @classmethod
    def shapes(cls, plan):
        return {"phase": 0.0}, {"phase": np.pi / 2}
