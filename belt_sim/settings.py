"""Every number that people state: the ONE table of its bounds, and the way from a configuration to a case, with units
converted and every number checked before any long work."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from belt_sim.case import Belt, Case, Rig, Schedule, Settings
from belt_sim.errors import BeltError, InputError, finite, flag
from belt_sim.io import CONF, group_names
from belt_sim.units import DEGREE, UNITS, round_digits


@dataclass(frozen=True)
class Range:
    """Bounds of a quantity in ``unit``: low <= value <= high, or low < value when ``open_low``."""

    dimension: str
    low: float
    high: float
    unit: str
    open_low: bool = False

    def check(self, value: float, unit: str | None = None, *, name: str = "") -> float:
        """The value in SI; raises InputError for a unit of another kind or an implausible magnitude."""
        unit = self.unit if unit is None else unit
        units = {u: one for u, (kind, one) in UNITS.items() if kind == self.dimension} or {self.unit: 1.0}
        if unit not in units:
            known = ", ".join(filter(None, units)) or "no unit"
            what = "unknown unit" if unit else "the unit is missing"
            raise InputError(name, f"{value:.12g}", unit, f"{what}; use one of {known}")
        one = units[unit]
        if self.holds(value * one):
            return value * one
        low = f"above {self.low:g} and at most" if self.open_low else f"{self.low:g} to"
        meant = "check the value and its unit"
        for other, factor in units.items() if self.dimension != "number" and value else ():
            if factor != one and self.holds(value * factor):
                shown = round_digits(value * factor / one, 6)
                meant = f"did you mean {value:.12g} {other}, that is {shown:.12g} {unit}?"
                break
        bounds = f"must be {low} {self.high:g} {self.unit}".rstrip()
        raise InputError(name, f"{value:.12g}", unit, f"{bounds}; {meant}")

    def holds(self, si: Any) -> Any:
        """Whether an SI value, or each of an array, lies in the range, up to rounding."""
        factor = UNITS.get(self.unit, ("", 1.0))[1]
        rounding = 1e-12 * factor * max(abs(self.low), abs(self.high))
        above = si > self.low * factor if self.open_low else si >= self.low * factor - rounding
        return above & (si <= self.high * factor + rounding)


_RADIUS = Range("length", 5.0, 5000.0, "mm")
#: The ONE table of bounds, for configurations, data sheets and imports alike: only a slipped unit or a typing error
#: leaves them.
BOUNDS = {
    "centre_distance": Range("length", 0.1, 500.0, "m"),
    "pulley_radius": _RADIUS,
    "head_radius": _RADIUS,
    "tail_radius": _RADIUS,
    "face_width": Range("length", 1e-3, 20.0, "m"),
    "gravity": Range("acceleration", 0.0, 100.0, "m/s2"),
    "width": Range("length", 2.0, 10000.0, "mm"),
    "thickness": Range("length", 0.005, 50.0, "mm"),
    "youngs_modulus": Range("stress", 1.0, 1000.0, "GPa"),
    "density": Range("density", 500.0, 25000.0, "kg/m^3"),
    "poisson_ratio": Range("number", 0.0, 0.5, ""),
    "tension": Range("stress", 0.1, 1500.0, "N/mm2"),  # a slacker belt lies on the floor, a tighter one is broken
    "yaw": Range("angle", -2.0, 2.0, "deg"),  # beyond any steering
    "speed": Range("speed", 1e-3, 50.0, "m/s"),
    "direction": Range("number", -1e9, 1e9, ""),  # which of them are directions is said by the reader
    "travel": Range("length", 0.1, 1e5, "m"),  # that is simulated
    "step": Range("length", 1e-4, 0.1, "m"),  # of an analytic march, whose records are 0.1 m apart at most
    "keep": Range("length", 1e-3, 1e3, "m"),
    "reading_travel": Range("length", 0.0, 20000.0, "m"),
    "yaw_at": Range("length", -20000.0, 20000.0, "m"),  # below 0: before the record, within the run-in
    "y0": Range("length", -10000.0, 10000.0, "mm"),
    "time": Range("time", -1e10, 1e10, "s"),
    "rate": Range("angle", -200.0, 200.0, "mm/m"),
    "lateral": Range("length", -1000.0, 1000.0, "m"),  # one reading of a signal of this kind
    "tilt": Range("angle", -1000.0, 1000.0, "rad"),
    # standard uncertainties
    "u_yaw_at": Range("length", 0.0, 10.0, "m"),
    "u_rate": Range("angle", 0.0, 200.0, "mm/m", open_low=True),
    "u_yaw": Range("angle", 0.0, 0.5, "deg"),
    "tension_rel": Range("number", 0.0, 0.5, ""),
    "gain": Range("number", 0.0, 0.5, ""),
    "wander_length": Range("length", 0.0, 10000.0, "m", open_low=True),
    "white_lateral": Range("length", 0.0, 1000.0, "mm", open_low=True),
    "white_tilt": Range("angle", 0.0, 1000.0, "mrad", open_low=True),
    "error_lateral": Range("length", 0.0, 1000.0, "mm"),  # zero and wander
    "error_tilt": Range("angle", 0.0, 1000.0, "mrad"),
}
#: what a data sheet states of the machine and of the belt
MACHINE = ("centre_distance", "head_radius", "tail_radius")
BELT = ("width", "thickness", "youngs_modulus", "density", "poisson_ratio")
#: kind of signal -> dimension of its unit
SIGNAL_DIMENSION = {"lateral": "length", "tilt": "angle"}
#: unit of a configuration by the dimension of a number; tension and yaw have those of BOUNDS
_CONF_UNITS = {"length": "m", "stress": "Pa", "density": "kg/m3", "speed": "m/s", "acceleration": "m/s2", "number": ""}


def case_from(cfg: Mapping[str, Any]) -> Case:
    """Rig, belt and settings of a configuration; raises InputError naming the first value that cannot be."""
    rig, belt = rig_from(cfg["rig"]), belt_from(cfg["belt"])
    direction = finite("direction", cfg["direction"])
    if direction not in (1, -1):
        raise InputError("direction", direction, "", "use 1 or -1")
    settings = Settings(
        tension=BOUNDS["tension"].check(finite("tension", cfg["tension"], "N/mm2"), name="tension"),
        yaw=schedule_from(cfg["yaw"], "yaw"),
        yaw_head=schedule_from(cfg["yaw_head"], "yaw_head"),
        speed=check_range(cfg, "speed"),
        direction=float(direction),
    )
    travel = check_range(cfg, "travel")
    for name in ("yaw", "yaw_head"):  # one that comes after the end was not meant
        for at in (float(at) for at in np.asarray(getattr(settings, name).at) if at > 0.0 and at >= travel):
            remedy = f"the travel ends at {travel:g} m; make it longer or leave this step out"
            raise InputError(f"{name}.at", f"{at:g}", "m", remedy)
    return Case(rig=rig, belt=belt, settings=settings)


def case_or_settings(case: Case | None, settings: Mapping[str, Any]) -> Case:
    """``case``, or where it is None the one that ``settings`` describe; raises InputError where both are given."""
    if case is None:
        return make_case(**settings)
    for name, value in ((n, v) for n, v in settings.items() if v is not None):
        raise InputError(name, value, "", "give either a case or its settings")
    return case


def make_case(
    *,
    tension: Any = None,
    yaw: Any = None,
    yaw_head: Any = None,
    speed: float | None = None,
    direction: float | None = None,
    rig: Any = None,
    belt: Any = None,
    travel: float | None = None,
) -> Case:
    """A case from settings as on the command line; what is not given is as in conf/simulate.yaml.

    tension [N/mm2], yaw and yaw_head [degrees, {dx, d} or a list of {at, over, yaw}], speed [m/s],
    travel [m]; rig and belt: names, objects, or mappings of what is other than in the standard ones.
    """
    given = {"tension": tension, "yaw": yaw, "yaw_head": yaw_head, "speed": speed, "direction": direction}
    given |= {"rig": rig, "belt": belt, "travel": travel}
    return case_from(make_settings(given))


def make_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """The whole configuration of a case from the settings that are given and not None; raises InputError."""
    settings = {k: v for k, v in settings.items() if v is not None}
    standard = _file("simulate.yaml")
    common = {k: standard[k] for k in ("tension", "yaw", "yaw_head", "travel", "direction", "speed")}
    groups = {k: v for entry in standard["defaults"] if isinstance(entry, Mapping) for k, v in entry.items()}
    known = common | {k: groups[k] for k in ("rig", "belt")}
    for key, value in list(settings.items()):
        if key not in known:
            raise InputError(key, value, "", f"use one of {', '.join(known)}")
        if key in groups and isinstance(value, Mapping):
            standard = _file(f"{key}/{groups[key]}.yaml")
            for name in value.keys() - standard.keys():
                raise InputError(f"{key}.{name}", value[name], "", f"use one of {', '.join(standard)}")
            settings[key] = {**standard, **value}
    return known | settings


@cache
def _file(name: str) -> Mapping[str, Any]:
    from omegaconf import OmegaConf  # it reads 2.1e11 as a number, which plain YAML does not

    return OmegaConf.to_container(OmegaConf.load(CONF / name))  # type: ignore[return-value]


def group_from(kind: str, asked: Any) -> Any:
    """A group by its name, or as it is."""
    if not isinstance(asked, str):
        return asked
    if asked not in group_names(kind):
        raise InputError(kind, asked, "", f"use one of {', '.join(group_names(kind))}")
    return _file(f"{kind}/{asked}.yaml")


def check_switches(command: str, config: Mapping[str, Any]) -> None:
    """Raise InputError for the first key that is left out, and for a switch (true or false in conf) that is neither."""
    settings = dict(_file(f"{command}.yaml"))
    for entry in settings.pop("defaults", ()):
        settings |= entry if isinstance(entry, Mapping) else {}  # its groups
    for key, standard in settings.items():
        if key not in config:
            raise BeltError(f"{key}: is left out, and {command} needs it; give it a value, {key}=...")
        if isinstance(standard, bool):
            flag(key, config[key])
    model = config.get("model") or {}
    if model.get("name") in group_names("model"):
        for key, standard in _file(f"model/{model['name']}.yaml").items():
            if isinstance(standard, bool) and key in model:
                flag(f"model.{key}", model[key])


def rig_from(asked: Any) -> Rig:
    """The machine of a ``rig`` group, its name, or the machine itself."""
    cfg = group_from("rig", asked)
    if isinstance(cfg, Rig):
        return cfg
    flat = {f"rig.{k}": v for k, v in cfg.items()}
    centre = check_range(flat, "rig.centre_distance")
    common, own = check_range(flat, "rig.pulley_radius"), ("rig.head_radius", "rig.tail_radius")
    radii = [common if flat.get(key) is None else check_range(flat, key) for key in own]
    if sum(radii) >= centre:
        raise InputError("rig.centre_distance", centre, "m", "the pulleys overlap; move them apart")
    if abs(radii[0] - radii[1]) > 0.1 * centre:
        raise InputError("rig.head_radius", radii[0], "m", "radii may differ by a tenth of the centre distance")
    gravity = check_range(flat, "rig.gravity")
    face = None if flat.get("rig.face_width") is None else check_range(flat, "rig.face_width")
    return Rig(centre_distance=centre, head_radius=radii[0], tail_radius=radii[1], gravity=gravity, face_width=face)


def belt_from(asked: Any) -> Belt:
    """The strip of a ``belt`` group, its name, or the strip itself."""
    cfg = group_from("belt", asked)
    if isinstance(cfg, Belt):
        return cfg
    flat = {f"belt.{k}": v for k, v in cfg.items()}
    return Belt(**{n: check_range(flat, f"belt.{n}") for n in BELT})


def schedule_from(spec: Any, name: str) -> Schedule:
    """Yaw against travel from an angle (a step at travel 0), a list of {at, over, yaw} in metres and angles, or as is.

    An angle is given in degrees, or as the adjustment {dx, d} of the pulley's axis in metres.
    """
    if isinstance(spec, Schedule):
        return spec
    listed = isinstance(spec, Sequence) and not isinstance(spec, str)
    at, over, wanted = [], [], [0.0]
    for entry in (spec or [{"at": 0.0, "yaw": 0.0}]) if listed else [{"at": 0.0, "yaw": spec}]:
        if not isinstance(entry, Mapping) or not {"at", "yaw"} <= set(entry) <= {"at", "over", "yaw"}:
            raise InputError(name, entry, "", "write {at: metres, yaw: degrees, over: metres}")
        at.append(finite(f"{name}.at", entry["at"], "m"))
        over.append(finite(f"{name}.over", entry.get("over", 0.0), "m"))
        overlaps = len(at) > 1 and (at[-1] < at[-2] + over[-2] or (at[-1] == at[-2] and over[-1] == 0.0))
        if at[-1] < 0 or over[-1] < 0 or overlaps:
            remedy = "entries must follow one another from travel 0 on, one step a place"
            raise InputError(f"{name}.at", at[-1], "m", remedy)

        # degrees, or {dx, d} by equation (1) of the paper: tan(yaw) = 2 dx / d, where the ends of the axis, d apart,
        # are moved by dx in opposite directions
        angle, its = entry["yaw"], f"{name}.yaw" if listed else name
        if isinstance(angle, Mapping):
            if set(angle) != {"dx", "d"}:
                raise InputError(its, dict(angle), "", "give either degrees or {dx: metres, d: metres}, equation (1)")
            dx, d = (finite(f"{its}.{key}", angle[key], "m") for key in ("dx", "d"))
            if d <= 0.0:
                raise InputError(f"{its}.d", f"{d:g}", "m", "give the distance of the axis' ends, above 0")
            angle = math.atan2(2.0 * dx, d) / DEGREE
        wanted.append(BOUNDS["yaw"].check(finite(its, angle, "degrees"), name=its))
    return Schedule(at=np.array(at), over=np.array(over), change=np.diff(wanted))


def check_range(cfg: Mapping[str, Any], key: str) -> float:
    """A number of a configuration within its bounds; raises BeltError, InputError."""
    if key not in cfg:
        raise BeltError(f"{key}: is left out; give it a value, {key}=...")
    bounds = BOUNDS[key.rpartition(".")[2]]
    unit = _CONF_UNITS[bounds.dimension]
    return bounds.check(finite(key, cfg[key], unit), unit, name=key)
