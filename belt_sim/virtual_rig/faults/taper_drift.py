"""The tail pulley grows a taper as it warms up: kappa_t = rate tau (1 - exp(-t/tau)), t since travel 0."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import TAIL, Fault, Size
from belt_sim.virtual_rig.faults._warming import SLOWEST, Warming, warmed


@dataclass(frozen=True, kw_only=True)
class TaperDrift(Warming, Fault):
    id = "taper_drift"
    sizes = {"rate": Size(unit="1/(m s)", typical=2e-7, limit=5e-6)}
    lot = 17
    rate: float = 0.0
    time_constant: float = SLOWEST

    def turn(self, s, line, y, kappa):
        return self.rate * warmed(s, line, self.time_constant) * TAIL
