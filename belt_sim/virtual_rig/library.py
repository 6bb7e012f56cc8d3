"""Faults by id, found by looking into two folders: those that a fitter may know, and strangers that none knows."""

import importlib
import pkgutil
from pathlib import Path

from belt_sim.errors import InputError
from belt_sim.virtual_rig.fault import Fault
from belt_sim.virtual_rig.strangers._stranger import Stranger


def _in(folder: str) -> dict[str, type[Fault]]:
    """Fault classes that the files of a folder define, by id in alphabetical order."""
    names = [m.name for m in pkgutil.iter_modules([str(Path(__file__).parent / folder)]) if m.name[0] != "_"]
    modules = [importlib.import_module(f"{__package__}.{folder}.{name}") for name in sorted(names)]
    own = [v for m in modules for v in vars(m).values() if getattr(v, "__module__", "") == m.__name__]
    return {c.id: c for c in own if isinstance(c, type) and issubclass(c, Fault)}


CATALOGUE = _in("faults")
STRANGERS: dict[str, type[Stranger]] = _in("strangers")  # type: ignore[assignment]
#: the strangers on which a fitter may have been developed, and those that were made for blind tests only
DEVELOPMENT = tuple(name for name, cls in STRANGERS.items() if not cls.blind)
BLIND = tuple(name for name, cls in STRANGERS.items() if cls.blind)
#: What ``hidden=random`` draws from, in the order of the lot.
LOT = tuple(sorted((c for c in CATALOGUE.values() if c.lot), key=lambda c: c.lot))


def fault_class(name: str) -> type[Fault]:
    """The class of an id; raises InputError when there is none."""
    known = CATALOGUE | STRANGERS
    if name not in known:
        raise InputError("hidden", name, "", f"use one of {', '.join(sorted(known))}")
    return known[name]


def fault_of(spec: str | dict) -> Fault:
    """A fault from an id (its first parameter at typical size) or from {"id": ..., parameter: SI value}."""
    given = {"id": spec} if isinstance(spec, str) else dict(spec)
    cls = fault_class(str(given.pop("id", "")))
    if not given:
        name, size = next(iter(cls.sizes.items()))
        return cls(**{name: size.typical})
    return cls(**{name: _number(cls, name, value) for name, value in given.items()})


def _number(cls: type[Fault], name: str, value: object) -> float:
    allowed = cls().parameters()
    if name not in allowed:
        raise InputError(f"hidden {cls.id}", name, "", f"its parameters are {', '.join(allowed)}")
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise InputError(f"hidden {cls.id}.{name}", value, "", "give a number in SI")
    unit, limit = (cls.sizes[name].unit, cls.sizes[name].limit) if name in cls.sizes else ("", float("inf"))
    if not abs(value) <= limit or (cls.positive and value < 0):
        low = 0 if cls.positive else -limit
        raise InputError(f"hidden {cls.id}.{name}", value, unit, f"must lie between {low:g} and {limit:g}")
    return value
