"""Sensor effects have one parameter a measuring point."""

from belt_sim.effects.base import Parameter


def at_points(letter: str, **kwargs) -> dict[str, Parameter]:
    """Parameters letter1..letter4 for sensors at points 1-4."""
    meaning = kwargs.pop("meaning")
    return {f"{letter}{k}": Parameter(meaning=f"{meaning} at point {k}", **kwargs) for k in (1, 2, 3, 4)}
