"""The recorder shows (1 + e) s."""

from dataclasses import dataclass, replace

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class EncoderScale(Fault):
    id = "encoder_scale"
    sizes = {"e": Size(unit="1", typical=0.02, limit=0.1)}
    lot = 11
    e: float = 0.0

    def set(self, line):
        return replace(line, yaw_at=line.yaw_at / (1 + self.e))

    def travelled(self, shown, line):
        return shown / (1 + self.e)
