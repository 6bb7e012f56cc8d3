"""What a faultless line does not have: hooks of a fault, its parameters, and courses that several follow."""

import math
from collections.abc import Callable, Sequence
from dataclasses import Field, dataclass, field, fields
from functools import cache
from operator import attrgetter
from typing import TYPE_CHECKING, Any, ClassVar, dataclass_transform

import numpy as np

from belt_sim.virtual_rig.line import Sections
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
    "yaw": lambda f, s, line: 0.0,  # added to the tail pulley's yaw [rad]
    "yaw_head": lambda f, s, line: 0.0,  # added to the head pulley's yaw [rad]
    "turn": lambda f, s, line, y, kappa: 0.0,  # curvature added to kappa where the belt runs up [1/m], (2, batch)
    "recall": lambda f, s, past: 0.0,  # the same from the past of the belt (a ``march.BeltMarch``)
    # (y, alpha) at the run-ups of tail and head at travels s <= 0 (..., batch), shape (4, ..., batch)
    "initial_state": lambda f, s, line: 0.0,
    "slide": lambda f, s, line, alpha: 1.0,  # factor on the lateral velocity where the belt runs up
    # how far the belt slid sideways over the wraps of tail and head that it leaves [m]; alpha: with which it ran up;
    # both of shape (2, ..., batch)
    "creep": lambda f, s, line, alpha: 0.0,
    "tension": lambda f, s, line: 0.0,  # relative change of the tension, within ``swing``
    # how the spans above (upper, (batch,)) or below are changed at one of ``span_states``
    "sections": lambda f, state, line, upper: Sections(),
    # what the change depends on at travel s (..., batch), for the span that runs to the tail or the head pulley;
    # ends: (y, theta) at its run-off and at its run-up, each (2, ..., batch)
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
    #: the least and the largest relative change of the tension
    swing: ClassVar[Any] = (0.0, 0.0)
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


def on_tail(amount: Callable) -> Callable:
    """The hook ``turn`` of what turns the belt on the tail pulley only; amount: (fault, s, line) -> [1/m]."""
    return lambda f, s, line, y, kappa: amount(f, s, line) * ON_TAIL_PULLEY


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
