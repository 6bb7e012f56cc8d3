"""The contract of an effect: a frozen dataclass of SI parameters that changes one of the five laws.

A new effect is one file: subclass ``Effect``, decorate with ``@effect``, give ``law`` and ``reference``,
declare its numbers with ``parameter``, and override the hook of its law. Every hook returns its first argument changed;
with null parameters it must return it unchanged, bit for bit. The hook ``scene`` is the geometric half of an effect: it
gives the parts of a 3D scene (``belt_sim.scene_parts``) with its own change; the 3D models refuse an effect that acts
between drive and sensor without it.
"""

import re
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar, dataclass_transform

from belt_sim.case import Case, Settings, pytree
from belt_sim.errors import BeltError, InputError
from belt_sim.line.influence import Bend, BoundaryValues
from belt_sim.line.runup import Contact, Reading, RunOff, RunUp, State, Yaw
from belt_sim.line.span import Response, Span
from belt_sim.scene_parts import SceneParts
from belt_sim.units import shop_unit

LAWS = ("span", "run-up", "wrap", "drive", "sensor")
#: hooks of an effect by who calls them: before an engine, an analytic engine, a 3D engine, after an engine
BEFORE_ENGINE = ("settings",)
IN_MARCH = ("span", "hold", "bend", "yaw", "runup", "slide", "wrap")
IN_SCENE = ("scene",)
AFTER_ENGINE = ("encoder", "sensor_travel", "sensor")
HOOKS = (*BEFORE_ENGINE, *IN_MARCH, *IN_SCENE, *AFTER_ENGINE)
#: the laws that a hook may change; the scene is the geometric half of any of them
LAW_OF_HOOK = {
    "settings": ("drive",),
    "span": ("span",),
    "hold": ("run-up",),
    "bend": ("span",),
    "yaw": ("drive", "run-up", "wrap"),
    "runup": ("run-up",),
    "slide": ("run-up",),
    "wrap": ("wrap",),
    "encoder": ("sensor",),
    "sensor_travel": ("sensor",),
    "sensor": ("sensor",),
}


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One number of an effect: SI unit, meaning, plausible range (low, high) of a real machine, null value.

    scale: a size that matters on a real machine, to start a search from; modifier: True for a number that moves
    nothing by itself and only shapes what the others do; grid: values [SI] of a modifier that a search tries one by
    one, each as an alternative of the same effect; of_belt: True where these are shares of the belt's length; shop:
    (units of the shop in one of ``unit``, their name), where reports write it otherwise than other numbers of the unit.
    """

    unit: str
    meaning: str
    plausible: tuple[float, float]
    scale: float
    null: float = 0.0
    modifier: bool = False
    grid: tuple[float, ...] = ()
    of_belt: bool = False
    shop: tuple[float, str] | None = None

    @property
    def display_unit(self) -> tuple[float, str]:
        """Units of the shop in one ``unit``, and their name: how reports write the number."""
        return self.shop or shop_unit(self.unit)


def parameter(unit: str, meaning: str, *, default: float | None = None, **more: Any) -> Any:
    """Declare a number of an effect as a field of its class; default: null unless stated; more: as ``Parameter``."""
    declared = Parameter(unit=unit, meaning=meaning, **more)
    return field(default=declared.null if default is None else default, metadata={"parameter": declared})


@dataclass(frozen=True)
class Cause:
    """What an effect means at the machine.

    phrase: the fault as a clause, with {pulley} where it may be on either; parts: ids of the report's sketch that it is
    at; check: what to look at; of_model: the machine is sound, and the model left something out.
    """

    phrase: str
    parts: tuple[str, ...]
    check: str
    of_model: bool = False


PERCENT = (100.0, "%")  # of a share
METRES = (1.0, "m")  # of a place along the machine
TURN_OVER = "Turn the belt over: what changes sides with it belongs to the belt, what stays to the machine."
CHECK_MODEL = "Nothing on the machine. Use a model that has this built in, or add the effect with effects.yaml."
CHECK_DIAMETERS = (
    "Measure the {pulley} pulley's diameter at both sides and in the middle with a pi tape. A difference "
    "below some 10 µm shows in the belt only: steer against it."
)


@dataclass(frozen=True, kw_only=True)
class Effect:
    """Base of all effects; see the module's text."""

    #: its name in files and on the command line; empty: of the class, ``YawDrift`` is yaw_drift
    id: ClassVar[str] = ""
    #: the effect in a few words; empty: the first line of its file
    title: ClassVar[str] = ""
    law: ClassVar[str] = ""
    reference: ClassVar[str] = ""
    #: "odd", "even" or "mixed": how dy changes when the sign of every yaw changes
    parity: ClassVar[str] = "mixed"
    #: exponent n of the late rate ~ tension^n at high tension; None = not a power law
    tension_exponent: ClassVar[float | None] = None
    #: True for what belongs to the belt and changes sides when the belt is turned over
    on_belt: ClassVar[bool] = False
    #: True for what comes round with the belt or a pulley, so that it matters where on the belt a run starts
    comes_round: ClassVar[bool] = False
    #: belt revolutions that a record must cover before the effect can be told from a slow movement
    min_revolutions: ClassVar[float] = 0.0
    #: what a model must have for the effect to act: "moment" (bending moments at the pulleys; such effects are called
    #: last), "sag" (spans that hang and roll), "width" (a belt that takes couples)
    needs: ClassVar[frozenset[str]] = frozenset()
    #: its place in the physical chain among effects that change the same law; the order in which a user names effects
    #: does not matter
    stage: ClassVar[int] = 0
    #: how reports tell of it to people at the machine; without one they name the effect and its law
    cause: ClassVar[Cause | None] = None
    parameters: ClassVar[dict[str, Parameter]] = {}

    def settings(self, settings: Settings, case: Case) -> Settings:
        """Drive law: return the actual tension and yaw schedules for the commanded ones."""
        return settings

    def span(self, span: Span, case: Case) -> Span:
        """Span law: return the properties of the span."""
        return span

    def hold(self, answer: Response, span: Span, case: Case) -> Response:
        """Run-up law: return the responses of the supported spans; rows (2, 5), span up the tail first."""
        return answer

    def influence(self, span: Span, case: Case) -> Any:
        """Return what ``bend`` needs of a span, computed once before a march."""
        return None

    def bend(self, bend: Bend, boundary: BoundaryValues, known: Any, case: Case) -> Bend:
        """Span law: return the curvature added inside the spans; known: the result of ``influence``."""
        return bend

    def yaw(self, yaw: Yaw, state: State, case: Case) -> Yaw:
        """Drive and run-up law: return the pose of the pulleys at this travel."""
        return yaw

    def runup(self, runup: RunUp, state: State, case: Case) -> RunUp:
        """Run-up law: return the terms added to dy/ds and dalpha/ds."""
        return runup

    def slide(self, contact: Contact, state: State, case: Case) -> Contact:
        """Run-up law: return the position at the run-ups after the belt has slid on the pulleys, at one instant."""
        return contact

    def wrap(self, runoff: RunOff, state: State, case: Case) -> RunOff:
        """Wrap law: return the state of the belt where it leaves the pulleys."""
        return runoff

    def scene(self, parts: SceneParts, case: Case) -> SceneParts:
        """3D scene: return the parts from which the scene is built."""
        return parts

    def encoder(self, travel, case: Case):
        """Sensor law: return the true belt travel [m] when the encoder shows ``travel`` [m]."""
        return travel

    def sensor_travel(self, travel, case: Case):
        """Sensor law: return the belt travel [m] that the lateral sensors show while the belt is at ``travel`` [m]."""
        return travel

    def sensor(self, reading: Reading, case: Case) -> Reading:
        """Sensor law: return the indicated readings."""
        return reading

    @classmethod
    def columns(cls, sensor_travel, case: Case):
        """Return what a unit of each parameter adds to y at points 1-4, shape (parameters, 4, n).

        Only effects that add to the lateral readings in proportion to their parameters, and do nothing else, have it.
        sensor_travel: belt travels [m] that the sensors show, shape (n,).
        """
        raise NotImplementedError(cls.id)

    @classmethod
    def is_additive(cls) -> bool:
        """Return whether the effect only adds to the readings in proportion to its parameters (has ``columns``)."""
        return cls.columns.__func__ is not Effect.columns.__func__  # type: ignore[attr-defined]

    @classmethod
    def null(cls) -> "Effect":
        """Return the effect with null parameters, which does nothing."""
        return cls(**{name: p.null for name, p in cls.parameters.items()})

    def is_null(self) -> bool:
        """Return whether every parameter has its null value."""
        return all(float(getattr(self, n)) == p.null for n, p in self.parameters.items())


