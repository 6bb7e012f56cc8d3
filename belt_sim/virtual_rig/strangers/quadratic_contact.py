"""The tail pulley turns the belt by c y^2 per metre."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import TAIL, Fault, Size


@dataclass(frozen=True, kw_only=True)
class QuadraticContact(Fault):
    id = "quadratic_contact"
    sizes = {"c": Size(unit="1/m3", typical=0.05, limit=50.0)}
    c: float = 0.0

    def turn(self, s, line, y, kappa):
        return self.c * y**2 * TAIL
