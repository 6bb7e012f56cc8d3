"""Both pulleys yield under the entry moment M: dtheta/ds = -(kappa + c M)."""

from dataclasses import dataclass, replace
from typing import ClassVar

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class SoftCover(Fault):
    id = "soft_cover"
    sizes: ClassVar = {"c": Size(unit="1/(N m2)", typical=5e-6, limit=2e-4)}
    positive: ClassVar = True
    lot: ClassVar = 7
    c: float = 0.0

    def set(self, line):
        return replace(line, cover=line.cover + self.c)
