"""Fig. 18: a highly tensioned particle belt."""

from studies.paper.particle_belt import particle_plate
from studies.paper.plate import Plate, View

NUMBER, TITLE = 18, "High tensioned particle belt"


def plate(view: View) -> Plate:
    """The stored grid at 40 N/mm2."""
    return particle_plate(NUMBER, TITLE, "grid_40")
