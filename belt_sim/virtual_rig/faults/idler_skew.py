"""A skewed idler pushes the upper span towards +y, and to the other side when the belt runs backwards."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.faults._at_a_place import AtAPlace
from belt_sim.virtual_rig.load import force_at


@dataclass(frozen=True, kw_only=True)
class IdlerSkew(AtAPlace, Fault):
    id = "idler_skew"
    sizes = {"force": Size(unit="N", typical=0.2, limit=50.0)}
    lot = 23
    force: float = 0.0
    place: float = 0.5

    def loads(self, line):
        return (force_at(line, True, self.place),)

    def push(self, s, line, load, free, kept):
        return self.force * line.direction, kept

    def scene(self, parts, case):
        force = self.force * float(case.settings.direction)
        return parts.with_push(span="upper", x=self.place * float(case.rig.centre_distance), across=force)
