"""A law of one or more terms as data: where each acts, what it reads, how it goes along the travel, and its numbers.

Every term adds, at its place,

    u = size x shape(variable) x course(s) x (tension / reference tension)^exponent,    s: travel [m] or time [s].

The search for laws (``belt_sim.discovery``) fits such terms, and ``belt_sim.effects.generic_law`` makes an effect of
them. The functions of SHAPES and COURSES hold for NumPy and JAX arrays alike.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

PULLEYS = ("tail", "head")
#: channels of the roll at mid-span of the spans that run up the tail and the head pulley, which moves nothing else
ROLLS = tuple(f"roll_{pulley}" for pulley in PULLEYS)
SPANS = ("upper", "lower")  # the first runs up the tail pulley where the belt travels forwards
TENSION, TRAVEL, SPAN, SENSOR, CARRIED = "tension", "travel", "span", "sensor", "carried"
#: kind of place at the pulleys -> its words, and the unit of what acts there
AT_PULLEYS = {
    "yaw": ("yaw of {}", "rad"),
    "turn": ("turn of the belt where it runs up {}", "1/m"),
    "drift": ("sideways drift where the belt runs up {}", "rad"),
    "shift": ("sideways shift over the wrap of {}", "m"),
    "twist": ("twist over the wrap of {}", "rad"),
}
WRAPPED = ("shift", "twist")  # kinds of what happens to a belt while it lies on a pulley
#: kind of relative change of a span's own stiffness -> its words, of both spans (where there is one) and of one
STIFFNESS = {
    "pull": ("", "tension of one span, the {} one"),
    "bending": ("bending stiffness of both spans", "bending stiffness of the {} span"),
    "torsion": ("torsional stiffness of both spans", "torsional stiffness of the {} span"),
}
#: kinds of what a section of the belt can do: where it runs up, and in the spans
BY_THE_BELT = ("turn", "drift", "bending", "torsion")
#: kind of place whose input is a relative change of what bends a span -> what that is
RELATIVE = {TENSION: TENSION, "pull": TENSION, "bending": "bending", "torsion": "torsion"}
_ALIKE = {"both": "both pulleys alike", CARRIED: "both pulleys (as the belt carries it)"}
_WORDS = {
    SPAN: "bend of the {} span where it runs up",
    TENSION: "tension of the belt",
    TRAVEL: "travel that the encoder shows",
    SENSOR: "reading of {}",
}
_UNITS = {SPAN: "1/m", TRAVEL: "m", SENSOR: "m"}

#: variable -> its unit and its words
VARIABLES = {
    "none": ("1", "travel alone"),
    "yaw_set": ("1", "travel since the yaw was set"),
    "beta": ("rad", "the commanded yaw β"),
    "sigma": ("Pa", "the tension σ"),
    "y": ("m", "the belt's place y on the pulley"),
    "alpha": ("rad", "the contact angle α"),
    "kappa": ("1/m", "the curvature κ at the run-up (the entry moment)"),
    "kappa_mean": ("1/m", "the mean curvature κ̄ of the span that runs up"),
    "reading": ("m", "the place y that the sensor sees"),
    "reading_rate": ("m/s", "the speed dy/dt that the sensor sees"),
}
INDEPENDENT = ("none", "yaw_set", "beta", "sigma")  # variables that do not depend on where the belt runs


def stop(x: np.ndarray, half: float | np.ndarray) -> np.ndarray:
    """The stop operator along the last axis: what friction holds back of x, which follows x and slides beyond
    ``half``."""
    along = np.ascontiguousarray(np.moveaxis(x, -1, 0))
    held = np.zeros_like(along)
    for k in range(1, len(along)):
        held[k] = np.minimum(np.maximum(held[k - 1] + along[k] - along[k - 1], -half), half)
    return np.moveaxis(held, 0, -1)


def _stop_along(x, half, s):
    """The stop operator for JAX: x (n,) is read in the order of s (n,)."""
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


def _section(s, middle, length, xp):
    """1 on a section of the belt, 0 elsewhere; all in belt lengths."""
    return 1.0 / (1.0 + xp.exp((xp.abs((s - middle + 0.5) % 1.0 - 0.5) - 0.5 * length) / 0.01))


#: shape -> its formula in words, and the function (x, knee, s, xp) of the variable x
SHAPES: dict[str, tuple[str, Callable[..., Any]]] = {
    "linear": ("x", lambda x, knee, s, xp: x),
    "signed_square": ("x |x|", lambda x, knee, s, xp: x * xp.abs(x)),
    "square": ("x^2", lambda x, knee, s, xp: x**2),
    "cube": ("x^3", lambda x, knee, s, xp: x**3),
    "saturation": ("knee tanh(x / knee)", lambda x, knee, s, xp: knee * xp.tanh(x / knee)),
    "dead_zone": ("the part of x beyond -knee and +knee", lambda x, knee, s, xp: x - xp.clip(x, -knee, knee)),
    "stick": (
        "what friction holds back of x, knee at most",
        lambda x, knee, s, xp: stop(x, knee) if xp is np else _stop_along(x, knee, s),
    ),
    "magnitude": ("|x|", lambda x, knee, s, xp: xp.abs(x)),
    "magnitude_beyond": ("the part of |x| beyond knee", lambda x, knee, s, xp: xp.maximum(xp.abs(x) - knee, 0.0)),
    "below": ("1 - x / knee below knee, 0 above", lambda x, knee, s, xp: xp.maximum(1.0 - x / knee, 0.0)),
    "positive": ("from 0 to 1 where x becomes positive", lambda x, knee, s, xp: 0.5 * (1.0 + xp.tanh(x / knee))),
    "negative": ("from 0 to 1 where x becomes negative", lambda x, knee, s, xp: 0.5 * (1.0 - xp.tanh(x / knee))),
    "above": ("x / knee - 1 above knee, 0 below", lambda x, knee, s, xp: xp.maximum(x / knee - 1.0, 0.0)),
}
WITHOUT_KNEE = ("linear", "signed_square", "square", "cube", "magnitude")
ODD_SHAPES = ("linear", "signed_square", "cube", "saturation", "dead_zone", "stick")
ONE_SIDED = ("positive", "negative")
_POWER = {"signed_square": 2, "square": 2, "cube": 3}

#: course -> its formula in words, and the function (s, at, wide, xp) of travel [m] or time [s]; of a section of the
#: belt, s is the part that runs up, in belt lengths
COURSES: dict[str, tuple[str, Callable[..., Any]]] = {
    "constant": ("1", lambda s, at, wide, xp: 1.0 + 0.0 * s),
    "linear": ("s", lambda s, at, wide, xp: s),
    "quadratic": ("s^2", lambda s, at, wide, xp: s**2),
    "square_root": ("sqrt(s)", lambda s, at, wide, xp: xp.sqrt(s + 1e-6)),
    "rise": ("1 - exp(-s / at)", lambda s, at, wide, xp: 1.0 - xp.exp(-s / at)),
    "decay": ("exp(-s / at)", lambda s, at, wide, xp: xp.exp(-s / at)),
    "step": ("0 before at, 1 after it", lambda s, at, wide, xp: _gate(s, at, xp)),
    "interval": ("1 from at on for wide, else 0", lambda s, at, wide, xp: _gate(s, at, xp) - _gate(s, at + wide, xp)),
    "belt_section": (
        "once a revolution on a section of the belt: its middle at, its length wide, in belt lengths",
        lambda s, at, wide, xp: _section(s, at, wide, xp),
    ),
    "wave": ("cos and sin of 2 pi s / at", lambda s, at, wide, xp: xp.cos(2.0 * xp.pi * s / at)),
    "wave_sine": ("sin(2 pi s / at)", lambda s, at, wide, xp: xp.sin(2.0 * xp.pi * s / at)),
    "decaying_wave": (
        "exp(-s / wide) times cos and sin of 2 pi s / at",
        lambda s, at, wide, xp: xp.exp(-s / wide) * xp.cos(2.0 * xp.pi * s / at),
    ),
    "decaying_wave_sine": (
        "exp(-s / wide) sin(2 pi s / at)",
        lambda s, at, wide, xp: xp.exp(-s / wide) * xp.sin(2.0 * xp.pi * s / at),
    ),
}
WAVES = ("wave", "decaying_wave")  # courses with a size for the cosine and one for the sine
WITHOUT_AT = ("constant", "linear", "quadratic", "square_root")
WITH_WIDE = ("interval", "belt_section", "decaying_wave", "decaying_wave_sine")
#: course -> what its number ``at`` is, where that is not a travel
_MEANINGS = dict.fromkeys(WAVES, "wavelength") | {"belt_section": "middle of the section", "step": "where it begins"}
_MEANINGS |= {
    "interval": "where it begins",
    "rise": "length over which it rises",
    "decay": "length over which it fades",
}
_TIDY = {
    "1/m/(m)": "1/m^2",
    "1/m/(m)^2": "1/m^3",
    "1/m/(m)^3": "1/m^4",
    "m/(m)^2": "1/m",
    "m/(m)^3": "1/m^2",
    "m/(m/s)": "s",
    "m/m": "1",
    "m/m^2": "1/m",
    "1/m/(rad)": "1/(m rad)",
}


@dataclass(frozen=True)
class Place:
    """A place at which physics can be missing.

    kind: of AT_PULLEYS, STIFFNESS, span, tension, travel or sensor; where: tail, head (of a span: it runs up that
    pulley), both, carried (both, as the belt carries it), upper, lower, the name of a sensor, all; sensors: names of
    those that show what acts there, and their points, 1 to 4 (0: of a sensor of tilt, which shows what a change of a
    span does to its roll).
    """

    kind: str
    where: str = ""
    sensors: tuple[tuple[str, int], ...] = ()

    @property
    def words(self) -> str:
        """The place in words."""
        if self.kind in AT_PULLEYS:
            return AT_PULLEYS[self.kind][0].format(_ALIKE.get(self.where, f"the {self.where} pulley"))
        if self.kind in STIFFNESS:
            of_both, of_one = STIFFNESS[self.kind]
            if self.is_stretch:
                return of_both.replace("both spans", "a stretch of the belt")
            if self.where in PULLEYS:
                return f"tension of one span, the one that runs up the {self.where} pulley"
            return of_both if self.where == "both" else of_one.format(self.where)
        one = self.kind != SENSOR or len(self.sensors) == 1
        return _WORDS[self.kind].format(self.where) if one else "readings of all sensors alike"

    @property
    def unit(self) -> str:
        """Unit of what acts there."""
        return AT_PULLEYS[self.kind][1] if self.kind in AT_PULLEYS else _UNITS.get(self.kind, "1")

    @property
    def parts(self) -> tuple[tuple[str, int | None], ...]:
        """Its entries of the march, (channel, pulley 0 or 1), or (sensor, None)."""
        if self.kind in (SENSOR, TRAVEL):
            return tuple((name, None) for name, _ in self.sensors)
        if self.kind in AT_PULLEYS:
            return tuple((f"{self.kind}_{p}", k) for k, p in enumerate(PULLEYS) if self.where in (p, *_ALIKE))
        at = [k for k, p in enumerate(PULLEYS) if self.where not in PULLEYS or self.where == p]
        rolls = tuple((ROLLS[k], k) for k in at) if self.relative and self.sensors else ()
        return tuple((f"turn_{PULLEYS[k]}", k) for k in at) + rolls

    @property
    def points(self) -> tuple[int, ...]:
        """Points of the sensors whose reading it is."""
        return tuple(point for _, point in self.sensors) if self.kind == SENSOR else ()

    @property
    def name(self) -> str:
        """The place in one word."""
        return f"{self.kind}_{self.where}" if self.where else self.kind

    @property
    def is_carried(self) -> bool:
        """Whether the belt carries what acts here from pulley to pulley."""
        return self.where == CARRIED and self.kind in BY_THE_BELT

    @property
    def is_stretch(self) -> bool:
        """Whether it is the stiffness of a stretch of the belt.

        With a size of r it bends (or twists) as with -r span lengths more of belt in it; a small change of a whole
        span's stiffness by r would give as much.
        """
        return self.is_carried and bool(self.relative)

    @property
    def relative(self) -> str:
        """What its input is a relative change of: tension, bending or torsion; empty: of nothing."""
        return RELATIVE.get(self.kind, "")

    @property
    def of_all_spans(self) -> "Place":
        """The same of both spans, where it is of one."""
        return replace(self, where="both") if self.where in SPANS else self


def fixed_places() -> dict[str, Place]:
    """Every place that does not depend on the sensors, by name."""
    found = [Place(kind, where) for kind in AT_PULLEYS for where in (*PULLEYS, "both")]
    found += [Place(kind, CARRIED) for kind in BY_THE_BELT]
    found += [Place(kind, "both") for kind, (of_both, _) in STIFFNESS.items() if of_both]
    found += [Place(kind, where) for kind in (*STIFFNESS, SPAN) for where in SPANS]
    found += [Place("pull", where) for where in PULLEYS]
    return {p.name: p for p in (*found, Place(TENSION), Place(TRAVEL))}


@dataclass(frozen=True)
class Form:
    """variable; shape and its knee (None: it has none); course and its numbers at and wide [m], or [s] of a timed one,
    or in belt lengths of a section of the belt."""

    variable: str
    shape: str = "linear"
    knee: float | None = None
    course: str = "constant"
    at: float | None = None
    wide: float | None = None
    timed: bool = False

    @property
    def numbers(self) -> int:
        """How many shape numbers it has."""
        return sum(n is not None for n in (self.knee, self.at, self.wide))

    @property
    def is_wave(self) -> bool:
        """Whether it swings, with a size for the cosine and one for the sine."""
        return self.course.removesuffix("_sine") in WAVES

    @property
    def is_carried(self) -> bool:
        """Whether it goes round with the belt."""
        return self.course == "belt_section"

    @property
    def since_yaw(self) -> bool:
        """Whether its travel counts from where the yaw was set; a wave runs with the belt, whenever that was."""
        return self.variable in ("beta", "yaw_set") and not self.course.startswith("wave")

    @property
    def reads_belt(self) -> bool:
        """Whether its variable depends on where the belt runs."""
        return self.variable not in INDEPENDENT

    @property
    def family(self) -> tuple[str, str, str]:
        """Variable, shape and course, without numbers."""
        return self.variable, self.shape, self.course.removesuffix("_sine") + " in time" * self.timed

    def sine(self) -> "Form":
        """The other half of a wave."""
        return replace(self, course=f"{self.course}_sine")

    def shape_value(self, x: Any, s: Any, xp: Any, knee: Any = None) -> Any:
        """Its shape of the variable x; knee: in place of its own."""
        return SHAPES[self.shape][1](x, self.knee if knee is None else knee, s, xp)

    def course_value(self, s: Any, xp: Any, at: Any = None, wide: Any = None) -> Any:
        """Its course at s; at, wide: in place of its own."""
        return COURSES[self.course][1](s, self.at if at is None else at, self.wide if wide is None else wide, xp)


@dataclass(frozen=True)
class Term:
    """One term of a law: size x form x (tension / reference tension)^exponent at a place."""

    place: Place
    form: Form
    exponent: float = 0.0

    @property
    def family(self) -> tuple[str, str, str, str]:
        """Place and family of form, without numbers."""
        return self.place.name, *self.form.family

    @property
    def sizes(self) -> int:
        """How many sizes it has: two of a wave."""
        return 2 if self.form.is_wave else 1

    @property
    def parity(self) -> str:
        """odd, even or mixed: how what it adds changes with the sign of the yaw."""
        if self.form.shape in ONE_SIDED:
            return "mixed"
        of_motion = bool(self.place.relative) or self.place.kind == TRAVEL  # in proportion to what moves or is bent
        reads = self.form.variable not in ("none", "yaw_set", "sigma")
        odd = (self.form.shape in ODD_SHAPES) != of_motion if reads else of_motion
        return "odd" if odd else "even"

    @property
    def size_unit(self) -> str:
        """Unit of its size."""
        variable, place = VARIABLES[self.form.variable][0], self.place.unit
        plain = variable == "1" or self.form.variable == "sigma" or self.form.shape in ONE_SIDED
        variable = "" if plain else variable
        power = _POWER.get(self.form.shape, 1)
        course = {"linear": "/m", "quadratic": "/m^2", "square_root": "/m^0.5"}.get(self.form.course, "")
        course = course.replace("m", "s") if self.form.timed else course
        if variable == place and power == 1:
            return f"1{course}"
        over = "" if not variable else f"/({variable})^{power}" if power > 1 else f"/({variable})"
        return _TIDY.get(place + over + course, place + over + course)


@dataclass(frozen=True)
class Law:
    """Terms whose sizes are free."""

    terms: tuple[Term, ...]

    @property
    def family(self) -> tuple[tuple[str, str, str, str], ...]:
        """Places and families of forms, without numbers."""
        return tuple(t.family for t in self.terms)

    @property
    def parity(self) -> str:
        """odd, even or mixed: how what the law adds changes with the sign of the yaw."""
        found = {t.parity for t in self.terms}
        return "mixed" if len(found) > 1 else found.pop()

    def with_numbers(self, values: Mapping[str, float]) -> "Law":
        """The law with knees, courses and exponents of ``values``, named as by ``law_numbers``."""
        terms = []
        for k, t in enumerate(self.terms):
            changed: dict[str, Any] = {
                n: values[number_name(n, k)] for n in ("knee", "at", "wide") if getattr(t.form, n) is not None
            }
            terms.append(replace(t, form=replace(t.form, **changed), exponent=values[number_name("exponent", k)]))
        return Law(tuple(terms))


@dataclass(frozen=True)
class SizedLaw:
    """A law with sizes, term by term (cosine and sine of a wave), in the units of its terms; tension [Pa] at which they
    hold."""

    law: Law
    sizes: tuple[float, ...]
    tension: float


@dataclass(frozen=True)
class LawNumber:
    """One number of a law: name, unit, meaning, value, and whether it only shapes what the sizes do."""

    name: str
    unit: str
    meaning: str
    value: float
    modifier: bool = False


def number_name(name: str, k: int) -> str:
    """The name of a number of the k-th term, counted from 0: size, size_2, size_3, ..."""
    return name if k == 0 else f"{name}_{k + 1}"


def law_numbers(sized: SizedLaw) -> tuple[LawNumber, ...]:
    """Every number of a law in the order of its terms."""
    found, left = [], list(sized.sizes)
    for k, term in enumerate(sized.law.terms):
        form, unit, along = term.form, term.size_unit, "s" if term.form.timed else "1" if term.form.is_carried else "m"
        halves = (
            {"cos": "amplitude of the cosine", "sin": "amplitude of the sine"} if form.is_wave else {"size": "size"}
        )
        found += [LawNumber(number_name(n, k), unit, meaning, float(left.pop(0))) for n, meaning in halves.items()]
        at = _MEANINGS.get(form.course, "travel of its course")
        shaping = (
            ("knee", VARIABLES[form.variable][0], f"{form.variable} where its shape bends", form.knee),
            ("at", along, at, form.at),
            ("wide", along, "how long it lasts", form.wide),
            ("exponent", "1", "power of the tension", term.exponent),
        )
        found += [
            LawNumber(number_name(n, k), u, m, float(v), modifier=True) for n, u, m, v in shaping if v is not None
        ]
    return tuple(found)
