"""Two gears of nearly the same pitch turn the head pulley to and fro: its swing comes and goes."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class BeatingHead(Stranger):
    id = "beating_head"
    blind = True
    sizes = {"amplitude": Size(unit="rad", typical=1e-4, limit=5e-3)}
    place, variable, form = "yaw_head", "wave", "periodic"
    also = (("travel", "periodic"),)
    amplitude: float = 0.0
    wavelength: float = 4.0
    ratio: float = 1.15
    phase: float = 0.0

    def yaw_head(self, s, line):
        way = 2 * np.pi * s / self.wavelength
        return self.amplitude * (np.sin(way + self.phase) + np.sin(way / self.ratio))

    @classmethod
    def shape_by_lot(cls, plan, rng):
        drawn = {
            "wavelength": rng.uniform(2.5, 7.0),
            "ratio": rng.uniform(1.08, 1.3),
            "phase": rng.uniform(0, 2 * np.pi),
        }
        return {name: float(value) for name, value in drawn.items()}
