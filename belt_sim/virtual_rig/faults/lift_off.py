"""A belt that resists bending leaves its pulleys along a layer: the ends of its spans give way to their couples.

They do so unlike above and below. 1 is the layer of the belt's own plate stiffness; nothing of it is fitted.
"""

from dataclasses import dataclass, replace

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class LiftOff(Fault):
    id = "lift_off"
    sizes = {"strength": Size(unit="1", typical=1.0, limit=1.5)}
    fixed = True
    strength: float = 0.0

    def set(self, line):
        return replace(line, layer=line.layer + self.strength)
