"""Tension and speed."""

from dataclasses import dataclass, replace

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class TensionBias(Fault):
    """The load cell errs: true tension sigma (1 + gain) + bias."""

    id = "tension_bias"
    sizes = {
        "gain": Size(unit="1", typical=0.1, limit=0.3),
        "bias": Size(unit="Pa", typical=5e5, limit=3e6),
    }
    draw_order = 10
    gain: float = 0.0
    bias: float = 0.0

    def set(self, line):
        return replace(line, stress=line.stress * (1 + self.gain) + self.bias)


@dataclass(frozen=True, kw_only=True)
class SpeedTension(Fault):
    """Centrifugal tension: the spans feel sigma - share rho v^2."""

    id = "speed_tension"
    sizes = {"share": Size(unit="1", typical=1.0, limit=1.5)}
    positive = True
    share: float = 0.0

    def set(self, line):
        return replace(line, stress=line.stress - self.share * line.density * line.speed**2)