@dataclass_transform(frozen_default=True, kw_only_default=True)
def effect(cls):
    """Make a frozen dataclass of an effect class, check its declaration, and register it as a JAX pytree.

    The class may also be a dataclass already that lists its numbers in ``parameters``.
    """
    if "seen" in vars(cls):  # what the hook was called in version 0.1
        cls.sensor_travel = cls.seen
        del cls.seen
    if "id" not in vars(cls):
        cls.id = re.sub("(?<!^)(?=[A-Z])", "_", cls.__name__).lower()
    if "__dataclass_fields__" not in vars(cls):
        cls = dataclass(frozen=True, kw_only=True)(cls)
    declared = {f.name: f.metadata["parameter"] for f in fields(cls) if "parameter" in f.metadata}
    cls.parameters = {**cls.parameters, **declared}
    if cls.law not in LAWS:
        raise InputError(f"{cls.__name__}.law", repr(cls.law), "", f"use one of {', '.join(LAWS)}")
    names = {f.name for f in fields(cls)}
    if names != set(cls.parameters):
        raise InputError(f"{cls.__name__}.parameters", sorted(names ^ set(cls.parameters)), "", "declare each once")
    if hidden := names & {*HOOKS, "influence"}:
        raise InputError(f"{cls.__name__}.parameters", sorted(hidden), "", "hooks have these names; choose others")
    cls.declared = True
    return pytree(cls)


