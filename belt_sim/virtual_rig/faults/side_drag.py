"""A scraper drags on one edge of the upper span: a couple about the vertical, positive for the edge y > 0."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.faults._at_a_place import AtAPlace
from belt_sim.virtual_rig.load import couple_at


@dataclass(frozen=True, kw_only=True)
class SideDrag(AtAPlace, Fault):
    id = "side_drag"
    sizes = {"moment": Size(unit="N m", typical=0.5, limit=50.0)}
    lot = 24
    moment: float = 0.0
    place: float = 0.5

    def loads(self, line):
        """The drag -D t on the edge at b/2 turns y' upwards along the travel t, whichever way the belt runs."""
        return (couple_at(line, True, self.place),)

    def push(self, s, line, load, free, kept):
        return self.moment + 0 * free, kept

    def scene(self, parts, case):
        """The drag itself, against the travel at one edge: on the middle of the belt, and the couple to the edge."""
        half, travel = 0.5 * float(case.belt.width), float(case.settings.direction)
        drag = abs(self.moment) / half
        x = self.place * float(case.rig.centre_distance)
        return parts.with_push(span="upper", x=x, along=-drag * travel, couple=self.moment * travel)
