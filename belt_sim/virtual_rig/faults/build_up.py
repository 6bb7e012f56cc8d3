"""Dirt grows on one side of the tail pulley with the travel: a taper kappa_t = rate s."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import TAIL, Fault, Size


@dataclass(frozen=True, kw_only=True)
class BuildUp(Fault):
    id = "build_up"
    sizes = {"rate": Size(unit="1/m2", typical=5e-7, limit=1e-5)}
    lot = 18
    rate: float = 0.0

    def turn(self, s, line, y, kappa):
        return self.rate * s * TAIL
