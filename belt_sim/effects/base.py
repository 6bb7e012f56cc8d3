"""What an effect is: a frozen dataclass of SI parameters that changes one of the five laws.

A new effect is one file: subclass ``Effect``, decorate with ``@effect``, give ``id``, ``law``, ``reference`` and
``parameters``, and override the hook of its law. Every hook returns its first argument changed; with null
parameters it must return it unchanged, bit for bit. The hook ``scene`` is the geometric half of an effect: it gives
the parts of a 3D scene (``belt_sim.scene_parts``) with its own change; the 3D models refuse an effect that acts between
drive and sensor without it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar

from belt_sim.case import Case, Settings
from belt_sim.errors import InputError
from belt_sim.laws.influence import Bend, BoundaryValues
from belt_sim.laws.runup import Contact, RunUp, State, Yaw
from belt_sim.laws.sensor import Reading
from belt_sim.laws.span import Response, Span
from belt_sim.laws.wrap import RunOff
from belt_sim.pytree import pytree
from belt_sim.scene_parts import SceneParts

LAWS = ("span", "run-up", "wrap", "drive", "sensor")
#: hooks of an effect by what asks them: before an engine, an analytic engine, a 3D engine, after an engine
BEFORE_ENGINE = ("settings",)
IN_MARCH = ("span", "hold", "bend", "yaw", "runup", "slide", "wrap")
IN_SCENE = ("scene",)
AFTER_ENGINE = ("encoder", "seen", "sensor")
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
    "seen": ("sensor",),
    "sensor": ("sensor",),
}


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One number of an effect: SI unit, meaning, plausible range (low, high) of a real machine, null value.

    scale: a size that matters on a real machine, to start a search from; modifier: True for a number that moves
    nothing by itself and only shapes what the others do; grid: values [SI] of a modifier that a search tries one by
    one, each as an alternative of the same effect; of_belt: True where these are shares of the belt's length.
    """

    unit: str
    meaning: str
    plausible: tuple[float, float]
    scale: float
    null: float = 0.0
    modifier: bool = False
    grid: tuple[float, ...] = ()
    of_belt: bool = False


@dataclass(frozen=True, kw_only=True)
class Effect:
    """Base of all effects; see the module's text."""

    id: ClassVar[str] = ""
    law: ClassVar[str] = ""
    reference: ClassVar[str] = ""
    #: "odd", "even" or "mixed": how dy changes when the sign of every yaw changes
    parity: ClassVar[str] = "mixed"
    #: exponent n of the late rate ~ tension^n at high tension; None = not a power law
    tension_exponent: ClassVar[float | None] = None
    #: True for what belongs to the belt and changes sides when the belt is turned over
    on_belt: ClassVar[bool] = False
    #: belt revolutions that a record must cover before the effect can be told from a slow movement
    min_revolutions: ClassVar[float] = 0.0
    #: True for what a diagnosis tries only when it is named: a look-alike of others in most data, or without a
    #: derivative where the search begins
    only_when_named: ClassVar[bool] = False
    #: True for what answers to the belt's moment, and so must be asked after all else that turns a pulley
    last: ClassVar[bool] = False
    #: True for what makes every step of a march dearer than most others together: a fit computes it only where needed
    heavy: ClassVar[bool] = False
    #: True for what makes every step dearer than any other does: it is compiled apart from them, but tried with them
    dear: ClassVar[bool] = False
    #: True for what acts through the roll of a span that hangs, and does nothing to a beam
    hanging: ClassVar[bool] = False
    #: True for what acts by couples between the pulleys, which a belt without width cannot take
    wide: ClassVar[bool] = False
    #: True for what adds to the lateral readings in proportion to its parameters and does nothing else: ``columns``
    linear: ClassVar[bool] = False
    #: True for a sensor law that shows a gain times the reading and an offset, whatever the reading is
    affine: ClassVar[bool] = False
    parameters: ClassVar[dict[str, Parameter]] = {}

    def settings(self, settings: Settings, case: Case) -> Settings:
        """Drive law: tension and yaw schedules as they are, given what was commanded."""
        return settings

    def span(self, span: Span, case: Case) -> Span:
        """Span law: what the span is made of."""
        return span

    def hold(self, answer: Response, span: Span, case: Case) -> Response:
        """Run-up law: how the pulleys hold the ends of the spans; rows (2, 5), the span up the tail pulley first."""
        return answer

    def influence(self, span: Span, case: Case) -> Any:
        """What ``bend`` has to know of a span, worked out once before a march."""
        return None

    def bend(self, bend: Bend, boundary: BoundaryValues, known: Any, case: Case) -> Bend:
        """Span law: what bends the spans between their ends; known: what ``influence`` returned."""
        return bend

    def yaw(self, yaw: Yaw, state: State, case: Case) -> Yaw:
        """Drive and run-up law: direction of the pulleys' surfaces at this travel."""
        return yaw

    def runup(self, runup: RunUp, state: State, case: Case) -> RunUp:
        """Run-up law: what is added to dy/ds and dalpha/ds."""
        return runup

    def slide(self, contact: Contact, state: State, case: Case) -> Contact:
        """Run-up law: how the belt lies where it runs up once it has slid on the pulleys, all at once."""
        return contact

    def wrap(self, runoff: RunOff, state: State, case: Case) -> RunOff:
        """Wrap law: where the belt leaves the pulleys."""
        return runoff

    def scene(self, parts: SceneParts, case: Case) -> SceneParts:
        """The 3D scene: what stands there, before it is built."""
        return parts

    def encoder(self, travel, case: Case):
        """Sensor law: true belt travel [m] when the encoder says ``travel`` [m]."""
        return travel

    def seen(self, travel, case: Case):
        """Sensor law: belt travel [m] that the lateral sensors show while the belt is at ``travel`` [m]."""
        return travel

    def sensor(self, reading: Reading, case: Case) -> Reading:
        """Sensor law: what is indicated."""
        return reading

    @classmethod
    def columns(cls, seen, case: Case):
        """Of a ``linear`` effect: what a unit of each parameter adds to y at points 1-4, shape (parameters, 4, n),
        while the sensors show the belt at travels ``seen`` [m], shape (n,)."""
        raise NotImplementedError(cls.id)

    @classmethod
    def null(cls) -> "Effect":
        """The effect with no strength at all."""
        return cls(**{name: p.null for name, p in cls.parameters.items()})

    def is_null(self) -> bool:
        """True when every parameter stands at its null value."""
        return all(float(getattr(self, n)) == p.null for n, p in self.parameters.items())


def effect(cls):
    """Finish an effect class: check its declaration and make JAX see its parameters."""
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
    """Which of ``hooks`` an effect has of its own."""
    cls = effect if isinstance(effect, type) else type(effect)
    return {hook for hook in hooks if getattr(cls, hook) is not getattr(Effect, hook)}


def uses(effects: Sequence[Effect], hook: str) -> list:
    """Those of ``effects`` that override ``hook``, in the order in which to ask them."""
    return sorted((e for e in effects if overrides(e, (hook,))), key=lambda e: type(e).last)
