"""The belt wears a rut into the tail pulley: it is turned as it lay there one revolution of the belt ago."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import TAIL, Size
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class Rut(Stranger):
    id = "rut"
    blind = True
    sizes = {"c": Size(unit="1/m2", typical=1e-2, limit=1.0)}
    place, variable, form = "runup_tail", "y", "linear"
    also = (("belt_phase", "linear"), ("belt_phase", "periodic"))
    c: float = 0.0

    def recall(self, s, past):
        return self.c * past.at(s - past.line.belt_length, 0, 1) * TAIL
