"""The words of a discovered law beside those in which the generator describes what it hid.

Neither was written with the other in sight; a law is right when one of its pairs of variable and form is the
generator's.
"""

from collections.abc import Mapping
from typing import Any

#: how the finder begins a place's name -> how the generator does
_PLACES = {"yaw": "yaw", "turn": "runup", "drift": "runup", "shift": "wrap", "twist": "wrap", "sensor": "sensor"}
_VARIABLES = {"beta": "yaw", "y": "y", "shown": "y", "rate": "y", "alpha": "contact_angle", "kappa": "curvature"}
_SHAPES = {
    "x": "linear",
    "x|x|": "power",
    "x^2": "power",
    "x^3": "power",
    "saturated": "saturating",
    "beyond": "threshold",
}
#: course in travel -> forms that it may be called
_COURSES = {
    "travel": ("linear",),
    "root": ("power", "saturating", "exponential"),
    "rise": ("exponential", "saturating"),
    "fade": ("exponential",),
    "after": ("threshold", "saturating"),
    "wave": ("periodic",),
}
_ALONG = ("travel", "time_since_step")
_WAVES = ("wave", "belt_phase", "pulley_phase", "travel")


def place_right(truth: Mapping[str, Any], law: Mapping[str, Any]) -> bool:
    """Whether the place is that of the generator; one sensor of many is a sensor."""
    said = {law["place"], *law.get("places_alike", ())}
    return bool({place_said(name) for name in said} & {truth["place"], *_same(truth["place"])})


def _same(place: str) -> tuple[str, ...]:
    """Other names of a place: the generator counts sensors, the finder names them."""
    return ("sensor",) if place.startswith("sensor_") and place != "sensor_all" else ()


def place_said(name: str) -> str:
    """A place of the finder in the generator's words."""
    kind, _, where = name.partition("_")
    if kind not in _PLACES:
        return name
    if kind in ("shift", "twist"):
        return "wrap"
    if kind == "sensor" and where != "all":
        return "sensor"
    return f"{_PLACES[kind]}_{where}"


def law_right(truth: Mapping[str, Any], law: Mapping[str, Any]) -> bool:
    """Whether one of the pairs (variable, form) that the law can be called by is one of the generator's."""
    true = {(truth["variable"], truth["form"]), *(tuple(pair) for pair in truth.get("also", ()))}
    said = [law, *law.get("laws_alike", ())]
    return bool({pair for one in said for pair in pairs(one)} & true)


def pairs(law: Mapping[str, Any]) -> set[tuple[str, str]]:
    """(variable, form) of a law {variable, shape, course} in the generator's words."""
    variable, course = law["variable"], law.get("course", "always").rstrip("'")
    forms = _COURSES.get(course, ())
    along = _WAVES if course == "wave" else _ALONG
    found = {(v, f) for v in along for f in forms}
    if variable in _VARIABLES:
        found |= {(_VARIABLES[variable], f) for f in (_SHAPES.get(law.get("shape", "x"), ""), *forms) if f}
    elif not forms:
        found.add(("travel", "constant"))
    return found
