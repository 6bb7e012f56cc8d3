"""The sagging belt tilts instead of bending in its plane: share of the coupling; 1 makes a flat strip the strip."""

from dataclasses import dataclass, replace
from typing import ClassVar

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class SagRoll(Fault):
    id = "sag_roll"
    sizes: ClassVar = {"strength": Size(unit="1", typical=1.0, limit=1.5)}
    lot: ClassVar = 15
    fixed: ClassVar = True
    part_of: ClassVar = ("strip",)
    strength: float = 0.0

    def set(self, line):
        return replace(line, sag_roll=line.sag_roll + self.strength)
