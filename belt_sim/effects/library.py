"""All effects of this folder, found by looking: adding a file adds an effect."""

import importlib
import pkgutil
from collections.abc import Sequence
from functools import cache

from belt_sim import effects
from belt_sim.effects.base import Effect

#: by a diagnosis: look-alikes of others in most data, or without a derivative where the search begins
NOT_TRIED_UNLESS_NAMED = (
    "lift_off",
    "shear",
    "run_up_points",
    "speed_tension",
    "sensor_offset",
    "camber",
    "edge_guide",
    "weld",
)


@cache
def library() -> dict[str, type[Effect]]:
    """Effect classes by id, in alphabetical order."""
    found: dict[str, type[Effect]] = {}
    for module in pkgutil.iter_modules(effects.__path__):
        found |= effects_in(importlib.import_module(f"belt_sim.effects.{module.name}"))
    return dict(sorted(found.items()))


def tried(leave_out: Sequence[str] | None = None) -> dict[str, type[Effect]]:
    """The library without ``leave_out`` (null: without what is tried only when it is named)."""
    left = NOT_TRIED_UNLESS_NAMED if leave_out is None else leave_out
    return {i: c for i, c in library().items() if i not in left}


def effects_in(module) -> dict[str, type[Effect]]:
    """Effect classes that a module defines itself, by id."""
    classes = [v for v in vars(module).values() if isinstance(v, type) and issubclass(v, Effect)]
    return {c.id: c for c in classes if c.id and c.__module__ == module.__name__}
