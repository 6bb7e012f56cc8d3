"""What a faultless line does not have: hooks of a fault, its parameters, courses; then twins of the library's effects.

A row of the table has the numbers of a fault and its hooks (``Fault``).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import Field, dataclass, field, fields, replace
from functools import cache
from operator import attrgetter
from typing import TYPE_CHECKING, Any, ClassVar, dataclass_transform

import numpy as np

from belt_sim.virtual_rig.line import RUN_OFF, Sections, tilt_sensitivity, unit_load
from belt_sim.virtual_rig.plan import Plan

ON_TAIL_PULLEY = np.array([[1.0], [0.0]])  # on the tail pulley only
ON_HEAD_PULLEY = np.array([[0.0], [1.0]])  # on the head pulley only


@dataclass(frozen=True, kw_only=True)
class Size:
    """SI unit of a parameter, a typical size, and the largest one that a real machine would have.

    positive: negative sizes have no meaning; place: the sensor that it belongs to; it is drawn only where the plan has
    one there.
    """

    unit: str
    typical: float
    limit: float
    positive: bool = False
    place: str = ""


def size(unit: str, typical: float, limit: float, **more: Any) -> Any:
    """A parameter of a fault that is 0 where nothing is wrong; more: as of ``Size``."""
    return field(default=0.0, metadata={"size": Size(unit=unit, typical=typical, limit=limit, **more)})


def shape(default: float, draw: Callable, grid: Callable = lambda plan: ()) -> Any:
    """A parameter that shapes a fault (a phase, a seed, a wavelength).

    draw: (plan, rng) -> its value on some machine and in a record such as the plan's; grid: plan -> values between
    which, along with its sizes, the fault is nearly linear.
    """
    return field(default=default, metadata={"draw": draw, "grid": grid})


def between(
    default: float, low: float, high: float, of: str = "", grid: Sequence[float] = (), log: bool = False
) -> Any:
    """A shape drawn evenly from ``low`` to ``high`` times ``of`` the plan (an attribute), or evenly over its logarithm;
    grid: shares of ``of``."""

    def draw(plan: Plan, rng: np.random.Generator) -> float:
        whole = attrgetter(of)(plan) if of else 1.0
        return log_uniform(rng, low * whole, high * whole) if log else rng.uniform(low, high) * whole

    return shape(default, draw, lambda plan: [share * (attrgetter(of)(plan) if of else 1.0) for share in grid])


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number drawn evenly over its logarithm."""
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


ANY_PHASE = shape(0.0, lambda plan, rng: rng.uniform(0, 2 * np.pi), lambda plan: (0.0, np.pi / 2))
ANY_SEED = shape(0, lambda plan, rng: int(rng.integers(2**31)))

