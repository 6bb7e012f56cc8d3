"""A law found in data as an effect, whose terms say which hooks it has, and as an entry of an effects.yaml."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, make_dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar, NoReturn

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.effects.base import Effect, Parameter, effect
from belt_sim.effects.law import (
    BY_THE_BELT,
    COURSES,
    EXTERNAL_VARIABLES,
    LAW_PLACES,
    PLACE_KINDS,
    PULLEYS,
    RELATIVE,
    SHAPES,
    SPAN_NAMES,
    VARIABLES,
    WRAPPED,
    Form,
    Law,
    Place,
    SizedLaw,
    Term,
    number_name,
)  # fmt: skip
from belt_sim.effects.span import add_natural
from belt_sim.errors import InputError, finite, flag
from belt_sim.line.runup import add, angle_at
from belt_sim.line.span import log_of_change, response, response_by_change, stretch_adds, stretch_ends, stretch_response

ID = "generic_law"
CLASSES = 256  # of effects that a process keeps
RATE_REACH = 0.25  # [m] of travel either way, over which a reading is differentiated


class GenericLaw(Effect):
    """Base of the effects that ``law_effect`` makes. content: the law, whose numbers are the parameters."""

    reference: ClassVar[str] = "found in data"
    content: ClassVar[SizedLaw]

    def terms(self, *kinds: str) -> list[tuple[int, Term]]:
        """Return the terms at places of these kinds, with their positions in the law."""
        return [(k, t) for k, t in enumerate(self.content.law.terms) if t.place.kind in kinds]

    def number(self, name: str, k: int) -> Any:
        """Return a number of the k-th term; None where it has none."""
        return getattr(self, number_name(name, k), None)

    def strength(self, k: int, x: Any, travel: Any, case: Any, pulley: int | slice | None = slice(None)) -> Any:
        """Return what the k-th term adds where its variable is x; pulley: which is run up, for what the belt carries;
        x None: of a variable that does not depend on where the belt runs."""
        form = self.content.law.terms[k].form
        knee, at, wide = (self.number(n, k) for n in ("knee", "at", "wide"))
        s = jnp.maximum(travel - case.settings.yaw.at[0], 0.0) if form.since_yaw else travel
        s = _belt_part(case, travel)[pulley] if form.is_carried else s / case.settings.speed if form.timed else s
        if x is None:  # a variable that does not depend on where the belt runs
            settings = case.settings
            x = 1.0 if form.variable == "none" else settings.tension
            if form.variable == "yaw_set":
                x = jnp.where(travel >= settings.yaw.at[0], 1.0, 0.0)
            elif form.variable == "beta":
                yaw = jax.vmap(angle_at, (None, 0)) if jnp.ndim(travel) else angle_at
                x = yaw(settings.yaw, travel) + yaw(settings.yaw_head, travel)
        tension = case.settings.tension / self.content.tension
        along = sum(self.number(n, k) * half.course_value(s, jnp, at, wide) for n, half in form.halves.items())
        return along * form.shape_value(x, s, jnp, knee) * tension ** self.number("exponent", k)

    def waves(self, case):
        found = {}
        for k, t in self.terms(*(kind for kind, x in PLACE_KINDS.items() if x.law != "sensor")):
            if t.form.is_wave:
                at, timed = float(self.number("at", k)), t.form.timed
                length = at * float(case.settings.speed) if timed else at
                found[f"effects.{self.id}.terms[{k + 1}].at"] = at, "s" if timed else "m", length
        return found

    def shares(self, kind: str, curves: Curves, case: Case) -> np.ndarray:
        """Return the relative changes of a kind (tension, bending, torsion) of whole spans that a run had, (2, n): of
        the upper and the lower one."""
        assert curves.angle is not None
        assert curves.moment is not None
        ahead = case.settings.direction > 0
        up, off = ([0, 2], [3, 1]) if ahead else ([1, 3], [2, 0])  # points of the spans up the tail and the head pulley
        moments = curves.moment if ahead else curves.moment[::-1]
        read = {
            "y": curves.y[up],
            "kappa": moments / case.belt.bending_stiffness,
            "kappa_mean": (curves.angle[up] - curves.angle[off]) / case.rig.span_length,
        }
        found = np.zeros((2, len(curves.travel)))
        for k, t in self.terms(*RELATIVE):
            if t.place.relative != kind or t.place.is_stretch:
                continue
            x = read.get(t.form.variable)

            def one(travel, x, k=k):
                return jnp.broadcast_to(self.strength(k, x, travel, case), (2,))

            rows = np.asarray(jax.vmap(one, (0, None if x is None else 1), 1)(curves.travel, x))[:: 1 if ahead else -1]
            here = [t.place.where in PULLEYS and t.place.where != p for p in PULLEYS[:: 1 if ahead else -1]]
            there = [t.place.where in SPAN_NAMES and t.place.where != s for s in SPAN_NAMES]
            found += np.where(np.array(here)[:, None] | np.array(there)[:, None], 0.0, rows)
        return found


@lru_cache(CLASSES)
def law_effect(content: SizedLaw, id: str = ID) -> type[GenericLaw]:
    """Return the effect class of a law; the same law gives the same class, so that it is compiled once.

    Its parameters are the numbers of the law, in the order of its terms, with the law's values as defaults; sizes are
    null at 0.
    """
    terms, left = content.law.terms, list(content.sizes)
    parameters: dict[str, Parameter] = {}
    fields = []
    for k, t in enumerate(terms):
        form, along = t.form, "s" if t.form.timed else "1" if t.form.is_carried else "m"
        meanings = {
            "size": (t.size_unit, "size"),
            "cos": (t.size_unit, "amplitude of the cosine"),
            "sin": (t.size_unit, "amplitude of the sine"),
            "knee": (VARIABLES[form.variable][0], f"{form.variable} where its shape bends"),
            "at": (along, COURSES[form.course].at or "travel of its course"),
            "wide": (along, "how long it lasts"),
            "exponent": ("1", "power of the tension"),
        }
        values = {n: left.pop(0) for n in form.halves} | form.numbers | {"exponent": t.exponent}
        for name, value in values.items():
            shapes, scale = name not in form.halves, abs(value) or 1.0
            ends = (value / 10.0, value * 10.0) if shapes else (-10.0 * scale, 10.0 * scale)
            low, high, scale = (-4.0, 4.0, 1.0) if name == "exponent" else (min(ends), max(ends), scale)
            unit, meaning = meanings[name]
            declared = Parameter(unit=unit, meaning=meaning, plausible=(low, high), scale=scale, modifier=shapes)
            parameters[number_name(name, k)] = replace(declared, null=float(value) if shapes else 0.0)
            fields.append((number_name(name, k), float, field(default=float(value))))
    hooks = {PLACE_KINDS[t.place.kind].hook for t in terms}
    # pulleys have a shape for every term that acts on the march: a yaw, a taper or a crown that stays
    acting = [t for t in terms if PLACE_KINDS[t.place.kind].law != "sensor"]
    in_scene = bool(acting) and all(
        t.form.course == "constant"
        and (
            (t.place.kind in ("yaw", "turn") and t.form.variable in ("none", "sigma"))
            or (t.place.kind == "turn" and t.form.variable == "y" and t.form.shape == "linear")
        )
        for t in acting
    )
    namespace = {
        "id": id,
        "title": "A law found in data: " + ", ".join(dict.fromkeys(t.place.words for t in terms)),
        "stage": 3,  # it was found beside all others
        "law": PLACE_KINDS[terms[0].place.kind].law,
        "parity": content.law.parity,
        "parameters": parameters,
        "content": content,
        **{hook: _HOOKS[hook] for hook in sorted(hooks)},
        **({"influence": _influence} if "bend" in hooks else {}),
        **({"scene": _scene} if in_scene else {}),
    }
    # JAX tells effects apart by their names (see belt_sim.case.pytree)
    name = f"GenericLaw_{hashlib.sha256(repr((id, content)).encode()).hexdigest()[:16]}"
    cls = make_dataclass(name, fields, bases=(GenericLaw,), namespace=namespace, frozen=True, kw_only=True)
    cls.__module__ = __name__
    made: type[GenericLaw] = effect(cls)
    return made


# --- hooks ------------------------------------------------------------------------------------------------------------


def _belt_part(case, travel):
    """The part of the belt that runs up the tail and the head pulley (2,), in belt lengths from the one that is at the
    tail pulley when a forward run starts."""
    span, wrap = case.rig.span_length, case.rig.wrap_tail
    ahead, back = travel - jnp.stack([0.0 * span, span + wrap]), jnp.stack([-wrap, span]) - travel
    return jnp.where(case.settings.direction > 0, ahead, back) / case.rig.belt_length


def _at_pulleys(*kinds: str) -> Callable[..., Any]:
    """Return a hook that adds the terms at places of some kinds; it changes the belt that leaves a pulley by what that
    had when it ran up."""

    def hook(self, value, state, case):
        landed = value
        for k, t in self.terms(*kinds):
            v = t.form.variable
            for _, pulley in t.place.parts:
                if not t.form.reads_belt:
                    x = None
                elif t.place.kind not in WRAPPED:
                    x = getattr(state, v)[pulley]
                elif v == "kappa":
                    x = landed.moment[pulley] / case.belt.bending_stiffness
                else:
                    x = getattr(landed, v)[pulley]
                added = self.strength(k, x, state.travel, case, pulley)
                if t.place.kind == "span":  # on the pulley that it runs up
                    up = 1.0 if SPAN_NAMES[pulley or 0] == t.place.where else -1.0
                    added = jnp.where(case.settings.direction * up > 0.0, added, 0.0)
                if t.place.kind == "yaw":
                    value = add(value, **{PULLEYS[pulley]: added})
                else:
                    value = add(value, **{PLACE_KINDS[t.place.kind].field: jnp.zeros(2).at[pulley].set(added)})
        return value

    return hook


def _influence(self, span, case):
    """Return the span's response to its boundary values, and what each change of whole spans and of a stretch of the
    belt adds, by its kind (tension, bending, torsion)."""
    whole, stretches = (
        dict.fromkeys(t.place.relative for _, t in self.terms(*RELATIVE) if t.place.is_stretch == stretch)
        for stretch in (False, True)
    )
    changes = {kind: response_by_change(span, case, kind) for kind in whole}
    return response(span), changes, {kind: stretch_response(span, kind) for kind in stretches}


def _bend(self, bend, boundary, known, case):
    (answer, changes, stretches), rig, direction = known, case.rig, case.settings.direction
    shares: dict[str, Any] = {}
    for k, t in self.terms(*RELATIVE):
        if t.place.is_stretch:
            size, at, wide = (self.number(n, k) for n in ("size", "at", "wide"))
            found, part = stretches[t.place.relative], _belt_part(case, boundary.travel)
            jump = (
                -size * (case.settings.tension / self.content.tension) ** self.number("exponent", k) * rig.span_length
            )
            lies = stretch_ends(rig.span_length, rig.belt_length, (at - part) * direction, wide)
            per_end, more = stretch_adds(found, jump, wide * rig.belt_length, lies)
            added = jnp.einsum("ais,is->as", per_end, boundary.ends[:3])
            own = [0.0, 0.0]
            if found.ends is not None:
                leaves = part - direction * rig.span_length / rig.belt_length  # the part at the run-off
                here = (COURSES["belt_section"].value(place, at, wide, jnp) for place in (part, leaves))
                ends = zip(here, found.ends @ boundary.ends[:3] + added[:2], strict=True)
                own = [more * inside * elastic for inside, elastic in ends]
            bend = add_natural(bend, added, own)
            continue
        x = None
        if t.form.variable == "y":
            x = boundary.start + boundary.ends[0]
        elif t.form.variable == "kappa":
            x = answer.runup @ boundary.ends + bend.runup
        elif t.form.variable == "kappa_mean":
            x = (boundary.ends[2] - boundary.ends[1]) / case.rig.span_length
        added = self.strength(k, x, boundary.travel, case)
        if t.place.where in SPAN_NAMES:
            first = jnp.array([t.place.where == s for s in SPAN_NAMES])
            added = jnp.where((case.settings.direction > 0) == first, added, 0.0)
        elif t.place.where in PULLEYS:
            added = jnp.where(jnp.array([t.place.where == p for p in PULLEYS]), added, 0.0)
        shares[t.place.relative] = shares[t.place.relative] + added if t.place.relative in shares else added
    for kind, share in shares.items():
        x = log_of_change(share) + jnp.zeros(2)
        more = jnp.einsum("ks,kai,is->as", x ** jnp.arange(1, 8)[:, None], changes[kind], boundary.ends)
        natural = jnp.zeros((2, 2))
        if kind == "bending":  # its moment is that of its own stiffness: the rest of the curvature bears none
            natural = -jnp.expm1(x) * (jnp.stack([answer.runup, answer.runoff]) @ boundary.ends + more[:2])
        bend = add_natural(bend, more.at[:2].add(-natural), natural)
        if kind == "tension":
            bend = add(bend, tension=share)
    return bend


def _sensor(self, reading, case):
    added = jnp.zeros_like(reading.y)
    for k, t in self.terms("sensor"):
        for row in (point - 1 for point in t.place.points):
            x = None
            if t.form.variable == "reading":
                x = reading.y[row]
            elif t.form.variable == "reading_rate":  # dy/dt [m/s]
                order = jnp.argsort(reading.sensor_travel)
                s, y = reading.sensor_travel[order], reading.y[row][order]
                low, high = (jnp.clip(reading.sensor_travel + h, s[0], s[-1]) for h in (-RATE_REACH, RATE_REACH))
                x = (jnp.interp(high, s, y) - jnp.interp(low, s, y)) / (high - low) * case.settings.speed
            added = added.at[row].add(self.strength(k, x, reading.sensor_travel, case))
    return add(reading, y=added)


def _scene(self, parts, case):
    for k, t in self.terms("yaw", "turn"):
        y = t.form.variable == "y"
        value = float(self.strength(k, 1.0 if y else None, 0.0, case))
        name, value = ("yaw_offset", value) if t.place.kind == "yaw" else ("crown", -value) if y else ("taper", value)
        for pulley in (PULLEYS[p or 0] for _, p in t.place.parts):
            parts = parts.add_to_pulley(pulley, **{name: value})
    return parts


_HOOKS = {
    "yaw": _at_pulleys("yaw"),
    "runup": _at_pulleys("turn", "drift", "span"),
    "wrap": _at_pulleys(*WRAPPED),
    "bend": _bend,
    "encoder": lambda self, travel, case: (
        travel + sum(self.strength(k, None, travel, case) for k, _ in self.terms("travel"))
    ),
    "sensor": _sensor,
}


# As an entry of an effects.yaml.


WIDTH = 110  # columns of a comment
TERM_NUMBERS = ("size", "cos", "sin", "knee", "at", "wide", "exponent")
LARGEST_EXPONENT = 10.0  # exponent of the tension
SENSOR_POINTS = (1, 2, 3, 4)


def law_entry(effect: GenericLaw) -> dict[str, Any]:
    """Return the law of an effect with its numbers, as an entry of an effects.yaml."""
    terms = []
    for k, t in enumerate(effect.content.law.terms):
        form, points = t.form, list(t.place.points)
        term: dict[str, Any] = {"place": "sensor", "points": points} if points else {"place": t.place.name}
        term |= {"variable": form.variable} | ({"shape": form.shape} if form.variable != "none" else {})
        term |= {"course": form.course} | ({"timed": True} if form.timed else {})
        terms.append(term | {n: float(x) for n in TERM_NUMBERS if (x := effect.number(n, k)) is not None})
    return {"id": ID, "tension": float(effect.content.tension), "terms": terms}


def yaml_number(value: float) -> str:
    """Return a float with every digit, as YAML 1.1 reads it back: with a point before the exponent."""
    text = repr(float(value))
    return text if "." in text or "e" not in text else text.replace("e", ".0e")


class _Entry:
    """A mapping of an effects.yaml that is read name by name; what is wrong with one is refused in a line."""

    def __init__(self, given: Any, where: str, names: Sequence[str]) -> None:
        if not isinstance(given, Mapping):
            raise InputError(where, given, "", "write a term as name: value lines, beginning with its place")
        self.given, self.where = given, where
        for name in given:
            if name not in names:
                self.refuse(str(name), f"no such entry; use {', '.join(names)}")

    def refuse(self, name: str, remedy: str, unit: str = "") -> NoReturn:
        raise InputError(f"{self.where}.{name}", self.given.get(name, "nothing"), unit, remedy)

    def number(self, name: str, unit: str = "") -> float:
        given = "nothing" if self.given.get(name) is None else self.given[name]
        return finite(f"{self.where}.{name}", given, unit, "give a finite number (write 2.0e-5, not 2e-5)")

    def choice(self, name: str, choices: Any, default: str = "") -> str:
        value = self.given.get(name, default)
        if not isinstance(value, str) or value not in choices:
            self.refuse(name, f"use one of {', '.join(choices)}")
        return value


def law_of_entry(entry: Mapping[str, Any]) -> SizedLaw:
    """Return the law of an entry of an effects.yaml; raise InputError in one line for what is wrong with it."""
    whole = _Entry(entry, f"effects.{ID}", ("id", "tension", "terms"))
    tension = whole.number("tension", "Pa")
    if tension <= 0.0:
        whole.refuse("tension", "give a tension above 0", "Pa")
    given = entry.get("terms")
    if not isinstance(given, Sequence) or isinstance(given, str) or not given:
        whole.refuse("terms", "write a list of terms, each with place, variable, course and sizes")
    read = [_term_of(one, f"effects.{ID}.terms[{k}]") for k, one in enumerate(given, 1)]
    return SizedLaw(Law(tuple(term for term, _ in read)), tuple(x for _, sizes in read for x in sizes), tension)


def _term_of(given: Any, where: str) -> tuple[Term, list[float]]:
    """The term of an entry, and its sizes."""
    one = _Entry(given, where, ("place", "points", "variable", "shape", "course", "timed", *TERM_NUMBERS))
    name = one.choice("place", (*LAW_PLACES, "sensor"))
    points: Any = one.given.get("points")
    if name != "sensor":
        if points is not None:
            one.refuse("points", "only place: sensor has points")
        place = LAW_PLACES[name]
    else:
        readable = isinstance(points, Sequence) and points
        if not readable or any(p not in SENSOR_POINTS or isinstance(p, bool) for p in points):
            one.refuse("points", "give the points of the sensors, as [1, 4]")
        if len(set(points)) < len(points):
            one.refuse("points", "name each point once")
        shown = tuple((f"point {p}", p) for p in points)
        place = Place("sensor", "all" if len(shown) > 1 else shown[0][0], shown)

    beyond = ("reading", "reading_rate") if place.kind == "sensor" else () if place.kind == "travel" else ("y", "kappa")
    own = () if place.kind in ("sensor", "travel") else ("kappa_mean",) if place.relative else ("alpha",)
    variable = one.choice("variable", ["none"] if place.is_stretch else [*EXTERNAL_VARIABLES, *beyond, *own], "none")
    shape = one.choice("shape", SHAPES, "linear")
    course = one.choice("course", [c for c in COURSES if not c.endswith("_sine")], "constant")
    form = Form(variable, shape, course=course, timed=flag(f"{where}.timed", given.get("timed", False)))
    if form.is_carried and (form.timed or place.kind not in (*BY_THE_BELT, *RELATIVE, *WRAPPED, "yaw")):
        one.refuse("course", "a section of the belt is met at pulleys and spans, and is not timed")
    if place.is_carried and not form.is_carried:
        one.refuse("course", f"the belt carries {place.name}; write course: belt_section")
    if place.is_stretch and shape != "linear":
        one.refuse("shape", f"{place.name} reads nothing that could have one; leave it out")
    if shape == "stick" and variable != "reading":
        one.refuse("shape", "only the reading of a sensor sticks")
    shaping = {"knee": SHAPES[shape].knee, "at": bool(COURSES[course].at), "wide": COURSES[course].wide}
    needed = [*form.halves, *(n for n, there in (shaping | {"exponent": "exponent" in given}).items() if there)]
    for name in TERM_NUMBERS:
        if name in given and name not in needed:
            one.refuse(name, f"a {course} of shape {shape} has no such number; leave it out")
    values = {n: one.number(n) for n in needed}
    for name in shaping:
        if values.get(name, 1.0) <= 0.0 and not (name == "at" and form.is_carried):
            one.refuse(name, "give a number above 0")
    if abs(values.get("exponent", 0.0)) > LARGEST_EXPONENT:
        one.refuse("exponent", f"give an exponent of at most {LARGEST_EXPONENT:g} either way")
    numbers: dict[str, Any] = {n: values[n] for n, there in shaping.items() if there}
    form = replace(form, **numbers)
    return Term(place, form, values.get("exponent", 0.0)), [values[n] for n in form.halves]
