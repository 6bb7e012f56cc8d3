"""The tail pulley's bearings yield to the spans' end moments: yaw beta - c_m (M_1 + M_2)."""

from dataclasses import dataclass, replace

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.faults._pulleys import with_more


@dataclass(frozen=True, kw_only=True)
class YawCompliance(Fault):
    id = "yaw_compliance"
    sizes = {"c_m": Size(unit="rad/(N m)", typical=5e-6, limit=5e-5)}
    positive = True
    lot = 9
    c_m: float = 0.0

    def set(self, line):
        return replace(line, compliance=line.compliance + self.c_m)

    def scene(self, parts, case):
        return with_more(parts, "tail", yaw_compliance=self.c_m)
