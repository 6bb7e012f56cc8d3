"""Both pulleys yield under the entry moment M: dtheta/ds = -(kappa + c M)."""

from dataclasses import dataclass, replace

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class SoftCover(Fault):
    id = "soft_cover"
    sizes = {"c": Size(unit="1/(N m2)", typical=5e-6, limit=2e-4)}
    positive = True
    lot = 7
    c: float = 0.0

    def set(self, line):
        return replace(line, cover=line.cover + self.c)
