"""The tail pulley is thicker in its middle: a taper -c y."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import TAIL, Fault, Size
from belt_sim.virtual_rig.faults._pulleys import with_more


@dataclass(frozen=True, kw_only=True)
class Crown(Fault):
    id = "crown"
    sizes = {"c": Size(unit="1/m2", typical=5e-3, limit=0.5)}
    lot = 5
    c: float = 0.0

    def turn(self, s, line, y, kappa):
        return -self.c * y * TAIL

    def scene(self, parts, case):
        return with_more(parts, "tail", crown=self.c)
