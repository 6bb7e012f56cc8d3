"""From travel ``after`` on, the belt climbs faster or slower sideways than it should by ``share``."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._courses import smooth_step
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class AdhesionLoss(Stranger):
    id = "adhesion_loss"
    sizes = {"share": Size(unit="1", typical=0.15, limit=2.0)}
    place, variable, form = "runup_both", "travel", "threshold"
    also = (("travel", "saturating"), ("time_since_step", "threshold"))
    share: float = 0.0
    after: float = 20.0

    def slide(self, s, line, alpha):
        return 1 + self.share * smooth_step(s, self.after, 4.0)

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"after": float(rng.uniform(0.15, 0.5) * plan.length)}
