"""The words of a discovered law beside those in which the generator describes what it hid.

Neither was written with the other in sight; a law is right when one of its pairs of variable and form is the
generator's. What the answer says it cannot tell from its law counts as said.
"""

import re
from collections.abc import Mapping
from typing import Any

#: what the finder calls a place -> what the generator does; {} is tail, head or both
_PLACES = {
    "yaw of": "yaw_{}",
    "turn of the belt": "runup_{}",
    "sideways drift": "runup_{}",
    "sideways shift": "wrap",
    "twist over": "wrap",
    "bend of": "span",
    "bending stiffness": "span_bending",
    "torsional stiffness": "span_torsion",
    "tension of one span": "span_tension",
    "tension of": "tension",
    "travel that": "travel",
    "readings of all": "sensor_all",
    "reading of": "sensor",
}
_NAMES = {"span": "span", "yaw": "yaw_{}", "turn": "runup_{}", "drift": "runup_{}", "shift": "wrap", "twist": "wrap"}
_NAMES |= {"bending": "span_bending", "torsion": "span_torsion", "pull": "span_tension"}
#: sign in a formula -> variable of the generator, the first that is there
_VARIABLES = (("σ", "tension"), ("β", "yaw"), ("κ", "curvature"), ("α", "contact_angle"), ("dy/dt", "y"), ("y", "y"))
#: mark of a shape in a formula -> form
_SHAPES = (
    ("saturating", "saturating"),
    ("beyond", "threshold"),
    ("below", "threshold"),
    ("above", "threshold"),
    ("stuck", "threshold"),
    ("|", "power"),
    ("²", "power"),
    ("³", "power"),
)
#: mark of a course along the travel -> forms that it may be called, the first that is there
_COURSES = (
    ("once a revolution", ("periodic",)),
    ("that fades", ("periodic", "exponential")),
    ("a wave of", ("periodic",)),
    ("a step", ("threshold", "constant")),
    ("(1 − exp(", ("exponential", "saturating")),
    ("exp(", ("exponential",)),
    ("after ", ("threshold", "saturating")),
    ("s²", ("power",)),
    ("√s", ("power", "saturating", "exponential")),
)
_TRAVEL = re.compile(r"(^|[ )])s$")
#: travel since the yaw was set, or time: courses all the same
_CLOCK = re.compile(r"(?<![a-z])[st]′|(?<![a-z])t(?=[²/]|$)")
#: What pushes sideways at a span acts on the march through the curvature at its run-up and nowhere else, so that these
#: places are the same to readings of y
SPAN = {"runup_tail", "runup_head", "runup_both"}
_WAVES = ("wave", "belt_phase", "pulley_phase", "travel")
SURE = 2.0  # sigma
_ALONG = ("travel", "time_since_step")


def place_right(truth: Mapping[str, Any], said: Mapping[str, Any]) -> bool:
    """Whether a discovery has the generator's place, as its own or among what it cannot tell from it."""
    laws = [said["law"], *said.get("rivals", ())] if said.get("law") else said.get("places", [])[:1]
    places = {name for one in laws for text in one["place"].split(" and ") for name in (generator_place(text),)}
    true = {truth["place"]}
    if truth["place"] == "span":
        true |= SPAN
    sensors = {one["place"] for one in said.get("places", ()) if one["place"].startswith("sensor_")}
    if truth["place"].startswith("sensor_") and (truth["place"] != "sensor_all" or len(sensors) == 1):
        true.add("sensor")  # the generator counts sensors, the finder calls them by their names
    return bool(places & true)


def generator_place(text: str) -> str:
    """A place of the finder, in words or by its short name, in the generator's words."""
    where = next((p for p in ("tail", "head", "both") if p in text), "tail")
    for begin, name in _PLACES.items():
        if text.startswith(begin):
            return name.format(where)
    kind, _, which = text.partition("_")
    if kind == "sensor":
        return "sensor_all" if which == "all" else "sensor"
    return _NAMES.get(kind, text).format(where)


def law_right(truth: Mapping[str, Any], said: Mapping[str, Any]) -> bool:
    """Whether one of the pairs (variable, form) that the law or its rivals can be called by is the generator's."""
    if not said.get("law"):
        return False
    true = {(truth["variable"], truth["form"]), *(tuple(pair) for pair in truth.get("also", ()))}
    formulas = [law["formula"] for law in (said["law"], *said.get("rivals", ()))]
    called = {pair for formula in formulas for term in formula.split(" and ") for pair in pairs(term)}
    if any(_steady(term) for term in said["law"]["formula"].split(" and ")):
        called |= tension_pairs(said["law"].get("exponent"))
    return bool(called & true)


def tension_pairs(exponent: Mapping[str, float] | None) -> set[tuple[str, str]]:
    """What a constant can be called that goes with a power of the tension, known within u."""
    if not exponent or abs(exponent["value"]) < SURE * exponent["u"]:
        return set()
    linear = abs(exponent["value"] - 1.0) < SURE * exponent["u"]
    return {("tension", "power")} | ({("tension", "linear")} if linear else set())


def _steady(term: str) -> bool:
    """Whether a term is a constant along every run."""
    return term.partition(" × tension^")[0].endswith("a constant")


def pairs(term: str) -> set[tuple[str, str]]:
    """(variable, form) that one term of a formula can be called by: size × shape of a variable, course × tension^n."""
    body = _CLOCK.sub("s", term.partition(" × tension^")[0].rpartition(" × ")[2])
    variable = next((name for sign, name in _VARIABLES if sign in body), "")
    course = next((forms for mark, forms in _COURSES if mark in body), ("linear",) if _TRAVEL.search(body) else ())
    found = {(v, form) for form in course for v in (_WAVES if form == "periodic" else _ALONG)}
    found |= {("time_since_step", "periodic")} if "that fades" in body else set()
    if variable:
        shape = next((form for mark, form in _SHAPES if mark in body), "linear")
        return found | {(variable, form) for form in (shape, *course)}
    return found or {("travel", "constant")}
