"""What an effect may change of a model, hook by hook, and who calls the hooks: before, in and after an engine.

Every engine runs this way -- drive, engine, sensor -- and the fit of a campaign traces the same functions.
"""

import traceback
from collections.abc import Callable, Iterable, Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, TypeVar

import jax.numpy as jnp
import numpy as np
from jax import lax

from belt_sim.case import Case, Schedule, Settings
from belt_sim.curves import ALONG, Curves
from belt_sim.errors import BeltError, InputError
from belt_sim.jax_setup import in_float64
from belt_sim.line.runup import Contact, Reading, RunOff, RunUp, State, Yaw
from belt_sim.line.span import Bend, BoundaryValues, Response, Span
from belt_sim.scene_parts import SceneParts

LAW_NAMES = ("span", "run-up", "wrap", "drive", "sensor")


class Hook(NamedTuple):
    """Who calls a method of ``Hooks``: before an engine, once in a march, at every step of one, in a 3D scene, or after
    an engine; laws: those of which one is the effect's own."""

    called: str
    laws: tuple[str, ...]


HOOKS = {
    "settings": Hook("before", ("drive",)),
    "span": Hook("march", ("span",)),
    "hold": Hook("march", ("run-up",)),
    "bend": Hook("step", ("span",)),
    "yaw": Hook("step", ("drive", "run-up", "wrap")),
    "runup": Hook("step", ("run-up",)),
    "slide": Hook("step", ("run-up",)),
    "wrap": Hook("step", ("wrap",)),
    "scene": Hook("scene", LAW_NAMES),  # the geometric half of any law
    "encoder": Hook("after", ("sensor",)),
    "sensor_travel": Hook("after", ("sensor",)),
    "sensor": Hook("after", ("sensor",)),
}
BEFORE_ENGINE = tuple(name for name, hook in HOOKS.items() if hook.called == "before")
AT_STEPS = tuple(name for name, hook in HOOKS.items() if hook.called == "step")
IN_MARCH = tuple(name for name, hook in HOOKS.items() if hook.called in ("march", "step"))
AFTER_ENGINE = tuple(name for name, hook in HOOKS.items() if hook.called == "after")

E = TypeVar("E", bound="Hooks")


class Hooks:
    """The hooks of an effect, those of ``HOOKS``; as they stand here each returns its first argument."""

    #: its name in files and on the command line
    id: ClassVar[str] = ""
    #: what a model must have for the effect to act: "moment" (bending moments at the pulleys; such effects are called
    #: last), "sag" (spans that hang and roll), "width" (a belt that takes couples)
    needs: ClassVar[frozenset[str]] = frozenset()
    #: its place in the physical chain among effects that change the same law; the order in which a user names effects
    #: does not matter
    stage: ClassVar[int] = 0
    #: a traced flag of ``switched``
    acts: ClassVar[Any] = None

    def waves(self, case: Case) -> dict[str, tuple[float, str, float]]:
        """Return name -> (number, its unit, wavelength [m]) of what swings along a march: two steps or more."""
        return {}

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


def overrides(effect: Hooks | type[Hooks], hooks: Iterable[str] = HOOKS) -> set[str]:
    """Return which of ``hooks`` an effect overrides."""
    cls = effect if isinstance(effect, type) else type(effect)
    return {hook for hook in hooks if getattr(cls, hook) is not getattr(Hooks, hook)}


def uses(effects: Sequence[Hooks], hook: str) -> list:
    """Return those of ``effects`` that override ``hook``, in the physical order in which to call them."""
    return sorted((e for e in effects if overrides(e, (hook,))), key=lambda e: ("moment" in e.needs, e.stage, e.id))


def apply_hook(effects: Sequence[Hooks], hook: str, value: Any, *context: Any) -> Any:
    """Return ``value`` as those of ``effects`` that override ``hook`` change it, one after another."""

    for e in uses(effects, hook):
        value = where_acting(e, lambda x, e=e: call_hook(e, hook, x, *context), value, always=hook not in AT_STEPS)
    return value


def switched(effect: E, acts: Any) -> E:
    """Return the effect with a traced flag, of a whole batch: where it is false, hooks that a march calls at every step
    take no time. It is false where the effect is null, so that it changes no bit."""
    found = copy(effect)
    object.__setattr__(found, "acts", acts)
    return found


def where_acting(effect: Hooks, function: Callable[..., Any], value: Any, *, always: bool = False) -> Any:
    """Return ``function`` of a value, or the value itself where the flag of a ``switched`` effect is false."""
    return function(value) if always or effect.acts is None else lax.cond(effect.acts, function, lambda x: x, value)


