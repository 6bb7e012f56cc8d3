"""The tail pulley is a cone: (dR/dy)/R = kappa_t turns the stuck belt, dtheta/ds = -(kappa + kappa_t)."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import TAIL, Fault, Size
from belt_sim.virtual_rig.faults._pulleys import with_more


@dataclass(frozen=True, kw_only=True)
class Taper(Fault):
    id = "taper"
    sizes = {"kappa_t": Size(unit="1/m", typical=2e-5, limit=1e-3)}
    lot = 4
    kappa_t: float = 0.0

    def turn(self, s, line, y, kappa):
        return self.kappa_t * TAIL

    def scene(self, parts, case):
        return with_more(parts, "tail", taper=self.kappa_t)
