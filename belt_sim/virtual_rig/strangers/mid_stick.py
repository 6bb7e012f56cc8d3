"""In mid run the belt runs straight for a while, sideways held by ``share``."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.strangers._courses import smooth_step


@dataclass(frozen=True, kw_only=True)
class MidStick(Fault):
    id = "mid_stick"
    sizes = {"share": Size(unit="1", typical=0.5, limit=1.0)}
    positive = True
    share: float = 0.0
    begin: float = 25.0
    length: float = 6.0

    def slide(self, s, line):
        return 1 - self.share * smooth_step(s, self.begin, 1) * (1 - smooth_step(s, self.begin + self.length, 1))
