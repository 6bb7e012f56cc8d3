"""The belt is curved in its plane by nature; by Betti a run-up feels what its span's shape does not take up.

A span that hangs rolls as well, since it is bent.
"""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.load import bent_by_nature


@dataclass(frozen=True, kw_only=True)
class Camber(Fault):
    id = "camber"
    sizes = {"kappa_c": Size(unit="1/m", typical=2e-5, limit=1e-3)}
    lot = 27
    kappa_c: float = 0.0

    def turn(self, s, line, y, kappa):
        left = 1 - line.turning.mean(axis=1) * line.span_length
        return np.broadcast_to(self.kappa_c * left, kappa.shape)

    def loads(self, line):
        return bent_by_nature(line, True), bent_by_nature(line, False)

    def push(self, s, line, load, free, kept):
        return self.kappa_c * load.along.sum(axis=1) + 0 * free, kept

    def scene(self, parts, case):
        return parts.with_camber(lambda s: np.full(np.shape(s), self.kappa_c)) if self.kappa_c else parts