def call_hook(effect: Hooks, hook: str, *arguments: Any) -> Any:
    """Return what a hook of an effect returns; an error in a user's own file is an InputError with its line."""
    path, function = getattr(type(effect), "source_file", None), getattr(effect, hook)
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
        line, remedy = function.__func__.__code__.co_firstlineno, "end it with return and its first argument, changed"
        raise wrong_file(Path(path), line, f"{hook} returns nothing; {remedy}")
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


# Before and after an engine: settings as they are, then readings as the instruments show them.


@in_float64
def as_indicated(engine: Callable[..., Curves], case: Case, effects: Sequence[Hooks], travel: float) -> Curves:
    """Curves of ``engine(case as driven, travel=...)`` as encoder and sensors show them, up to ``travel`` [m]: it is
    run as far as the belt goes while the encoder counts that much, its records spread over what the encoder shows."""
    driven, far = asked_of_engine(case, effects, travel)
    curves = engine(driven, travel=far)
    if not any(uses(effects, hook) for hook in AFTER_ENGINE):
        return curves
    return as_numpy(indicate(curves, case, effects, np.asarray(curves.travel) * (travel / far)))


@in_float64
def asked_of_engine(case: Case, effects: Sequence[Hooks], travel: float) -> tuple[Case, float]:
    """The case as driven, and how far an engine has to run it [m] for curves over ``travel`` [m] as indicated."""
    driven = as_driven(case, effects)
    if not any(uses(effects, hook) for hook in AFTER_ENGINE):
        return driven, travel
    return driven, max(travel, float(true_travel(effects, case, travel)))


def as_driven(case: Case, effects: Sequence[Hooks]) -> Case:
    """The case with tension and yaw as they are, not as they were commanded (drive law), and turned when the encoder
    shows the stated travel, not when the belt has gone so far."""
    for e in uses(effects, "settings"):
        case = replace(case, settings=call_hook(e, "settings", case.settings, case))
    if not uses(effects, "encoder"):
        return case
    turned = {}
    for name in ("yaw", "yaw_head"):
        schedule: Schedule = getattr(case.settings, name)
        at, end = (true_travel(effects, case, x) for x in (schedule.at, schedule.at + schedule.over))
        turned[name] = replace(schedule, at=at, over=end - at)
    return replace(case, settings=replace(case.settings, **turned))


def true_travel(effects: Sequence[Hooks], case: Case, travel):
    """Belt travel [m] when the encoder says ``travel`` [m]."""
    return apply_hook(effects, "encoder", travel, case)


@in_float64
def indicate(curves: Curves, case: Case, effects: Sequence[Hooks], shown, time=None) -> Curves:
    """True curves, which must reach far enough, as read at encoder travels ``shown`` [m], (n,); time [s], (n,): of the
    samples, None = as the belt's speed brings it there."""
    shown = jnp.asarray(shown)
    true = true_travel(effects, case, shown)
    seen = apply_hook(effects, "sensor_travel", true, case)
    rows = {n: looked_up(curves.travel, getattr(curves, n), true) for n in ALONG[2:] if getattr(curves, n) is not None}
    rows["y"] = looked_up(curves.travel, curves.y, seen)
    extra = {n: looked_up(curves.travel, jnp.asarray(row)[None], true)[0] for n, row in (curves.extra or {}).items()}
    reading = Reading(
        travel=shown,
        sensor_travel=seen,
        time=true / case.settings.speed if time is None else time,
        y=rows["y"],
        tilt=rows.get("tilt", jnp.zeros((2, len(shown)))),
    )
    reading = apply_hook(effects, "sensor", reading, case)
    rows |= {"y": reading.y} | ({"tilt": reading.tilt} if "tilt" in rows else {})
    return replace(curves, travel=shown, extra=extra or None, **rows)


def as_numpy(curves: Curves) -> Curves:
    """The same numbers as NumPy arrays."""
    plain: dict[str, Any] = {n: np.asarray(v) for n, v in vars(curves).items() if v is not None and n != "extra"}
    extra = None if curves.extra is None else {n: np.asarray(v) for n, v in curves.extra.items()}
    return replace(curves, extra=extra, **plain)


def looked_up(travel, rows, where):
    """Rows (k, records) at ``travel`` (records,), looked up at ``where`` (n,) by cubics through four records."""
    travel, rows = jnp.asarray(travel), jnp.asarray(rows)
    if len(travel) < 4:
        return jnp.stack([jnp.interp(where, travel, row) for row in rows])
    where = jnp.clip(where, travel[0], travel[-1])
    left = jnp.clip(jnp.searchsorted(travel, where, side="right") - 1, 1, len(travel) - 3)
    nodes = [travel[left + k] for k in (-1, 0, 1, 2)]
    total = 0.0
    for k, node in enumerate(nodes):
        others = [n for j, n in enumerate(nodes) if j != k]
        weight = 1.0
        for other in others:
            weight = weight * (where - other) / (node - other)
        total = total + weight * rows[:, left + k - 1]
    return total
