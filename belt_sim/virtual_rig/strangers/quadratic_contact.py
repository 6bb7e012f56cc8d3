"""The tail pulley turns the belt by c y^2 per metre."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import TAIL, Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class QuadraticContact(Stranger):
    id = "quadratic_contact"
    sizes = {"c": Size(unit="1/m3", typical=0.05, limit=50.0)}
    place, variable, form = "runup_tail", "y", "power"
    c: float = 0.0

    def turn(self, s, line, y, kappa):
        return self.c * y**2 * TAIL
