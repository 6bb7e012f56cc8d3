"""In mid run the belt runs straight for a while, sideways held by ``share``."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Size
from belt_sim.virtual_rig.strangers._courses import smooth_step
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class MidStick(Stranger):
    id = "mid_stick"
    sizes = {"share": Size(unit="1", typical=0.5, limit=1.0)}
    positive = True
    place, variable, form = "runup_both", "travel", "threshold"
    also = (("time_since_step", "threshold"),)
    share: float = 0.0
    begin: float = 25.0
    length: float = 6.0

    def slide(self, s, line, alpha):
        return 1 - self.share * smooth_step(s, self.begin, 1) * (1 - smooth_step(s, self.begin + self.length, 1))

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {
            "begin": float(rng.uniform(0.15, 0.6) * plan.length),
            "length": float(rng.uniform(0.1, 0.25) * plan.length),
        }
