"""A law found in data: its terms (where each acts, what it reads, how it goes along the travel, and its numbers), as
an effect, and as an entry of an effects.yaml.

Every term adds, at its place,

    u = size x shape(variable) x course(s) x (tension / reference tension)^exponent,    s: travel [m] or time [s].

The search for laws (``belt_sim.discovery``) fits such terms. The functions of SHAPES and COURSES hold for NumPy and JAX
arrays alike.
"""

import hashlib
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, make_dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar, NoReturn

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.effects.base import Effect, Parameter, effect
from belt_sim.effects.belt_shape import add_natural
from belt_sim.errors import InputError, finite, flag
from belt_sim.line.influence import stretch_adds, stretch_ends, stretch_response
from belt_sim.line.runup import add, angle_at
from belt_sim.line.span import log_of_change, response, response_by_change

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
        lambda s, at, wide, xp: 1.0 / (1.0 + xp.exp((xp.abs((s - at + 0.5) % 1.0 - 0.5) - 0.5 * wide) / 0.01)),
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


# As an effect: the terms say which hooks the class has; the hooks below evaluate them.


ID = "generic_law"
CLASSES = 256  # of effects that a process keeps
REACH = 0.25  # [m] of travel either way, over which a reading is differentiated
#: kind of place -> the law that an effect there changes, and the hook that changes it
_ACTS = {
    "yaw": ("drive", "yaw"),
    "turn": ("run-up", "runup"),
    "drift": ("run-up", "runup"),
    SPAN: ("run-up", "runup"),
    "shift": ("wrap", "wrap"),
    "twist": ("wrap", "wrap"),
    **dict.fromkeys(RELATIVE, ("span", "bend")),
    TRAVEL: ("sensor", "encoder"),
    SENSOR: ("sensor", "sensor"),
}


class GenericLaw(Effect):
    """Base of the effects that ``law_effect`` makes. content: the law; numbers: what its parameters stand for."""

    reference: ClassVar[str] = "found in data"
    content: ClassVar[SizedLaw]
    numbers: ClassVar[tuple[LawNumber, ...]]

    def terms(self, *kinds: str) -> list[tuple[int, Term]]:
        """Return the terms at places of these kinds, with their positions in the law."""
        return [(k, t) for k, t in enumerate(self.content.law.terms) if t.place.kind in kinds]

    def strength(self, k: int, x: Any, s: Any, case: Any) -> Any:
        """Return what the k-th term adds where its variable is x, at travel [m], time [s] or part of the belt s."""
        form = self.content.law.terms[k].form
        knee, at, wide = (getattr(self, number_name(n, k), None) for n in ("knee", "at", "wide"))
        if form.is_wave:
            cos, sin = getattr(self, number_name("cos", k)), getattr(self, number_name("sin", k))
            along = cos * form.course_value(s, jnp, at, wide) + sin * form.sine().course_value(s, jnp, at, wide)
        else:
            along = getattr(self, number_name("size", k)) * form.course_value(s, jnp, at, wide)
        return along * form.shape_value(x, s, jnp, knee) * self.tension_factor(k, case)

    def tension_factor(self, k: int, case: Any) -> Any:
        """Return (tension / reference tension)^exponent of the k-th term."""
        return (case.settings.tension / self.content.tension) ** getattr(self, number_name("exponent", k))


@lru_cache(CLASSES)
def law_effect(content: SizedLaw, id: str = ID) -> type[GenericLaw]:
    """Return the effect class of a law; the same law gives the same class, so that it is compiled once.

    Its parameters are the numbers of the law, with the law's values as defaults; sizes are null at 0.
    """
    numbers, terms = law_numbers(content), content.law.terms
    parameters = {}
    for n in numbers:
        scale = abs(n.value) or 1.0
        ends = (n.value / 10.0, n.value * 10.0) if n.modifier else (-10.0 * scale, 10.0 * scale)
        low, high, scale = (-4.0, 4.0, 1.0) if n.name.startswith("exponent") else (min(ends), max(ends), scale)
        null = n.value if n.modifier else 0.0
        common = Parameter(unit=n.unit, meaning=n.meaning, plausible=(low, high), scale=scale, null=null)
        parameters[n.name] = replace(common, modifier=n.modifier)
    hooks = {_ACTS[t.place.kind][1]: _HOOKS[_ACTS[t.place.kind][1]] for t in terms}
    namespace = {
        "id": id,
        "title": "A law found in data: " + ", ".join(dict.fromkeys(t.place.words for t in terms)),
        "stage": 3,  # it was found beside all others
        "law": _ACTS[terms[0].place.kind][0],
        "parity": content.law.parity,
        "parameters": parameters,
        "content": content,
        "numbers": numbers,
        **hooks,
        **({"influence": _influence} if "bend" in hooks else {}),
        **({"scene": _scene} if _has_geometry(terms) else {}),
    }
    # JAX tells effects apart by their names (see belt_sim.case.pytree)
    name = f"GenericLaw_{hashlib.sha256(repr((id, content)).encode()).hexdigest()[:16]}"
    fields = [(n.name, float, field(default=n.value)) for n in numbers]
    cls = make_dataclass(name, fields, bases=(GenericLaw,), namespace=namespace, frozen=True, kw_only=True)
    cls.__module__ = __name__
    made: type[GenericLaw] = effect(cls)
    return made


