"""What acts at one place of the upper span."""

from belt_sim.case import Case
from belt_sim.effects.base import Parameter

PLACE = Parameter(
    unit="1",
    meaning="share of the span's length, counted from the head pulley",
    plausible=(0.1, 0.9),
    scale=0.5,
    null=0.5,
    modifier=True,
    grid=(0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9),
)


def along_machine(place: float, case: Case) -> float:
    """x [m] of a place, where the belt leaves and meets the pulleys above their axes."""
    return place * float(case.rig.centre_distance)
