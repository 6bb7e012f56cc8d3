"""Fig. 20: a low tensioned particle belt, and its moving diagram."""

from studies.paper.particle_belt import particle_plate
from studies.paper.plate import Plate, View

NUMBER, TITLE = 20, "Low tensioned particle belt"


def plate(view: View) -> Plate:
    """The stored grid at 10 N/mm2."""
    remark = " The ripples are waves along the spans at that instant; particles nearer to each other were not run."
    return particle_plate(NUMBER, TITLE, "grid_10", remark)