# --- what a term reads ------------------------------------------------------------------------------------------------


def _belt_part(case, travel):
    """The part of the belt that runs up the tail and the head pulley (2,), in belt lengths from the one that is at the
    tail pulley when a forward run starts."""
    span, wrap = case.rig.span_length, case.rig.wrap_tail
    ahead, back = travel - jnp.stack([0.0 * span, span + wrap]), jnp.stack([-wrap, span]) - travel
    return jnp.where(case.settings.direction > 0, ahead, back) / case.rig.belt_length


def _independent(term: Term, travel, case):
    """The variable of a term that does not depend on where the belt runs, at a travel or at travels (n,)."""

    def commanded(s):
        return angle_at(case.settings.yaw, s) + angle_at(case.settings.yaw_head, s)

    if term.form.variable == "none":
        return 1.0
    if term.form.variable == "yaw_set":
        return jnp.where(travel >= case.settings.yaw.at[0], 1.0, 0.0)
    if term.form.variable == "sigma":
        return case.settings.tension
    return jax.vmap(commanded)(travel) if jnp.ndim(travel) else commanded(travel)


def _course_variable(term: Term, travel, case, pulley: int | slice | None = slice(None)):
    """What the course of a term goes with: travel [m], time [s], or the part of the belt that runs up a pulley."""
    if term.form.is_carried:
        return _belt_part(case, travel)[pulley]
    s = jnp.maximum(travel - case.settings.yaw.at[0], 0.0) if term.form.since_yaw else travel
    return s / case.settings.speed if term.form.timed else s


# --- hooks ------------------------------------------------------------------------------------------------------------


def _at_pulleys(self: GenericLaw, terms: Sequence[tuple[int, Term]], state, case, landed=None):
    """Yield (term, pulley, what it adds there); landed: the belt that leaves a pulley, as it ran up."""
    for k, t in terms:
        for _, pulley in t.place.parts:
            v = t.form.variable
            if not t.form.reads_belt:
                x = _independent(t, state.travel, case)
            elif t.place.kind not in WRAPPED:
                x = getattr(state, v)[pulley]
            else:
                x = landed.moment[pulley] / case.belt.bending_stiffness if v == "kappa" else getattr(landed, v)[pulley]
            added = self.strength(k, x, _course_variable(t, state.travel, case, pulley), case)
            if t.place.kind == SPAN:  # on the pulley that it runs up
                up = 1.0 if SPANS[pulley or 0] == t.place.where else -1.0
                added = jnp.where(case.settings.direction * up > 0.0, added, 0.0)
            yield t, pulley, added


def _adds(**fields: str) -> Callable[..., Any]:
    """Return a hook that adds the terms at places of some kinds; fields: kind -> field of what the hook changes."""

    def hook(self, value, state, case):
        landed = value
        for t, pulley, added in _at_pulleys(self, self.terms(*fields), state, case, landed):
            of_both = {fields[t.place.kind]: jnp.zeros(2).at[pulley].set(added)}
            value = add(value, **({PULLEYS[pulley]: added} if t.place.kind == "yaw" else of_both))
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
    answer, changes, stretches = known
    shares: dict[str, Any] = {}
    for k, t in self.terms(*RELATIVE):
        if t.place.is_stretch:
            bend = _bend_stretch(self, k, bend, boundary, stretches[t.place.relative], case)
            continue
        if t.form.variable == "y":
            x = boundary.start + boundary.ends[0]
        elif t.form.variable == "kappa":
            x = answer.runup @ boundary.ends + bend.runup
        elif t.form.variable == "kappa_mean":
            x = (boundary.ends[2] - boundary.ends[1]) / case.rig.span_length
        else:
            x = _independent(t, boundary.travel, case)
        added = self.strength(k, x, _course_variable(t, boundary.travel, case), case)
        if t.place.where in SPANS:
            first = jnp.array([t.place.where == s for s in SPANS])
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
    return bend


def _bend_stretch(self, k: int, bend, boundary, response, case):
    """Add what the k-th term, the stiffness of a stretch of the belt, does to both spans."""
    size, at, wide = (getattr(self, number_name(n, k)) for n in ("size", "at", "wide"))
    jump = -size * self.tension_factor(k, case) * case.rig.span_length
    part = _belt_part(case, boundary.travel)
    behind = (at - part) * case.settings.direction
    lies = stretch_ends(case.rig.span_length, case.rig.belt_length, behind, wide)
    per_end, more = stretch_adds(response, jump, wide * case.rig.belt_length, lies)
    added = jnp.einsum("ais,is->as", per_end, boundary.ends[:3])
    if response.ends is None:
        return add_natural(bend, added, (0.0, 0.0))
    leaves = part - case.settings.direction * case.rig.span_length / case.rig.belt_length  # the part at the run-off
    here = (COURSES["belt_section"][1](place, at, wide, jnp) for place in (part, leaves))
    ends = zip(here, response.ends @ boundary.ends[:3] + added[:2], strict=True)
    return add_natural(bend, added, [more * inside * elastic for inside, elastic in ends])


