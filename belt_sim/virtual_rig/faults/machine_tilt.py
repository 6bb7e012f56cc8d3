"""The machine leans about its long axis: a share of the belt's weight, q angle, pulls both spans towards +y."""

from dataclasses import dataclass, replace

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.load import along_span


@dataclass(frozen=True, kw_only=True)
class MachineTilt(Fault):
    id = "machine_tilt"
    sizes = {"angle": Size(unit="rad", typical=2e-3, limit=0.05)}
    lot = 22
    angle: float = 0.0

    def loads(self, line):
        return along_span(line, True), along_span(line, False)

    def push(self, s, line, load, free, kept):
        weight = line.density * line.gravity * line.width * line.thickness
        return self.angle * weight, kept

    def scene(self, parts, case):
        return replace(parts, lean=parts.lean + self.angle)
