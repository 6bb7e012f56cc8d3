"""The effects of this folder: adding a file adds its effects."""

import importlib
import os
import pkgutil
import sys
from functools import cache

from belt_sim.effects.base import Effect


@cache
def library() -> dict[str, type[Effect]]:
    """Return the effect classes by id, in alphabetical order."""
    found: dict[str, type[Effect]] = {}
    for module in pkgutil.iter_modules([os.path.dirname(__file__)]):
        found |= effects_in(importlib.import_module(f"belt_sim.effects.{module.name}"))
    return dict(sorted(found.items()))


def title_of(cls: type[Effect]) -> str:
    """Return an effect in a few words: its title, else the first line of its file."""
    lines = (sys.modules[cls.__module__].__doc__ or cls.id).strip().splitlines()
    return cls.title or lines[0].rstrip(".")


def short_title(cls: type[Effect]) -> str:
    """Return the name of an effect in words: its title up to the colon that an explanation follows."""
    return title_of(cls).partition(":")[0]


def effects_in(module) -> dict[str, type[Effect]]:
    """Return the effect classes that a module itself defines, by id."""
    classes = [v for v in vars(module).values() if isinstance(v, type) and issubclass(v, Effect)]
    return {c.id: c for c in classes if c.id and c.__module__ == module.__name__}
