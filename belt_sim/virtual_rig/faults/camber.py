"""The belt is curved in its plane by nature; by Betti a run-up feels what its span's shape does not take up."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.load import tilting


@dataclass(frozen=True, kw_only=True)
class Camber(Fault):
    id = "camber"
    sizes = {"kappa_c": Size(unit="1/m", typical=2e-5, limit=1e-3)}
    lot = 27
    kappa_c: float = 0.0

    def turn(self, s, line, y, kappa):
        left = 1 - line.turning.mean(axis=1) * line.span_length
        return np.broadcast_to(self.kappa_c * left, kappa.shape)

    def read(self, value, place, s, line):
        if not place.endswith("mid_span"):
            return value
        per_curvature = line.bending * line.span_length * tilting(line, place == "upper_mid_span").mean(axis=1)
        return value + self.kappa_c * per_curvature

    def scene(self, parts, case):
        return parts.with_camber(lambda s: np.full(np.shape(s), self.kappa_c)) if self.kappa_c else parts
