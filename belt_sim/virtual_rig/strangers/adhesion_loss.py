"""From travel ``after`` on, the belt climbs faster or slower sideways than it should by ``share``."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.strangers._courses import smooth_step


@dataclass(frozen=True, kw_only=True)
class AdhesionLoss(Fault):
    id = "adhesion_loss"
    sizes = {"share": Size(unit="1", typical=0.15, limit=2.0)}
    share: float = 0.0
    after: float = 20.0

    def slide(self, s, line):
        return 1 + self.share * smooth_step(s, self.after, 4.0)
