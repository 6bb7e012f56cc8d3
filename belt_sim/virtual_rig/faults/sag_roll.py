"""The sagging belt tilts instead of bending in its plane: 1 makes a flat strip the strip.

The base has none of it (beam_th2) or all (strip), and the fault adds ``strength`` to that share. In the scene, where a
belt tilts because it hangs, the share is that of its weight: a belt of base beam_th2 has none until this fault.
"""

from dataclasses import dataclass, replace

from belt_sim.rig import GRAVITY
from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class SagRoll(Fault):
    id = "sag_roll"
    sizes = {"strength": Size(unit="1", typical=1.0, limit=1.5)}
    lot = 15
    fixed = True
    part_of = ("strip",)
    strength: float = 0.0

    def set(self, line):
        return replace(line, sag_roll=line.sag_roll + self.strength)

    def scene(self, parts, case):
        return replace(parts, gravity=parts.gravity + self.strength * GRAVITY)