#: Hook -> what it is where nothing is wrong. s: travel [m]; y, kappa, alpha: at the run-ups of the tail and the head
#: pulley, shape (2, batch).
FAULT_HOOKS: dict[str, Callable[..., Any]] = {
    "set": lambda f, line: line,  # the line with its constants changed
    "yaw": lambda f, s, line: 0.0,  # added to the yaw of the tail and the head pulley [rad], (2, batch)
    "turn": lambda f, s, line, y, kappa: 0.0,  # curvature added to kappa where the belt runs up [1/m], (2, batch)
    "recall": lambda f, s, past: 0.0,  # the same from the past of the belt (a ``march.BeltMarch``)
    # (y, alpha) at the run-ups at travels s <= 0 of tail and head, (2, ..., batch); shape (2, 2, ..., batch)
    "initial_state": lambda f, s, line: 0.0,
    "slide": lambda f, s, line, alpha: 1.0,  # factor on the lateral velocity where the belt runs up
    # how far the belt slid sideways over the wraps of tail and head that it leaves [m]; alpha: with which it ran up;
    # both of shape (2, ..., batch)
    "creep": lambda f, s, line, alpha: 0.0,
    # how the spans above (upper, (batch,)) or below are changed at one of ``span_states``
    "sections": lambda f, state, line, upper: Sections(),
    # what the change depends on at travel s (..., batch), for the span that runs to the tail or the head pulley;
    # ends: y, theta at its run-off, y, theta at its run-up, (4, ..., batch)
    "span_state": lambda f, s, line, to_tail, ends: 0.0 * line.stress,
    "loads": lambda f, line: (),  # ``UnitLoad``s on the spans
    # how much of a load acts, and what the load remembers, each (batch,); free: y at its place if nothing acted there;
    # kept: what it remembered at the last node, 0 at travel 0
    "push": lambda f, s, line, load, free, kept: (np.ones_like(free), kept),
    "true_travel": lambda f, shown, line: shown,  # true travel when the recorder shows ``shown`` [m]
    "sensor_travel": lambda f, s, line: s,  # travel at which a lateral sensor saw what it shows at s
    # how far the belt's edge lies off its middle line's parallel at a point, shape (n, batch) [m]
    "edge": lambda f, place, s, line: 0.0,
    # what a sensor at ``place`` shows instead of ``value``, at true travel s; all shape (n, batch)
    "read": lambda f, value, place, s, line: value,
}


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(size, shape))
@dataclass(frozen=True, kw_only=True)
class Fault:
    """A departure from the faultless line; parameters are SI numbers or arrays (batch,), and 0 is no fault.

    A fault is the twin of an effect, of the same id (``faults``), or unmodelled. It overrides those of ``FAULT_HOOKS``
    that it needs. An unmodelled one says where it acts, ``place``: yaw_tail, yaw_head, runup_tail, runup_head,
    runup_both, wrap, span, span_bending, span_torsion, span_tension, tension, travel, sensor_all or sensor_y1; on what
    it depends, ``variable``: travel, time_since_step, yaw, curvature, contact_angle, y, belt_phase, pulley_phase, wave,
    speed or tension; and how, ``form``: constant, linear, power, saturating, threshold, exponential, periodic or
    random; also: other pairs (variable, form) that are as right. Every subclass becomes a frozen dataclass, whose
    fields are declared by ``size``, the leading ones first, and ``shape``.
    """

    id: ClassVar[str] = ""
    sizes: ClassVar[dict[str, Size]] = {}
    #: negative sizes have no meaning
    positive: ClassVar[bool] = False
    #: nature gives the size: it is drawn as typical, never scaled, turned round or taken as linear
    fixed: ClassVar[bool] = False
    #: the sizes mean something together only, and are drawn all at once
    mixed: ClassVar[bool] = False
    #: base laws that contain it already
    part_of: ClassVar[tuple[str, ...]] = ()
    #: base laws under which it cannot act
    idle_on: ClassVar[tuple[str, ...]] = ()
    #: values of ``span_state`` at which the spans are worked out; between them they are interpolated
    span_states: ClassVar[tuple[float, ...]] = (0.0,)
    place: ClassVar[str] = ""
    variable: ClassVar[str] = ""
    form: ClassVar[str] = ""
    also: ClassVar[tuple[tuple[str, str], ...]] = ()

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, kw_only=True)(cls)
        cls.sizes = {f.name: f.metadata["size"] for f in fields(cls) if "size" in f.metadata}
        cls.positive = any(size.positive for size in cls.sizes.values())

    if TYPE_CHECKING:  # hooks, and the numbers of a row

        def __getattr__(self, name: str) -> Any: ...


for _name, _hook in FAULT_HOOKS.items():
    setattr(Fault, _name, _hook)


def has_hook(fault: Fault | type[Fault], hook: str) -> bool:
    """Whether a fault has a hook of its own."""
    return getattr(fault if isinstance(fault, type) else type(fault), hook) is not FAULT_HOOKS[hook]


def on_tail(amount: Callable, pulley: np.ndarray = ON_TAIL_PULLEY) -> Callable:
    """The hook ``turn`` or ``yaw`` of what acts on one pulley only; amount: (fault, s, line) -> [1/m] or [rad]."""
    return lambda f, s, line, *state: amount(f, s, line) * pulley


def steady(load: Callable) -> Callable:
    """The hook ``push`` of a load that remembers nothing; load: (fault, s, line) -> how much of it acts."""
    return lambda f, s, line, unit, free, kept: (load(f, s, line) + 0 * free, kept)


def fault(id: str, module: str, words: str, **given: Any) -> Any:
    """Return the class of a fault from a row of a module's table: numbers (``size``, ``shape``), hooks and facts."""
    numbers = {name: float for name, value in given.items() if isinstance(value, Field)}
    facts = {"id": id, "__doc__": words, "__module__": module, "__annotations__": numbers}
    return type(id.title().replace("_", "") + "Fault", (Fault,), facts | given)


# Courses in travel and time: steps, random walks, a machine that warms up.

COURSE_KNOTS = 400


