"""The tail pulley's yaw swings with a wavelength that belongs to no part of the machine."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class StrangeWave(Stranger):
    id = "strange_wave"
    sizes = {"amplitude": Size(unit="rad", typical=1e-4, limit=5e-3)}
    place, variable, form = "yaw_tail", "wave", "periodic"
    amplitude: float = 0.0
    wavelength: float = 7.3
    phase: float = 0.0

    def yaw(self, s, line):
        return self.amplitude * np.sin(2 * np.pi * s / self.wavelength + self.phase)

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"wavelength": float(rng.uniform(3.0, 9.0)), "phase": float(rng.uniform(0, 2 * np.pi))}
