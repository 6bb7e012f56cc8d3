"""What faults of one sensor each share: a parameter for every point."""

from belt_sim.virtual_rig.fault import Fault, Size


def size_at_points(letter: str, unit: str, typical: float, limit: float) -> dict[str, Size]:
    """Sizes of the parameters letter1 ... letter4 of the sensors at points 1 ... 4."""
    return {f"{letter}{k}": Size(unit=unit, typical=typical, limit=limit, place=f"point_{k}") for k in (1, 2, 3, 4)}


def at_point(fault: Fault, letter: str, place: str):
    """The parameter of the sensor at a point; none for a tilt sensor."""
    return getattr(fault, letter + place[-1]) if place.startswith("point_") else 0.0
