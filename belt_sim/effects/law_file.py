"""A law as an entry of an effects.yaml: terms in words, numbers in SI, and what is wrong with an entry in one line."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

from belt_sim.effects.generic_law import ID, GenericLaw
from belt_sim.effects.law_terms import (
    BY_THE_BELT,
    COURSES,
    RELATIVE,
    SENSOR,
    SHAPES,
    TRAVEL,
    VARIABLES,
    WITH_WIDE,
    WITHOUT_AT,
    WITHOUT_KNEE,
    WRAPPED,
    Form,
    Law,
    LawNumber,
    Place,
    SizedLaw,
    Term,
    fixed_places,
    number_name,
)
from belt_sim.errors import InputError, finite, flag

WIDTH = 110  # columns of a comment
NUMBERS = ("size", "cos", "sin", "knee", "at", "wide", "exponent")
KEYS = ("place", "points", "variable", "shape", "course", "timed", *NUMBERS)
STEEPEST = 10.0  # exponent of the tension
POINTS = (1, 2, 3, 4)


def law_entry(effect: GenericLaw) -> dict[str, Any]:
    """Return the law of an effect with its numbers, as an entry of an effects.yaml."""
    terms = []
    for k, t in enumerate(effect.content.law.terms):
        form, place = t.form, t.place
        term: dict[str, Any] = (
            {"place": SENSOR, "points": list(place.points)} if place.points else {"place": place.name}
        )
        term["variable"] = form.variable
        if form.variable != "none":
            term["shape"] = form.shape
        term["course"] = form.course
        if form.timed:
            term["timed"] = True
        own = {n: number_name(n, k) for n in NUMBERS}
        terms.append(term | {n: float(getattr(effect, name)) for n, name in own.items() if name in effect.parameters})
    return {"id": ID, "tension": float(effect.content.tension), "terms": terms}


def law_lines(effect: GenericLaw, uncertainty: Mapping[str, float], notes: Sequence[str] = ()) -> list[str]:
    """Return the lines of an effects.yaml for a law: ``law_entry`` with words, units and uncertainties as comments."""
    entry = law_entry(effect)
    lines = [f"  - id: {ID}"]
    for note in notes:
        lines += [f"    # {line}" for line in textwrap.wrap(note, WIDTH)]
    lines += [f"    tension: {yaml_number(entry['tension'])}  # Pa, at which the sizes hold", "    terms:"]
    numbers = {n.name: n for n in effect.numbers}
    for k, (t, term) in enumerate(zip(effect.content.law.terms, entry["terms"], strict=True)):
        words = {
            "place": "" if t.place.points else t.place.words,
            "points": t.place.words,
            "variable": VARIABLES[t.form.variable][1],
            "shape": f"{SHAPES[t.form.shape][0]}, x: the variable",
            "course": COURSES[t.form.course][0] + _clock(t.form),
        }
        for name, value in term.items():
            number = numbers.get(number_name(name, k))
            comment = words.get(name, "") if number is None else _number_comment(number, uncertainty)
            text = yaml_number(value) if number else str(value).lower() if name == "timed" else str(value)
            lines.append(
                f"      {'- ' if name == 'place' else '  '}{name}: {text}{'  # ' + comment if comment else ''}"
            )
    return lines


def _clock(form: Form) -> str:
    """What s is in the formula of a course."""
    if form.is_carried or form.course == "constant":
        return ""
    since = " since the yaw was set" if form.since_yaw else ""
    return f", s: time{since} [s]" if form.timed else f", s: travel{since} [m]"


def _number_comment(n: LawNumber, uncertainty: Mapping[str, float]) -> str:
    u = uncertainty.get(n.name)
    parts = [n.unit if n.unit != "1" else "", n.meaning, f"+- {u:.2g}" if u else ""]
    return ", ".join(part for part in parts if part)


def yaml_number(value: float) -> str:
    """Return a float with every digit, as YAML 1.1 reads it back: with a point before the exponent."""
    text = repr(float(value))
    return text if "." in text or "e" not in text else text.replace("e", ".0e")


def law_of_entry(entry: Mapping[str, Any]) -> SizedLaw:
    """Return the law of an entry of an effects.yaml; raise InputError in one line for what is wrong with it."""
    _check_names(entry, ("id", "tension", "terms"), f"effects.{ID}")
    tension = _number(entry, "tension", f"effects.{ID}", "Pa")
    if tension <= 0.0:
        _refuse(f"effects.{ID}", "tension", tension, "give a tension above 0", "Pa")
    given = entry.get("terms")
    if not isinstance(given, Sequence) or isinstance(given, str) or not given:
        _refuse(f"effects.{ID}", "terms", given, "write a list of terms, each with place, variable, course and sizes")
    terms, sizes = [], list[float]()
    for k, one in enumerate(given):
        where = f"effects.{ID}.terms[{k + 1}]"
        if not isinstance(one, Mapping):
            raise InputError(where, one, "", "write a term as name: value lines, beginning with its place")
        term, own = _term_of(one, where)
        terms.append(term)
        sizes += own
    return SizedLaw(Law(tuple(terms)), tuple(sizes), tension)


def _term_of(one: Mapping[str, Any], where: str) -> tuple[Term, list[float]]:
    """The term of an entry, and its sizes."""
    _check_names(one, KEYS, where)
    place = _place_of(one, where)
    variable = _choice(one, "variable", where, _variables(place), "none")
    shape = _choice(one, "shape", where, SHAPES, "linear")
    courses = [c for c in COURSES if not c.endswith("_sine")]
    course = _choice(one, "course", where, courses, "constant")
    timed = flag(f"{where}.timed", one.get("timed", False))
    form = Form(variable, shape, course=course, timed=timed)
    _check_course(form, place, where)
    needed = ["cos", "sin"] if form.is_wave else ["size"]
    shaping = {
        "knee": shape not in WITHOUT_KNEE,
        "at": course not in WITHOUT_AT,
        "wide": course in WITH_WIDE,
        "exponent": "exponent" in one,
    }
    needed += [n for n, there in shaping.items() if there]
    for name in NUMBERS:
        if name in one and name not in needed:
            _refuse(where, name, one[name], f"a {course} of shape {shape} has no such number; leave it out")
    values = {n: _number(one, n, where) for n in needed}
    for name in ("knee", "at", "wide"):
        if values.get(name, 1.0) <= 0.0 and not (name == "at" and form.is_carried):
            _refuse(where, name, values[name], "give a number above 0")
    if abs(values.get("exponent", 0.0)) > STEEPEST:
        _refuse(where, "exponent", values["exponent"], f"give an exponent of at most {STEEPEST:g} either way")
    form = Form(variable, shape, values.get("knee"), course, values.get("at"), values.get("wide"), timed)
    sizes = [values[n] for n in ("size", "cos", "sin") if n in values]
    return Term(place, form, values.get("exponent", 0.0)), sizes


def _place_of(one: Mapping[str, Any], where: str) -> Place:
    places = fixed_places()
    name = _choice(one, "place", where, (*places, SENSOR))
    points = one.get("points")
    if name != SENSOR:
        if points is not None:
            _refuse(where, "points", points, f"only place: {SENSOR} has points")
        return places[name]
    if not isinstance(points, Sequence) or not points or any(p not in POINTS or isinstance(p, bool) for p in points):
        _refuse(where, "points", points, "give the points of the sensors, as [1, 4]")
    if len(set(points)) < len(points):
        _refuse(where, "points", points, "name each point once")
    known = {f"point {p}": p for p in points}
    return Place(SENSOR, "all" if len(known) > 1 else next(iter(known)), tuple(known.items()))


def _variables(place: Place) -> list[str]:
    """The variables that a term at a place can read."""
    if place.is_stretch:
        return ["none"]
    beyond = ("reading", "reading_rate") if place.kind == SENSOR else () if place.kind == TRAVEL else ("y", "kappa")
    at_pulleys = place.kind not in (SENSOR, TRAVEL, *RELATIVE)
    own = ("alpha",) if at_pulleys else ("kappa_mean",) if place.relative else ()
    return ["none", "yaw_set", "beta", "sigma", *beyond, *own]


def _check_course(form: Form, place: Place, where: str) -> None:
    meets = place.kind in (*BY_THE_BELT, *RELATIVE, *WRAPPED, "yaw")
    if form.is_carried and (not meets or form.timed):
        _refuse(where, "course", form.course, "a section of the belt is met at pulleys and spans, and is not timed")
    if place.is_carried and not form.is_carried:
        _refuse(where, "course", form.course, f"the belt carries {place.name}; write course: belt_section")
    if place.is_stretch and form.shape != "linear":
        _refuse(where, "shape", form.shape, f"{place.name} reads nothing that could have one; leave it out")
    if form.shape == "stick" and form.variable != "reading":
        _refuse(where, "shape", form.shape, "only the reading of a sensor sticks")


def _check_names(given: Mapping[str, Any], names: Sequence[str], where: str) -> None:
    for name in given:
        if name not in names:
            _refuse(where, str(name), given[name], f"no such entry; use {', '.join(names)}")


def _choice(one: Mapping[str, Any], name: str, where: str, choices: Any, default: str = "") -> str:
    value = one.get(name, default)
    if not isinstance(value, str) or value not in choices:
        _refuse(where, name, value if name in one else "nothing", f"use one of {', '.join(choices)}")
    return value


def _number(one: Mapping[str, Any], name: str, where: str, unit: str = "") -> float:
    given = "nothing" if one.get(name) is None else one[name]
    return finite(f"{where}.{name}", given, unit, "give a finite number (write 2.0e-5, not 2e-5)")


def _refuse(where: str, name: str, value: Any, remedy: str, unit: str = "") -> NoReturn:
    raise InputError(f"{where}.{name}", value, unit, remedy)
