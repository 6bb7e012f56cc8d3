"""The load cell errs: true tension sigma (1 + gain) + bias."""

from dataclasses import dataclass, replace

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class TensionBias(Fault):
    id = "tension_bias"
    sizes = {
        "gain": Size(unit="1", typical=0.1, limit=0.3),
        "bias": Size(unit="Pa", typical=5e5, limit=3e6),
    }
    lot = 10
    gain: float = 0.0
    bias: float = 0.0

    def set(self, line):
        return replace(line, stress=line.stress * (1 + self.gain) + self.bias)
