"""The tail pulley's axis rises by gamma towards +y."""

from dataclasses import dataclass, replace

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.faults._pulleys import with_more


@dataclass(frozen=True, kw_only=True)
class Cant(Fault):
    id = "cant"
    sizes = {"gamma": Size(unit="rad", typical=1e-3, limit=5e-3)}
    lot = 3
    gamma: float = 0.0

    def set(self, line):
        return replace(line, cant=line.cant + self.gamma)

    def scene(self, parts, case):
        return with_more(parts, "tail", cant=self.gamma)