def overrides(effect: Effect | type[Effect], hooks: Sequence[str] = HOOKS) -> set[str]:
    """Return which of ``hooks`` an effect overrides."""
    cls = effect if isinstance(effect, type) else type(effect)
    return {hook for hook in hooks if getattr(cls, hook) is not getattr(Effect, hook)}


def uses(effects: Sequence[Effect], hook: str) -> list:
    """Return those of ``effects`` that override ``hook``, in the physical order in which to call them."""
    return sorted((e for e in effects if overrides(e, (hook,))), key=lambda e: ("moment" in e.needs, e.stage, e.id))


def apply_hook(effects: Sequence[Effect], hook: str, value: Any, *context: Any) -> Any:
    """Return ``value`` as those of ``effects`` that override ``hook`` change it, one after another."""
    for e in uses(effects, hook):
        value = call_hook(e, hook, value, *context)
    return value


def call_hook(effect: Effect, hook: str, *arguments: Any) -> Any:
    """Return what a hook of an effect returns; an error in a user's own file is an InputError with its line."""
    path = getattr(type(effect), "source_file", None)
    function = getattr(effect, hook)
    if path is None:
        return function(*arguments)
    try:
        answer = function(*arguments)
    except BeltError:
        raise
    except Exception as error:
        kind = type(error).__name__
        remedy = _REMEDIES.get(kind) or str(error).splitlines()[0]
        raise wrong_file(Path(path), line_of(error, Path(path)), f"{hook}: {kind}: {remedy}") from error
    if answer is None:
        line = function.__func__.__code__.co_firstlineno
        raise wrong_file(
            Path(path), line, f"{hook} returns nothing; end it with return and its first argument, changed"
        )
    return answer


#: what JAX says of a value that is not there yet -> what to write instead
_REMEDIES = {
    "TracerBoolConversionError": "write jnp.where(condition, a, b) for 'if'",
    "TracerArrayConversionError": "use jax.numpy for numpy",
    "ConcretizationTypeError": "use jax.numpy, and no float() or int() of it",
    "TracerIntegerConversionError": "use jax.numpy, and no int() of it",
}


def line_of(error: BaseException, path: Path) -> int:
    """The last line of the file that an error came through."""
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
    return lines[-1] or 1 if lines else 1


def wrong_file(path: Path, line: int, what: str) -> InputError:
    """What is wrong with a user's own effect file."""
    return InputError("effects", f"{path}, line {line}", "", what)
