"""The head pulley stands at beta_0 when zero is commanded."""

from dataclasses import dataclass, replace

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.faults._pulleys import with_more


@dataclass(frozen=True, kw_only=True)
class YawOffsetHead(Fault):
    id = "yaw_offset_head"
    sizes = {"beta_0": Size(unit="rad", typical=1e-4, limit=2e-3)}
    lot = 2
    beta_0: float = 0.0

    def set(self, line):
        return replace(line, offset_head=line.offset_head + self.beta_0)

    def scene(self, parts, case):
        return with_more(parts, "head", yaw_offset=self.beta_0)
