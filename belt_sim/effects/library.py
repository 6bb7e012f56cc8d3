"""All effects of this folder, found by looking: adding a file adds an effect."""

import importlib
import pkgutil
from collections.abc import Sequence
from functools import cache

from belt_sim import effects
from belt_sim.effects.base import Effect


@cache
def library() -> dict[str, type[Effect]]:
    """Effect classes by id, in alphabetical order."""
    found: dict[str, type[Effect]] = {}
    for module in pkgutil.iter_modules(effects.__path__):
        found |= effects_in(importlib.import_module(f"belt_sim.effects.{module.name}"))
    return dict(sorted(found.items()))


def tried(leave_out: Sequence[str] | None = None) -> dict[str, type[Effect]]:
    """The library without ``leave_out`` (null: without what is tried only when it is named)."""
    return {i: c for i, c in library().items() if (not c.only_when_named if leave_out is None else i not in leave_out)}


def effects_in(module) -> dict[str, type[Effect]]:
    """Effect classes that a module defines itself, by id."""
    classes = [v for v in vars(module).values() if isinstance(v, type) and issubclass(v, Effect)]
    return {c.id: c for c in classes if c.id and c.__module__ == module.__name__}
