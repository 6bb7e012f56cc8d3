"""A skewed idler pushes the upper span towards +y, and to the other side when the belt runs backwards."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.load import force_at


@dataclass(frozen=True, kw_only=True)
class IdlerSkew(Fault):
    id = "idler_skew"
    sizes = {"force": Size(unit="N", typical=0.2, limit=50.0)}
    lot = 23
    force: float = 0.0
    place: float = 0.5

    def loads(self, line):
        return (force_at(line, True, self.place),)

    def push(self, s, line, load, free, kept):
        return self.force * line.direction, kept

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"place": float(rng.uniform(0.1, 0.9))}

    @classmethod
    def shapes(cls, plan):
        return tuple({"place": place} for place in (0.15, 0.4, 0.6, 0.85))
