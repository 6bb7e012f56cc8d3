"""Faults by id: those that a fitter may know, each the twin of an effect, and those that no catalogue lists."""

from types import ModuleType
from typing import Any

from belt_sim.errors import InputError, finite
from belt_sim.virtual_rig import faults, unmodelled
from belt_sim.virtual_rig.fault import Fault, UnmodelledFault


def _faults_in(module: ModuleType) -> dict[str, type[Fault]]:
    """Fault classes of a module, by id in alphabetical order: random draws depend on it."""
    classes = [v for v in vars(module).values() if isinstance(v, type) and v.__module__ == module.__name__]
    public = [c for c in classes if issubclass(c, Fault) and not c.__name__.startswith("_")]
    return {c.id: c for c in sorted(public, key=lambda c: c.id)}


CATALOGUE = _faults_in(faults)
UNMODELLED: dict[str, type[UnmodelledFault]] = _faults_in(unmodelled)  # type: ignore[assignment]
#: the unmodelled faults on which a fitter may have been developed
DEVELOPMENT = (
    *("adhesion_loss", "dead_zone", "mid_stick", "quadratic_contact", "sensor_cubic", "strange_wave", "tension_decay"),
    *("walking_angle", "warming_stand", "wind_steps", "yaw_creep"),
)
#: those that change a span itself, and are drawn by themselves
SPAN = tuple(name for name, cls in UNMODELLED.items() if cls.place.startswith("span_"))
#: all others, which were made for blind tests only
BLIND = tuple(name for name in UNMODELLED if name not in (*DEVELOPMENT, *SPAN))
#: What ``hidden=random`` draws from, in this order.
RANDOM_LIBRARY = tuple(sorted((c for c in CATALOGUE.values() if c.draw_order), key=lambda c: c.draw_order))


def fault_class(name: str) -> type[Fault]:
    """The class of an id; raises InputError when there is none."""
    known = CATALOGUE | UNMODELLED
    if name not in known:
        own = "the virtual rig hides faults of its own and reads no effect files; " if name.endswith(".py") else ""
        raise InputError("hidden", name, "", f"{own}use one of {', '.join(sorted(known))}")
    return known[name]


def fault_from_spec(spec: str | dict) -> Fault:
    """A fault from an id (its first parameter at typical size) or from {"id": ..., parameter: SI value}."""
    given = {"id": spec} if isinstance(spec, str) else dict(spec)
    cls = fault_class(str(given.pop("id", "")))
    if not given:
        name, size = next(iter(cls.sizes.items()))
        return cls(**{name: size.typical})
    return cls(**{name: _number(cls, name, value) for name, value in given.items()})


def _number(cls: type[Fault], name: str, value: Any) -> float:
    allowed = cls().parameters()
    if name not in allowed:
        raise InputError(f"hidden {cls.id}", name, "", f"its parameters are {', '.join(allowed)}")
    finite(f"hidden {cls.id}.{name}", value, "", "give a number in SI")
    if name in cls.sizes:
        limit, low = cls.sizes[name].limit, 0.0 if cls.positive else -cls.sizes[name].limit
        if not low <= value <= limit:
            remedy = f"must lie between {low:g} and {limit:g}"
            raise InputError(f"hidden {cls.id}.{name}", value, cls.sizes[name].unit, remedy)
    return value
