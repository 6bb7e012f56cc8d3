"""The terms of a law found in data: where each acts, what it reads, how it goes along the travel, and its numbers.

Every term adds, at its place, u = size x shape(variable) x course(s) x (tension / reference tension)^exponent, with s:
travel [m] or time [s]. The functions of SHAPES and COURSES hold for NumPy and JAX arrays alike.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

PULLEYS = ("tail", "head")
#: channels of the roll at mid-span of the spans that run up the tail and the head pulley, which moves nothing else
ROLLS = tuple(f"roll_{pulley}" for pulley in PULLEYS)
SPAN_NAMES = ("upper", "lower")  # the first runs up the tail pulley where the belt travels forwards


class LawVariable(NamedTuple):
    """A kind of place: its words, the unit of what acts there, the law and the hook that it changes, the field of what
    that hook changes; relative: what its input is a relative change of."""

    words: str
    unit: str
    law: str
    hook: str
    field: str = ""
    relative: str = ""


PLACE_KINDS = {
    "yaw": LawVariable("yaw of {}", "rad", "drive", "yaw"),
    "turn": LawVariable("turn of the belt where it runs up {}", "1/m", "run-up", "runup", "turn"),
    "drift": LawVariable("sideways drift where the belt runs up {}", "rad", "run-up", "runup", "drift"),
    "shift": LawVariable("sideways shift over the wrap of {}", "m", "wrap", "wrap", "y"),
    "twist": LawVariable("twist over the wrap of {}", "rad", "wrap", "wrap", "alpha"),
    "span": LawVariable("bend of the {} span where it runs up", "1/m", "run-up", "runup", "turn"),
    "tension": LawVariable("tension of the belt", "1", "span", "bend", relative="tension"),
    "pull": LawVariable("tension of one span, the {}", "1", "span", "bend", relative="tension"),
    "bending": LawVariable("bending stiffness of {}", "1", "span", "bend", relative="bending"),
    "torsion": LawVariable("torsional stiffness of {}", "1", "span", "bend", relative="torsion"),
    "travel": LawVariable("travel that the encoder shows", "m", "sensor", "encoder"),
    "sensor": LawVariable("reading of {}", "m", "sensor", "sensor"),
}
AT_PULLEYS = ("yaw", "turn", "drift", "shift", "twist")  # of these kinds
WRAPPED = ("shift", "twist")  # what happens to a belt while it lies on a pulley
STIFFNESS = ("pull", "bending", "torsion")  # relative changes of a span's own
BY_THE_BELT = ("turn", "drift", "bending", "torsion")  # what a section of the belt can do: at run-ups and in spans
RELATIVE = tuple(kind for kind, k in PLACE_KINDS.items() if k.relative)
#: where -> its words at pulleys, and of spans
_ALIKE = {
    "both": ("both pulleys alike", "both spans"),
    "carried": ("both pulleys (as the belt carries it)", "a stretch of the belt"),
}

#: variable -> its unit, its words and its sign
VARIABLES = {
    "none": ("1", "travel alone", ""),
    "yaw_set": ("1", "travel since the yaw was set", ""),
    "beta": ("rad", "the commanded yaw β", "β"),
    "sigma": ("Pa", "the tension σ", "σ"),
    "y": ("m", "the belt's place y on the pulley", "y"),
    "alpha": ("rad", "the contact angle α", "α"),
    "kappa": ("1/m", "the curvature κ at the run-up (the entry moment)", "κ"),
    "kappa_mean": ("1/m", "the mean curvature κ̄ of the span that runs up", "κ̄"),
    "reading": ("m", "the place y that the sensor sees", "y"),
    "reading_rate": ("m/s", "the speed dy/dt that the sensor sees", "dy/dt"),
}
EXTERNAL_VARIABLES = ("none", "yaw_set", "beta", "sigma")  # variables that do not depend on where the belt runs


def stop(x, half, s=None, xp=np):
    """The stop operator along the last axis: what friction holds back of x, which follows x and slides beyond
    ``half``; s (n,): where x (n,) of JAX is read, in the order of which it follows."""
    if xp is np:
        along = np.ascontiguousarray(np.moveaxis(x, -1, 0))
        held = np.zeros_like(along)
        for k in range(1, len(along)):
            held[k] = np.minimum(np.maximum(held[k - 1] + along[k] - along[k - 1], -half), half)
        return np.moveaxis(held, 0, -1)
    order = jnp.argsort(s)
    along = x[order]

    def one(held, step):
        held = jnp.clip(held + step, -half, half)
        return held, held

    held = jax.lax.scan(one, 0.0 * along[0], jnp.diff(along, prepend=along[:1]))[1]
    return jnp.zeros_like(x).at[order].set(held)


def _gate(s, start, xp):
    """0 before ``start`` and 1 after it, over about a metre (or second)."""
    return 1.0 / (1.0 + xp.exp(-(s - start) / 0.3))


class Shape(NamedTuple):
    """A shape: its formula in words, and the function (x, knee, s, xp) of the variable x; power: of x."""

    words: str
    value: Callable[..., Any]
    knee: bool = True
    odd: bool = False
    power: int = 1


SHAPES = {
    "linear": Shape("x", lambda x, knee, s, xp: x, False, True),
    "signed_square": Shape("x |x|", lambda x, knee, s, xp: x * xp.abs(x), False, True, 2),
    "square": Shape("x^2", lambda x, knee, s, xp: x**2, False, False, 2),
    "cube": Shape("x^3", lambda x, knee, s, xp: x**3, False, True, 3),
    "saturation": Shape("knee tanh(x / knee)", lambda x, knee, s, xp: knee * xp.tanh(x / knee), odd=True),
    "dead_zone": Shape(
        "the part of x beyond -knee and +knee", lambda x, knee, s, xp: x - xp.clip(x, -knee, knee), odd=True
    ),
    "stick": Shape("what friction holds back of x, knee at most", stop, odd=True),
    "magnitude": Shape("|x|", lambda x, knee, s, xp: xp.abs(x), False),
    "magnitude_beyond": Shape("the part of |x| beyond knee", lambda x, knee, s, xp: xp.maximum(xp.abs(x) - knee, 0.0)),
    "below": Shape("1 - x / knee below knee, 0 above", lambda x, knee, s, xp: xp.maximum(1.0 - x / knee, 0.0)),
    "positive": Shape("from 0 to 1 where x becomes positive", lambda x, knee, s, xp: 0.5 * (1.0 + xp.tanh(x / knee))),
    "negative": Shape("from 0 to 1 where x becomes negative", lambda x, knee, s, xp: 0.5 * (1.0 - xp.tanh(x / knee))),
    "above": Shape("x / knee - 1 above knee, 0 below", lambda x, knee, s, xp: xp.maximum(x / knee - 1.0, 0.0)),
}
ONE_SIDED = ("positive", "negative")


class Course(NamedTuple):
    """A course: its formula in words, and the function (s, at, wide, xp) of travel [m] or time [s]; of a section of the
    belt, s is the part that runs up, in belt lengths; at: what that number is, if there is one; per: unit of a size."""

    words: str
    value: Callable[..., Any]
    at: str = ""
    wide: bool = False
    per: str = ""


COURSES = {
    "constant": Course("1", lambda s, at, wide, xp: 1.0 + 0.0 * s),
    "linear": Course("s", lambda s, at, wide, xp: s, per="/m"),
    "quadratic": Course("s^2", lambda s, at, wide, xp: s**2, per="/m^2"),
    "square_root": Course("sqrt(s)", lambda s, at, wide, xp: xp.sqrt(s + 1e-6), per="/m^0.5"),
    "rise": Course("1 - exp(-s / at)", lambda s, at, wide, xp: 1.0 - xp.exp(-s / at), "length over which it rises"),
    "decay": Course("exp(-s / at)", lambda s, at, wide, xp: xp.exp(-s / at), "length over which it fades"),
    "step": Course("0 before at, 1 after it", lambda s, at, wide, xp: _gate(s, at, xp), "where it begins"),
    "interval": Course(
        "1 from at on for wide, else 0",
        lambda s, at, wide, xp: _gate(s, at, xp) - _gate(s, at + wide, xp),
        "where it begins",
        True,
    ),
    "belt_section": Course(
        "once a revolution on a section of the belt: its middle at, its length wide, in belt lengths",
        lambda s, at, wide, xp: 1.0 / (1.0 + xp.exp((xp.abs((s - at + 0.5) % 1.0 - 0.5) - 0.5 * wide) / 0.01)),
        "middle of the section",
        True,
    ),
    "wave": Course("cos and sin of 2 pi s / at", lambda s, at, wide, xp: xp.cos(2.0 * xp.pi * s / at), "wavelength"),
    "wave_sine": Course("sin(2 pi s / at)", lambda s, at, wide, xp: xp.sin(2.0 * xp.pi * s / at), "wavelength"),
    "decaying_wave": Course(
        "exp(-s / wide) times cos and sin of 2 pi s / at",
        lambda s, at, wide, xp: xp.exp(-s / wide) * xp.cos(2.0 * xp.pi * s / at),
        "wavelength",
        True,
    ),
    "decaying_wave_sine": Course(
        "exp(-s / wide) sin(2 pi s / at)",
        lambda s, at, wide, xp: xp.exp(-s / wide) * xp.sin(2.0 * xp.pi * s / at),
        "wavelength",
        True,
    ),
}
_TIDY = {
    "1/m/(m)": "1/m^2", "1/m/(m)^2": "1/m^3", "1/m/(m)^3": "1/m^4", "m/(m)^2": "1/m", "m/(m)^3": "1/m^2",
    "m/(m/s)": "s", "m/m": "1", "m/m^2": "1/m", "1/m/(rad)": "1/(m rad)",
}  # fmt: skip


def _derived() -> Any:
    """A field that follows from those given."""
    return field(init=False, repr=False, compare=False)


@dataclass(frozen=True)
class Place:
    """A place at which physics can be missing.

    kind: of PLACE_KINDS; where: tail, head (of a span: it runs up that pulley), both, carried (both, as the belt
    carries it), upper, lower, the name of a sensor, all; sensors: names of those that show what acts there, and their
    points, 1 to 4 (0: of a sensor of tilt, which shows what a change of a span does to its roll).

    name, words: the place in one word, and in several; unit: of what acts there; relative: what its input is a relative
    change of (tension, bending or torsion; empty: of nothing); points: of the sensors whose reading it is; parts: its
    entries of the march, (channel, pulley 0 or 1), or (sensor, None); is_carried: whether the belt carries what acts
    here from pulley to pulley; is_stretch: whether that is the stiffness of a stretch of the belt. With a size of r it
    bends (or twists) as with -r span lengths more of belt in it; a small change of a whole span's stiffness by r would
    give as much.
    """

    kind: str
    where: str = ""
    sensors: tuple[tuple[str, int], ...] = ()
    name: str = _derived()
    words: str = _derived()
    unit: str = _derived()
    relative: str = _derived()
    points: tuple[int, ...] = _derived()
    parts: tuple[tuple[str, int | None], ...] = _derived()
    is_carried: bool = _derived()
    is_stretch: bool = _derived()

    def __post_init__(self) -> None:
        kind, where, known = self.kind, self.where, PLACE_KINDS[self.kind]
        is_carried = where == "carried" and kind in BY_THE_BELT

        if kind in ("sensor", "travel"):
            parts: tuple[tuple[str, int | None], ...] = tuple((name, None) for name, _ in self.sensors)
        else:
            at = [k for k, p in enumerate(PULLEYS) if where not in PULLEYS or where == p]
            channel = kind if kind in AT_PULLEYS else "turn"
            rolls = tuple((ROLLS[k], k) for k in at) if known.relative and self.sensors else ()
            parts = tuple((f"{channel}_{PULLEYS[k]}", k) for k in at) + rolls

        what = where
        if kind in AT_PULLEYS:
            what = _ALIKE[where][0] if where in _ALIKE else f"the {where} pulley"
        elif kind == "pull":
            what = f"one that runs up the {where} pulley" if where in PULLEYS else f"{where} one"
        elif known.relative:
            what = _ALIKE[where][1] if where in _ALIKE else f"the {where} span"
        alike = kind == "sensor" and len(self.sensors) != 1

        vars(self).update(
            name=f"{kind}_{where}" if where else kind,
            words="readings of all sensors alike" if alike else known.words.format(what),
            unit=known.unit,
            relative=known.relative,
            points=tuple(point for _, point in self.sensors) if kind == "sensor" else (),
            parts=parts,
            is_carried=is_carried,
            is_stretch=is_carried and bool(known.relative),
        )


#: every place that does not depend on the sensors, by name
LAW_PLACES = {
    place.name: place
    for place in (
        *(Place(kind, where) for kind in AT_PULLEYS for where in (*PULLEYS, "both")),
        *(Place(kind, "carried") for kind in BY_THE_BELT),
        *(Place(kind, "both") for kind in ("bending", "torsion")),
        *(Place(kind, where) for kind in (*STIFFNESS, "span") for where in SPAN_NAMES),
        *(Place("pull", where) for where in PULLEYS),
        Place("tension"),
        Place("travel"),
    )
}


@dataclass(frozen=True)
class Form:
    """variable; shape and its knee (None: it has none); course and its numbers at and wide [m], or [s] of a timed one,
    or in belt lengths of a section of the belt.

    numbers: its shape numbers by name; is_wave: whether it swings, with a size for the cosine and one for the sine;
    is_carried: whether it goes round with the belt; since_yaw: whether its travel counts from where the yaw was set (a
    wave runs with the belt, whenever that was); reads_belt: whether its variable depends on where the belt runs.
    """

    variable: str
    shape: str = "linear"
    knee: float | None = None
    course: str = "constant"
    at: float | None = None
    wide: float | None = None
    timed: bool = False
    numbers: dict[str, Any] = field(init=False, repr=False, compare=False)
    is_wave: bool = _derived()
    is_carried: bool = _derived()
    since_yaw: bool = _derived()
    reads_belt: bool = _derived()

    def __post_init__(self) -> None:
        vars(self).update(
            numbers={n: x for n in ("knee", "at", "wide") if (x := getattr(self, n)) is not None},
            is_wave=self.course.removesuffix("_sine") in ("wave", "decaying_wave"),
            is_carried=self.course == "belt_section",
            since_yaw=self.variable in ("beta", "yaw_set") and not self.course.startswith("wave"),
            reads_belt=self.variable not in EXTERNAL_VARIABLES,
        )

    @property
    def halves(self) -> "dict[str, Form]":
        """Names of its sizes, and what each is of: cosine and sine of a wave."""
        return {"cos": self, "sin": replace(self, course=f"{self.course}_sine")} if self.is_wave else {"size": self}

    def shape_value(self, x: Any, s: Any, xp: Any, knee: Any = None) -> Any:
        """Its shape of the variable x; knee: in place of its own."""
        return SHAPES[self.shape].value(x, self.knee if knee is None else knee, s, xp)

    def course_value(self, s: Any, xp: Any, at: Any = None, wide: Any = None) -> Any:
        """Its course at s; at, wide: in place of its own."""
        at, wide = self.at if at is None else at, self.wide if wide is None else wide
        return COURSES[self.course].value(s, at, wide, xp)


@dataclass(frozen=True)
class Term:
    """One term of a law: size x form x (tension / reference tension)^exponent at a place.

    family: place, variable, shape and course, without numbers; sizes: how many it has, two of a wave; size_unit: of
    each; parity: odd, even or mixed, how what it adds changes with the sign of the yaw.
    """

    place: Place
    form: Form
    exponent: float = 0.0
    family: tuple[str, str, str, str] = _derived()
    sizes: int = _derived()
    parity: str = _derived()
    size_unit: str = _derived()

    def __post_init__(self) -> None:
        place, form, shape = self.place, self.form, SHAPES[self.form.shape]

        of_motion = bool(place.relative) or place.kind == "travel"  # in proportion to what moves or is bent
        reads = form.variable not in ("none", "yaw_set", "sigma")
        odd = shape.odd != of_motion if reads else of_motion

        variable, course = VARIABLES[form.variable][0], COURSES[form.course].per
        course = course.replace("m", "s") if form.timed else course
        plain = variable == "1" or form.variable == "sigma" or form.shape in ONE_SIDED
        over = "" if plain else f"/({variable})^{shape.power}" if shape.power > 1 else f"/({variable})"
        unit = place.unit + over + course
        same = variable == place.unit and shape.power == 1 and not plain

        when = form.course.removesuffix("_sine") + " in time" * form.timed
        vars(self).update(
            family=(place.name, form.variable, form.shape, when),
            sizes=2 if form.is_wave else 1,
            parity="mixed" if form.shape in ONE_SIDED else "odd" if odd else "even",
            size_unit=f"1{course}" if same else _TIDY.get(unit, unit),
        )


@dataclass(frozen=True)
class Law:
    """Terms whose sizes are free.

    family: of its terms; parity: odd, even or mixed, how what the law adds changes with the sign of the yaw.
    """

    terms: tuple[Term, ...]
    family: tuple[tuple[str, str, str, str], ...] = _derived()
    parity: str = _derived()

    def __post_init__(self) -> None:
        found = {t.parity for t in self.terms}
        vars(self).update(
            family=tuple(t.family for t in self.terms), parity=found.pop() if len(found) == 1 else "mixed"
        )

    def with_numbers(self, values: Mapping[str, float]) -> "Law":
        """The law with knees, courses and exponents of ``values``, named as the parameters of its effect."""
        terms = []
        for k, t in enumerate(self.terms):
            changed: dict[str, Any] = {n: values[number_name(n, k)] for n in t.form.numbers}
            terms.append(replace(t, form=replace(t.form, **changed), exponent=values[number_name("exponent", k)]))
        return Law(tuple(terms))


@dataclass(frozen=True)
class SizedLaw:
    """A law with sizes, term by term (cosine and sine of a wave), in the units of its terms; tension [Pa] at which they
    hold."""

    law: Law
    sizes: tuple[float, ...]
    tension: float


def number_name(name: str, k: int) -> str:
    """The name of a number of the k-th term, counted from 0: size, size_2, size_3, ..."""
    return name if k == 0 else f"{name}_{k + 1}"