def smooth_step(s, at, over):
    """0 up to travel ``at``, 1 from ``at + over`` on."""
    t = np.clip((s - at) / over, 0.0, 1.0)
    return t * t * (3 - 2 * t)


@cache
def random_course(seed: int) -> np.ndarray:
    """Normal numbers of 256 runs at so many knots of a course, (runs, knots)."""
    return np.random.default_rng(seed).standard_normal((256, COURSE_KNOTS))


def random_walk(f, s, line, every: float = 1.0):
    """Normal numbers (batch,) by the seed of a fault, one for every ``every`` metres of a run."""
    return random_course(f.seed)[line.run, min(int(s / every), COURSE_KNOTS - 1)]


SLOWEST_WARMING = 1e5  # [s], as good as linear in a record


def warm_up(s, line, time_constant: float):
    """tau (1 - exp(-t/tau)) [s] at travel s, t the time since travel 0."""
    return time_constant * -np.expm1(-s / line.speed / time_constant)


def any_time_constant(plan: Plan, rng: np.random.Generator) -> float:
    """Of warming up: between a tenth of the record and thrice it, or, one time in three, a linear drift."""
    drawn = math.exp(rng.uniform(math.log(0.1 * plan.duration), math.log(3 * plan.duration)))
    return SLOWEST_WARMING if rng.random() < 1 / 3 else min(max(drawn, 30.0), SLOWEST_WARMING)


TIME_CONSTANT = shape(
    SLOWEST_WARMING,
    any_time_constant,
    lambda plan: (SLOWEST_WARMING, max(30.0, 0.3 * plan.length / plan.runs[0].speed)),
)


# Hooks that many rows have.


def adds(field: str, number: str) -> Callable:
    """The hook ``set`` that adds a number of the fault to a constant of the line."""
    return lambda f, line: replace(line, **{field: getattr(line, field) + getattr(f, number)})


# The belt itself: natural curvature, weld, edge.


def _evenly_curved(curvature: Callable) -> dict[str, Any]:
    """Hooks of a belt of the same natural curvature (fault, line) all along."""

    def read(f, value, place, s, line):
        if not place.endswith("mid_span"):
            return value
        tilt = tilt_sensitivity(line, place == "upper_mid_span").mean(axis=1)
        return value + curvature(f, line) * (line.bending * line.span_length * tilt)

    def turn(f, s, line, y, kappa):  # by Betti: what the span's shape does not take up
        left = 1 - line.runup_sensitivity.mean(axis=1) * line.span_length
        return np.broadcast_to(curvature(f, line) * left, kappa.shape)

    return {"turn": turn, "read": read}


_FRICTION = 0.15  # of belt on pulley, steel on steel at its least
_LENGTH = 0.6  # [m] of a weld, wide against a step of the march
_POINTS = (np.arange(16) + 0.5) / 16 - 0.5  # quadrature over the bend
_SHAPE = 1 + np.cos(2 * np.pi * _POINTS)


def _weld_places(f, s, line):
    """How far the kink lies behind the run-off of the span to the tail and of that to the head, on its last turn."""
    place = np.where(line.direction > 0, f.at, 2 * line.span_length + line.wrap_tail - f.at) + s
    place = place + line.start
    both = place, place - line.span_length - line.wrap_tail
    return [np.mod(place + _LENGTH / 2, line.belt_length) - _LENGTH / 2 for place in both]


def _mean_curvature(place, bent, line):
    """Mean over a unit kink at ``place`` (..., batch) of the curvature ``bent`` (batch, n) along a span."""
    length = line.span_length[:, None]
    local = place[..., None] + _POINTS * _LENGTH
    inside = (local > 0) & (local < length)
    cell = np.clip((local / length) * bent.shape[1] - 0.5, 0, bent.shape[1] - 1.001)
    k, t = cell.astype(int), cell % 1
    rows = np.arange(len(bent))[:, None]
    felt = (1 - t) * bent[rows, k] + t * bent[rows, k + 1]
    return (felt * inside) @ _SHAPE / len(_SHAPE)


def _weld_turn(f, s, line, y, kappa):
    """Elastic part by Betti: a kink at x bends the run-up by minus the curvature at x per unit run-up angle; the kink
    itself counts while it runs up, so that one passage, once a belt length, turns the belt by -angle in all."""
    found = []
    for place in _weld_places(f, s, line):
        passing = (line.span_length - place) / _LENGTH
        bump = np.where(np.abs(passing) < 0.5, (1 + np.cos(2 * np.pi * passing)) / _LENGTH, 0.0)
        found.append(bump - _mean_curvature(place, line.runup_sensitivity, line))
    return f.angle * np.stack(found)


