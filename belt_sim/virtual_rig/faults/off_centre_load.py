"""A load beside the middle of the upper span rolls it, its side y > 0 down; a belt that cannot roll does not move."""

from dataclasses import dataclass, replace

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.load import rolling


@dataclass(frozen=True, kw_only=True)
class OffCentreLoad(Fault):
    id = "off_centre_load"
    sizes = {"moment": Size(unit="N", typical=2e-3, limit=1.0)}
    lot = 25
    idle_on = ("beam_th2",)
    moment: float = 0.0

    def loads(self, line):
        return (rolling(line, True),)

    def push(self, s, line, load, free, kept):
        return -self.moment + 0 * free, kept

    def scene(self, parts, case):
        return replace(parts, roll=parts.roll - self.moment)
