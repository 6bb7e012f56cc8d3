"""A bent idler under the lower span pushes it to and fro as it turns."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.load import force_at
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class BentIdler(Stranger):
    id = "bent_idler"
    blind = True
    sizes = {"force": Size(unit="N", typical=1.0, limit=200.0)}
    place, variable, form = "span", "wave", "periodic"
    also = (("travel", "periodic"),)
    force: float = 0.0
    wavelength: float = 2.2
    phase: float = 0.0
    share: float = 0.5

    def loads(self, line):
        return (force_at(line, False, self.share),)

    def push(self, s, line, load, free, kept):
        return self.force * np.cos(2 * np.pi * s / self.wavelength + self.phase) + 0 * free, kept

    @classmethod
    def shape_by_lot(cls, plan, rng):
        drawn = {
            "wavelength": rng.uniform(1.5, 4.5),
            "phase": rng.uniform(0, 2 * np.pi),
            "share": rng.uniform(0.2, 0.8),
        }
        return {name: float(value) for name, value in drawn.items()}
