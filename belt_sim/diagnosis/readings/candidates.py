"""Hints of the fitter about effects: cost in a march, form of the readings, and which are candidates by default."""

from collections.abc import Sequence

from belt_sim.effects.base import Effect, library

#: effects that make every step of a march slower: they are compiled in only where one of them acts
SLOW = frozenset({"weld", "wobble"})
#: effects whose second compilation is not worth a table of next runs
SLOWEST = frozenset({"weld"})
#: sensor laws that are a gain times the reading plus an offset, whatever the reading
AFFINE = frozenset({"sensor_drift", "sensor_gain", "sensor_offset"})
#: effects that look like others in most data, or have no derivative where the search begins
ONLY_WHEN_NAMED = frozenset(
    (
        *("lift_off", "run_up_points", "sensor_offset", "shear", "speed_tension", "temperature_difference"),
        *("thickness_wedge", "idler_skew_lower", "side_drag_lower", "off_centre_load_lower"),
    )
)


def default_candidates(leave_out: Sequence[str] | None = None) -> dict[str, type[Effect]]:
    """Return the library without ``leave_out`` (None: without ONLY_WHEN_NAMED), by id."""
    excluded = ONLY_WHEN_NAMED if leave_out is None else leave_out
    return {name: cls for name, cls in library().items() if name not in excluded}
