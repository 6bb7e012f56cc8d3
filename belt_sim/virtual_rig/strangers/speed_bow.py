"""The frame bows under the drive: the tail pulley turns by c v^2."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class SpeedBow(Stranger):
    id = "speed_bow"
    blind = True
    sizes = {"c": Size(unit="rad s2/m2", typical=2e-4, limit=2e-2)}
    place, variable, form = "yaw_tail", "speed", "power"
    also = (("speed", "linear"),)
    c: float = 0.0

    def yaw(self, s, line):
        return self.c * line.speed**2
