"""What faults of a pulley's shape and mounting share."""

from belt_sim.scene_parts import SceneParts


def with_more(parts: SceneParts, pulley: str, **more: float) -> SceneParts:
    """With more of a pulley's departures from a true cylinder: as on the line, those of several faults add up."""
    there = vars(getattr(parts, pulley))
    return parts.with_pulley(pulley, **{name: there[name] + value for name, value in more.items()})
