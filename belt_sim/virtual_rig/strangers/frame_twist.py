"""The frame twists under the belt's pull more than in proportion: the head pulley turns by c (sigma/10 N/mm2)^2."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class FrameTwist(Stranger):
    id = "frame_twist"
    blind = True
    sizes = {"c": Size(unit="rad", typical=2e-5, limit=2e-3)}
    place, variable, form = "yaw_head", "tension", "power"
    also = (("tension", "linear"),)
    c: float = 0.0

    def yaw_head(self, s, line):
        return self.c * (line.stress / 1e7) ** 2