def _encoder(self, travel, case):
    return travel + sum(
        self.strength(k, _independent(t, travel, case), _course_variable(t, travel, case), case)
        for k, t in self.terms(TRAVEL)
    )


def _sensor(self, reading, case):
    added = jnp.zeros_like(reading.y)
    for k, t in self.terms(SENSOR):
        for row in (point - 1 for point in t.place.points):
            if t.form.variable == "reading":
                x = reading.y[row]
            elif t.form.variable == "reading_rate":  # dy/dt [m/s]
                order = jnp.argsort(reading.sensor_travel)
                s, y = reading.sensor_travel[order], reading.y[row][order]
                low, high = (jnp.clip(reading.sensor_travel + h, s[0], s[-1]) for h in (-REACH, REACH))
                x = (jnp.interp(high, s, y) - jnp.interp(low, s, y)) / (high - low) * case.settings.speed
            else:
                x = _independent(t, reading.sensor_travel, case)
            added = added.at[row].add(self.strength(k, x, _course_variable(t, reading.sensor_travel, case), case))
    return add(reading, y=added)


def _has_geometry(terms: Sequence[Term]) -> bool:
    """Whether pulleys have a shape for every term that acts on the march: a yaw, a taper or a crown that stays."""
    acting = [t for t in terms if _ACTS[t.place.kind][0] != "sensor"]
    return bool(acting) and all(
        t.form.course == "constant"
        and (
            (t.place.kind in ("yaw", "turn") and t.form.variable in ("none", "sigma"))
            or (t.place.kind == "turn" and t.form.variable == "y" and t.form.shape == "linear")
        )
        for t in acting
    )


def _scene(self, parts, case):
    for k, t in self.terms("yaw", "turn"):
        y = t.form.variable == "y"
        value = float(self.strength(k, 1.0 if y else _independent(t, 0.0, case), 0.0, case))
        name, value = ("yaw_offset", value) if t.place.kind == "yaw" else ("crown", -value) if y else ("taper", value)
        for pulley in (PULLEYS[p or 0] for _, p in t.place.parts):
            parts = parts.add_to_pulley(pulley, **{name: value})
    return parts


_HOOKS = {
    "yaw": _adds(yaw=""),
    "runup": _adds(turn="turn", drift="drift", **{SPAN: "turn"}),
    "wrap": _adds(shift="y", twist="alpha"),
    "bend": _bend,
    "encoder": _encoder,
    "sensor": _sensor,
}


# As an entry of an effects.yaml.


WIDTH = 110  # columns of a comment
NUMBERS = ("size", "cos", "sin", "knee", "at", "wide", "exponent")
KEYS = ("place", "points", "variable", "shape", "course", "timed", *NUMBERS)
STEEPEST = 10.0  # exponent of the tension
POINTS = (1, 2, 3, 4)


def law_entry(effect: GenericLaw) -> dict[str, Any]:
    """Return the law of an effect with its numbers, as an entry of an effects.yaml."""
    terms = []
    for k, t in enumerate(effect.content.law.terms):
        form, points = t.form, list(t.place.points)
        term: dict[str, Any] = {"place": SENSOR, "points": points} if points else {"place": t.place.name}
        term |= {"variable": form.variable} | ({"shape": form.shape} if form.variable != "none" else {})
        term |= {"course": form.course} | ({"timed": True} if form.timed else {})
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
            "course": COURSES[t.form.course][0],
        }
        if not t.form.is_carried and t.form.course != "constant":  # what s is in the formula
            since = " since the yaw was set" if t.form.since_yaw else ""
            words["course"] += f", s: time{since} [s]" if t.form.timed else f", s: travel{since} [m]"
        for name, value in term.items():
            number = numbers.get(number_name(name, k))
            comment = words.get(name, "")
            if number is not None:
                u = uncertainty.get(number.name)
                parts = number.unit if number.unit != "1" else "", number.meaning, f"+- {u:.2g}" if u else ""
                comment = ", ".join(part for part in parts if part)
            text = yaml_number(value) if number else str(value).lower() if name == "timed" else str(value)
            lines.append(
                f"      {'- ' if name == 'place' else '  '}{name}: {text}{'  # ' + comment if comment else ''}"
            )
    return lines


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
    beyond = ("reading", "reading_rate") if place.kind == SENSOR else () if place.kind == TRAVEL else ("y", "kappa")
    at_pulleys = place.kind not in (SENSOR, TRAVEL, *RELATIVE)
    own = ("alpha",) if at_pulleys else ("kappa_mean",) if place.relative else ()
    variables = ["none"] if place.is_stretch else ["none", "yaw_set", "beta", "sigma", *beyond, *own]
    variable = _choice(one, "variable", where, variables, "none")
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
