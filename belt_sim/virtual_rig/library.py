"""Faults by id: those of the catalogue that a fitter may know, and strangers that none knows."""

from belt_sim.errors import InputError
from belt_sim.virtual_rig import machine_faults, sensor_faults, strangers, weld
from belt_sim.virtual_rig.fault import Fault


def _in(*modules) -> dict[str, type[Fault]]:
    classes = [v for m in modules for v in vars(m).values() if isinstance(v, type) and issubclass(v, Fault)]
    return {c.id: c for c in classes if c.id}


CATALOGUE = _in(machine_faults, sensor_faults, weld)
STRANGERS = _in(strangers)
#: What ``hidden=random`` draws from: the effects that every fitter of this project has to know.
COMMON = (
    "yaw_offset_tail",
    "yaw_offset_head",
    "cant",
    "taper",
    "crown",
    "wobble",
    "soft_cover",
    "slip",
    "yaw_compliance",
    "tension_bias",
    "encoder_scale",
    "sensor_gain",
    "sensor_drift",
    "edge_profile",
)


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
