"""The take-up slips a tooth at travel ``at``: the belt loses a share of its tension at once."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._courses import smooth_step
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class RatchetSlip(Stranger):
    id = "ratchet_slip"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.15, limit=0.6)}
    positive = True
    place, variable, form = "tension", "travel", "threshold"
    also = (("travel", "constant"), ("time_since_step", "threshold"))
    share: float = 0.0
    at: float = 15.0

    def tension(self, s, line):
        return -self.share * smooth_step(s, self.at, 1.0)

    @property
    def swing(self):
        return -self.share, 0.0

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"at": float(rng.uniform(0.15, 0.6) * plan.length)}