def _weld_read(f, value, place, s, line):
    if not place.endswith("mid_span"):
        return value
    upper = place == "upper_mid_span"
    behind = np.where((line.direction > 0) == upper, *_weld_places(f, s, line))
    return value + f.angle * line.bending * _mean_curvature(behind, tilt_sensitivity(line, upper), line)


PROFILE_HARMONICS, PROFILE_DECAY = 40, 1.27
FIRST_HARMONIC = 4e-4  # [m]: of the cosine and of the sine, together 0.57 mm
STEEPEST_EDGE = 1e-2  # [m]: amplitude times harmonic, that is 3 mm/m of slope on a belt of 20 m


def _edge(f, place, s, line):
    """e = sum over k of (cosk cos + sink sin)(2 pi k m / belt length), m counted backwards from what was at point 4 at
    travel 0."""
    span, wrap = line.span_length, line.wrap_tail
    along = {"point_4": 0.0 * span, "point_1": span, "point_2": span + wrap, "point_3": 2 * span + wrap}[place]
    phase = -2 * np.pi * (along - line.direction * (s + line.start)) / line.belt_length
    edge = 0.0
    for k in range(1, PROFILE_HARMONICS + 1):
        cos, sin = getattr(f, f"cos{k}"), getattr(f, f"sin{k}")
        if np.any(cos) or np.any(sin):
            edge = edge + (cos * np.cos(k * phase) + sin * np.sin(k * phase))
    return edge


# Loads beside the pulleys, and how the pulleys bend and sit.


#: a place as a share of the span's length, counted from the head to the tail pulley
_PLACE_ON_SPAN = between(0.5, 0.1, 0.9, grid=(0.15, 0.4, 0.6, 0.85))


def _guide_push(f, s, line, load, free, kept):
    """The roller and the span give way together: k (|y| - gap) back towards the middle, as far as friction of the half
    turn bears it: the push itself, and what it bends the belt by where it leaves its pulley, b/4 on average of it."""
    k = np.broadcast_to(f.stiffness if load.upper else f.stiffness_lower, free.shape)
    beyond, held = np.maximum(np.abs(free) - f.gap, 0.0), _FRICTION * np.pi * line.force
    held = np.minimum(held, held * line.width / 4 / (line.bending * np.abs(load.adds[RUN_OFF])))
    return -np.sign(free) * np.minimum(k * beyond / (1 + k * load.give), held), kept


def _askew(f, s, line):
    return (s + line.start) / line.tail_radius + f.phase


def _askew_at_first(f, s, line):
    """What has the slope -y'' = turn and no more: y' = -alpha."""
    at = _askew(f, s[0], line)
    tail = f.beta_1 * np.stack([-line.tail_radius * np.sin(at), np.cos(at)])
    return np.stack([tail, 0.0 * tail])


def _sensors(letter: str, unit: str, typical: float, limit: float, shown: Callable) -> dict[str, Any]:
    """A number of each lateral sensor; shown: (value, the number of its sensor, s, line) -> what that shows."""
    return {f"{letter}{k}": size(unit, typical, limit, place=f"point_{k}") for k in (1, 2, 3, 4)} | {
        "read": lambda f, value, place, s, line: (
            shown(value, getattr(f, letter + place[-1]), s, line) if place.startswith("point_") else value
        )
    }


