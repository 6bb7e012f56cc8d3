"""The contract of an effect: a frozen dataclass of SI parameters that changes one of the five laws; and the library.

A new effect is one class: subclass ``Effect``, decorate with ``@effect``, give ``law`` and ``reference``, declare its
numbers with ``parameter``, and write the hook of its law (``HOOKS`` of ``belt_sim.line.hooks``). Every hook returns
its first argument changed; with null parameters it must return it unchanged, bit for bit. The hook ``scene`` is the
geometric half of an effect: it gives the parts of a 3D scene (``belt_sim.scene_parts``) with its own change; the 3D
models refuse an effect that acts between drive and sensor without it.
"""

import importlib
import math
import os
import pkgutil
import re
import sys
from dataclasses import Field, dataclass, field, fields
from functools import cache
from typing import Any, ClassVar, dataclass_transform

from belt_sim.case import Case, pytree
from belt_sim.errors import InputError
from belt_sim.line.hooks import HOOKS, LAW_NAMES, Hooks


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
    "A difference of diameter below some 10 µm shows in the belt only: steer against it. A larger one: measure "
    "the {pulley} pulley at both sides and in the middle with a pi tape."
)


@dataclass(frozen=True, kw_only=True)
class Effect(Hooks):
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
    #: how reports tell of it to people at the machine; without one they name the effect and its law
    cause: ClassVar[Cause | None] = None
    parameters: ClassVar[dict[str, Parameter]] = {}
    #: many numbers of one kind: name -> what ``parameter`` declares
    alike: ClassVar[dict[str, Any]] = {}

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


@dataclass_transform(frozen_default=True, kw_only_default=True)
def effect(cls):
    """Make a frozen dataclass of an effect class, check its declaration, and register it as a JAX pytree.

    The class may also be a dataclass already that lists its numbers in ``parameters``.
    """
    if "id" not in vars(cls):
        cls.id = re.sub("(?<!^)(?=[A-Z])", "_", cls.__name__).lower()
    if "__dataclass_fields__" not in vars(cls):
        cls.__annotations__ = dict.fromkeys(cls.alike, float) | cls.__annotations__
        for name, declared in cls.alike.items():
            setattr(cls, name, declared)
        cls.alike = {}  # fields hold them now
        cls = dataclass(frozen=True, kw_only=True)(cls)
    declared = {f.name: f.metadata["parameter"] for f in fields(cls) if "parameter" in f.metadata}
    cls.parameters = {**cls.parameters, **declared}
    if cls.law not in LAW_NAMES:
        raise InputError(f"{cls.__name__}.law", repr(cls.law), "", f"use one of {', '.join(LAW_NAMES)}")
    names = {f.name for f in fields(cls)}
    if names != set(cls.parameters):
        raise InputError(f"{cls.__name__}.parameters", sorted(names ^ set(cls.parameters)), "", "declare each once")
    if not names:
        raise InputError(f"{cls.__name__}.parameters", "none", "", "declare a number, as size: float = parameter(...)")
    for name, p in cls.parameters.items():
        if not all(map(math.isfinite, p.plausible)):  # a diagnosis takes its ends for the width of a prior
            remedy = "give the lowest and highest of a real machine, both finite"
            raise InputError(f"{cls.__name__}.{name}.plausible", p.plausible, p.unit, remedy)
    if hidden := names & {*HOOKS, "influence", "acts"}:
        raise InputError(f"{cls.__name__}.parameters", sorted(hidden), "", "hooks have these names; choose others")
    cls.declared = True
    return pytree(cls)


@cache
def library() -> dict[str, type[Effect]]:
    """Return the effect classes by id, in alphabetical order."""
    found: dict[str, type[Effect]] = {}
    for module in pkgutil.iter_modules([os.path.dirname(__file__)]):
        own = effects_in(importlib.import_module(f"belt_sim.effects.{module.name}"))
        found |= {cls.id: cls for cls in own if cls.id}
    return dict(sorted(found.items()))


def title_of(cls: type[Effect]) -> str:
    """Return an effect in a few words: its title, else the first line of its file."""
    lines = (sys.modules[cls.__module__].__doc__ or cls.id).strip().splitlines()
    return cls.title or lines[0].rstrip(".")


def effects_in(module) -> list[type[Effect]]:
    """Return the effect classes that a module itself defines, and those that lack the decorator: a base of others, and
    beside a complete class one that declares neither numbers nor an id, are helpers."""
    own = [v for v in vars(module).values() if isinstance(v, type) and v.__module__ == module.__name__]
    own = [c for c in own if issubclass(c, Effect)]
    complete = [c for c in own if "declared" in vars(c)]
    for c in (c for c in own if c not in complete and not c.__subclasses__()):
        declares = {"id", "law", "parameters", "alike", "__dataclass_fields__"} & {*vars(c)}
        if declares or not complete or any(isinstance(v, Field) for v in vars(c).values()):
            complete.append(c)
    return complete
