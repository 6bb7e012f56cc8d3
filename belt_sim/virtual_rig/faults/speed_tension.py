"""Centrifugal tension: the spans feel sigma - share rho v^2."""

from dataclasses import dataclass, replace

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class SpeedTension(Fault):
    id = "speed_tension"
    sizes = {"share": Size(unit="1", typical=1.0, limit=1.5)}
    positive = True
    share: float = 0.0

    def set(self, line):
        return replace(line, stress=line.stress - self.share * line.density * line.speed**2)