_TABLE: dict[str, dict[str, Any]] = {
    "camber": {
        "words": "The belt is curved in its plane by nature.",
        "kappa_c": size("1/m", 2e-5, 1e-3),
        **_evenly_curved(lambda f, line: f.kappa_c),
    },
    "temperature_difference": {
        "words": "The edge at +y is warmer, and longer: the belt is curved towards the colder edge.",
        "difference": size("K", 0.3, 15.0),
        **_evenly_curved(lambda f, line: -12e-6 * f.difference / line.width),  # 12 ppm a kelvin
    },
    "flatness": {
        "words": "Residual stress of the strip, amplitude (1 - 12 y^2/b^2) across its width; positive: long edges.",
        "amplitude": size("Pa", 4e6, 2e7),
        "set": adds("residual", "amplitude"),
    },
    "weld": {
        "words": "A kink of the belt over a raised cosine; at travel 0 ``at`` along it from point 4 over 1, 2, 3.",
        "angle": size("rad", 2e-4, 2e-3),
        "at": between(5.64, 0.0, 1.0, "belt_length", [k / 8 for k in range(8)]),
        "turn": _weld_turn,
        "read": _weld_read,
    },
    "edge_profile": {
        "words": "The belt's edge is not straight: y + e(m) - e(m when the yaw was applied), m the part of the belt; "
        "y = 0 is where the point was then. Harmonics drawn with the spectrum of a measured edge: amplitudes fall like "
        "k^-1.27 about 0.57 mm for the first.",
        "mixed": True,
        **{
            f"{kind}{k}": size("m", FIRST_HARMONIC / k**PROFILE_DECAY, STEEPEST_EDGE / k)
            for k in range(1, PROFILE_HARMONICS + 1)
            for kind in ("cos", "sin")
        },
        "edge": _edge,
    },
    "sag_roll": {
        "words": "The sagging belt tilts instead of bending in its plane: 1 makes a flat strip the strip. The base has "
        "none of it (beam_th2) or all (strip), and the fault adds ``strength`` to it.",
        "fixed": True,
        "part_of": ("strip",),
        "strength": size("1", 1.0, 1.5),
        "set": adds("sag_roll", "strength"),
    },
    # Loads beside the pulleys: idlers, scrapers, guides, weight.
    "idler_skew": {
        "words": "A skewed idler pushes the upper span towards +y, and to the other side when the belt runs backwards.",
        "above": True,
        "force": size("N", 0.2, 50.0),
        "place": _PLACE_ON_SPAN,
        "loads": lambda f, line: (unit_load(line, f.above, "force", f.place),),
        "push": steady(lambda f, s, line: f.force * line.direction),
    },
    "side_drag": {
        "words": "A scraper drags on one edge of the upper span: a couple about the vertical, positive for the edge "
        "y > 0. The drag -D t on the edge at b/2 turns y' upwards along the travel t, whichever way the belt runs.",
        "above": True,
        "moment": size("N m", 0.5, 50.0),
        "place": _PLACE_ON_SPAN,
        "loads": lambda f, line: (unit_load(line, f.above, "couple", f.place),),
        "push": steady(lambda f, s, line: f.moment),
    },
    "off_centre_load": {
        "words": "A load beside the middle of the upper span rolls it, y > 0 down; a belt that cannot roll stays.",
        "above": True,
        "idle_on": ("beam_th2",),
        "moment": size("N", 2e-3, 1.0),
        "loads": lambda f, line: (unit_load(line, f.above, "spread_roll"),),
        "push": steady(lambda f, s, line: -f.moment),
    },
    "edge_guide": {
        "words": "Rollers on both sides of a span, ``at`` from the tail: elastic stops ``gap`` off the belt's edges.",
        "stiffness": size("N/m", 1e5, 1e7, positive=True),
        "stiffness_lower": size("N/m", 1e5, 1e7, positive=True),
        "gap": between(5e-4, 0.1, 0.6, "excursion", (0.2, 0.5)),
        "at": between(1.0, 0.15, 0.85, "machine.centre_distance.value", (0.3, 0.7)),
        "loads": lambda f, line: tuple(
            unit_load(line, upper, "force", 1 - f.at / line.span_length) for upper in (True, False)
        ),
        "push": _guide_push,
    },
    "machine_tilt": {
        "words": "The machine leans about its long axis: a share of the weight, q angle, pulls both spans towards +y.",
        "angle": size("rad", 2e-3, 0.05),
        "loads": lambda f, line: tuple(unit_load(line, upper, "spread_force") for upper in (True, False)),
        "push": steady(lambda f, s, line: f.angle * (line.density * line.gravity * line.width * line.thickness)),
    },
    # Yaw of the pulleys: set, offset, drifting, yielding.
    "yaw_offset_tail": {
        "words": "The tail pulley stands at beta_0 when zero is commanded.",
        "beta_0": size("rad", 1e-4, 2e-3),
        "set": adds("offset_tail", "beta_0"),
    },
    "yaw_offset_head": {
        "words": "The head pulley stands at beta_0 when zero is commanded.",
        "beta_0": size("rad", 1e-4, 2e-3),
        "set": adds("offset_head", "beta_0"),
    },
    "yaw_backlash": {
        "words": "The tail pulley follows its command through a play of +-half, from the middle of the play.",
        "half": size("rad", 5e-5, 5e-4, positive=True),
        "set": lambda f, line: replace(line, yaw=np.sign(line.yaw) * np.maximum(np.abs(line.yaw) - f.half, 0.0)),
    },
    "yaw_compliance": {
        "words": "The tail's bearings yield to moments and pull: yaw beta - c_m (M_1 + M_2 - F (y_1 + y_2)).",
        "c_m": size("rad/(N m)", 5e-6, 5e-5, positive=True),
        "set": adds("compliance", "c_m"),
    },
    "yaw_drift": {
        "words": "The machine warms up: the tail pulley turns by rate tau (1 - exp(-t/tau)), t since travel 0.",
        "rate": size("rad/s", 1e-6, 1e-5),
        "time_constant": TIME_CONSTANT,
        "yaw": on_tail(lambda f, s, line: f.rate * warm_up(s, line, f.time_constant)),
    },
    "unequal_tension": {
        "words": "The tensioners pull unequally on both sides: the tail turns in proportion to the belt's force.",
        "yaw_per_force": size("rad/N", 1e-7, 2e-6),
        "yaw": on_tail(lambda f, s, line: f.yaw_per_force * line.force),
    },
    # Shape and mounting of the pulleys.
    "taper": {
        "words": "The tail pulley is a cone: (dR/dy)/R = kappa_t turns the stuck belt, dtheta/ds = -(kappa + kappa_t).",
        "kappa_t": size("1/m", 2e-5, 1e-3),
        "turn": on_tail(lambda f, s, line: f.kappa_t),
    },
    "thickness_wedge": {
        "words": "The belt is thicker towards +y: its middle runs on the pulley's radius and half of it below, a cone.",
        "slope": size("1", 7e-6, 1e-4),
        "turn": lambda f, s, line, y, kappa: 0.5 * f.slope / line.radii,
    },
    "taper_drift": {
        "words": "The tail grows a taper as it warms up: kappa_t = rate tau (1 - exp(-t/tau)), t since travel 0.",
        "rate": size("1/(m s)", 2e-7, 5e-6),
        "time_constant": TIME_CONSTANT,
        "turn": on_tail(lambda f, s, line: f.rate * warm_up(s, line, f.time_constant)),
    },
    "build_up": {
        "words": "Dirt grows on one side of the tail pulley with the travel: a taper kappa_t = rate s.",
        "rate": size("1/m2", 5e-7, 1e-5),
        "turn": on_tail(lambda f, s, line: f.rate * s),
    },
    "crown": {
        "words": "The tail pulley is thicker in its middle: a taper -c y.",
        "c": size("1/m2", 5e-3, 0.5),
        "turn": lambda f, s, line, y, kappa: -f.c * y * ON_TAIL_PULLEY,
    },
    "pulley_deflection": {
        "words": "Both pulleys bend under the pull as beams do: at y each is yawed by compliance F y, the ends apart.",
        "compliance": size("1/(N m)", 1e-6, 5e-6, positive=True),
        "set": adds("deflection", "compliance"),
    },
    "cant": {
        "words": "The tail's axis rises by gamma towards +y: it shifts the belt on its wrap and rolls the spans.",
        "gamma": size("rad", 1e-3, 5e-3),
        "set": adds("cant", "gamma"),
        "loads": lambda f, line: tuple(unit_load(line, upper, "roll_at_tail") for upper in (True, False)),
        "push": steady(lambda f, s, line: f.gamma),
    },
    # The tail pulley sits askew on its shaft: its axis describes a cone of half angle beta_1 about the bearings' axis.
    # Put the cylinder's axis through the pulley's middle, turned from the shaft's by beta_1 towards the material angle
    # q (from the shaft's +y, seen along it). A generator at the material angle a then stands R + beta_1 y cos(a - q)
    # from the shaft. Where the belt runs up, a falls by s/R; the belt beside, y further out, is wound up on that much
    # more radius and gets ahead: per metre it turns back by the radius's slope over R. The surface turns in itself, and
    # rolls the spans' ends by beta_1 sin. Before travel 0 the belt ran straight round the cylinder, that is along the
    # shaft's wave. Seen from above the axis swings by beta_1 cos(s/R + phase): the slope is a quarter turn late.
    "wobble": {
        "words": "The tail pulley sits askew on its shaft.",
        "beta_1": size("rad", 1e-3, 2e-3),
        "phase": ANY_PHASE,
        "turn": on_tail(lambda f, s, line: f.beta_1 * np.cos(_askew(f, s, line) - np.pi / 2) / line.tail_radius),
        "loads": lambda f, line: tuple(unit_load(line, upper, "roll_at_tail") for upper in (True, False)),
        "push": steady(lambda f, s, line: line.direction * f.beta_1 * np.sin(_askew(f, s, line))),
        "initial_state": _askew_at_first,
    },
    # How the pulleys hold the belt: friction, cover, film, bending layer.
    "slip": {
        "words": "Both pulleys hold the belt by friction, given as 1/mu; 0 = they hold any moment. At each change of "
        "yaw the run-ups let go once, and the run-offs let go all the time (march.py).",
        "inverse_friction": size("1", 1 / _FRICTION, 20.0, positive=True),
        "set": lambda f, line: replace(line, slippery=np.maximum(line.slippery, f.inverse_friction)),
    },
    "soft_cover": {
        "words": "Both pulleys yield under the entry moment M: dtheta/ds = -(kappa + c M).",
        "c": size("1/(N m2)", 5e-6, 2e-4, positive=True),
        "set": adds("cover", "c"),
    },
    "traction_loss": {
        "words": "A film above a speed: the belt follows its contact angle in part, by 1 - loss (v - onset), on both.",
        "loss": size("s/m", 0.2, 1.0, positive=True),
        "onset": between(0.0, 0.0, 0.8, "largest_speed", (0.0, 0.7)),
        "slide": lambda f, s, line, alpha: np.maximum(1 - f.loss * np.maximum(line.speed - f.onset, 0.0), 0.0),
    },
    "lift_off": {
        "words": "A belt that resists bending leaves its pulleys along a layer: the ends of its spans give way to "
        "their couples, unlike above and below. 1 is the layer of the belt's own plate stiffness; nothing is fitted.",
        "fixed": True,
        "strength": size("1", 1.0, 1.5),
        "set": adds("layer", "strength"),
    },
    # Tension and speed.
    "tension_bias": {
        "words": "The load cell errs: true tension sigma (1 + gain) + bias.",
        "gain": size("1", 0.1, 0.3),
        "bias": size("Pa", 5e5, 3e6),
        "set": lambda f, line: replace(line, stress=line.stress * (1 + f.gain) + f.bias),
    },
    "speed_tension": {
        "words": "Centrifugal tension: the spans feel sigma - share rho v^2.",
        "share": size("1", 1.0, 1.5, positive=True),
        "set": lambda f, line: replace(line, stress=line.stress - f.share * line.density * line.speed**2),
    },
    # Sensors and recorder.
    "sensor_offset": {
        "words": "The sensor at point k shows y + ck in every run.",
        **_sensors("c", "m", 5e-4, 2e-2, lambda value, c, s, line: value + c),
    },
    "sensor_gain": {
        "words": "The sensor at point k shows (1 + gk) y.",
        **_sensors("g", "1", 0.05, 0.3, lambda value, g, s, line: value * (1 + g)),
    },
    "sensor_drift": {
        "words": "The sensor at point k shows y + dk t, t since the yaw was applied.",
        **_sensors("d", "m/s", 5e-6, 2e-5, lambda value, d, s, line: value + d * (s - line.yaw_at) / line.speed),
    },
    "sensor_delay": {
        "words": "Every lateral reading shows what was there ``delay`` seconds ago.",
        "delay": size("s", 1.5, 5.0, positive=True),
        "sensor_travel": lambda f, s, line: s - f.delay * line.speed,
    },
    "encoder_scale": {
        "words": "The recorder shows (1 + e) s.",
        "e": size("1", 0.02, 0.1),
        "set": lambda f, line: replace(line, yaw_at=line.yaw_at / (1 + f.e)),
        "true_travel": lambda f, shown, line: shown / (1 + f.e),
    },
}
for _load in ("idler_skew", "side_drag", "off_centre_load"):  # the same on the lower span
    _TABLE[f"{_load}_lower"] = _TABLE[_load] | {"above": False}

#: faults by id, in alphabetical order: random draws depend on it
CATALOGUE: dict[str, type[Fault]] = {id: fault(id, __name__, **_TABLE[id]) for id in sorted(_TABLE)}
globals().update({cls.__name__: cls for cls in CATALOGUE.values()})  # where another process looks for them
