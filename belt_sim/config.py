"""From a configuration to the nouns: units converted and every number checked, before any long work."""

import math
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, TypedDict

import numpy as np

from belt_sim import plausible, si
from belt_sim.case import Belt, Case, Rig, Schedule, Settings
from belt_sim.errors import BeltError, InputError, finite, flag
from belt_sim.files import CONF, group_names
from belt_sim.si import UNITS

MAX_TENSION, MAX_YAW = plausible.TENSION.high, plausible.YAW.high  # [N/mm2], [degrees]
#: number of a configuration -> its range, in the unit of the configuration
RANGES: dict[str, tuple[float, float, str]] = {
    name: (*(float(f"{x * UNITS[bounds.unit][1] / UNITS[unit][1]:.12g}") for x in (bounds.low, bounds.high)), unit)
    for name, bounds, unit in (
        ("rig.centre_distance", plausible.CENTRE_DISTANCE, "m"),
        ("rig.pulley_radius", plausible.RADIUS, "m"),
        ("belt.width", plausible.WIDTH, "m"),
        ("belt.thickness", plausible.THICKNESS, "m"),
        ("belt.youngs_modulus", plausible.YOUNGS_MODULUS, "Pa"),
        ("belt.density", plausible.DENSITY, "kg/m3"),
        ("belt.poisson_ratio", plausible.POISSON_RATIO, ""),
        ("travel", plausible.SIMULATED_TRAVEL, "m"),
        ("speed", plausible.SPEED, "m/s"),
        ("model.step", plausible.STEP, "m"),
        ("model.keep", plausible.KEEP, "m"),
    )
} | {"rig.gravity": (0.0, 100.0, "m/s2"), "rig.face_width": (1e-3, 20.0, "m")}


def case_from(cfg: Mapping[str, Any]) -> Case:
    """Rig, belt and settings of a configuration; raises InputError naming the first value that cannot be."""
    rig, belt = rig_from(cfg["rig"]), belt_from(cfg["belt"])
    tension = finite("tension", cfg["tension"], "N/mm2")
    if not (bounds := plausible.TENSION).low <= tension <= bounds.high:
        remedy = f"give the tension in N/mm2, from {bounds.low:g} to {bounds.high:g}"
        raise InputError("tension", f"{tension:g}", "N/mm2", remedy)
    direction = finite("direction", cfg["direction"])
    if direction not in (1, -1):
        raise InputError("direction", direction, "", "use 1 or -1")
    settings = Settings(
        tension=tension * si.N_PER_MM2,
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


class CaseSettings(TypedDict, total=False):
    """Settings of a case as on the command line: [N/mm2], [degrees, or a list of {at, over, yaw}], [m/s], [m]."""

    rig: str | Mapping[str, Any] | Rig
    belt: str | Mapping[str, Any] | Belt
    tension: float | Sequence[float]
    yaw: float | Sequence[Mapping[str, float]] | Schedule
    yaw_head: float | Sequence[Mapping[str, float]] | Schedule
    speed: float
    direction: float


def case_or_settings(case: Case | None, settings: Mapping[str, Any]) -> Case:
    """``case``, or where it is None the one that ``settings`` describe; raises InputError where both are given."""
    if case is None:
        return make_case(**settings)
    for name, value in settings.items():
        if value is None:
            continue
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
    """A case from settings as on the command line (``CaseSettings``); what is not given is as in conf/simulate.yaml.

    rig and belt are names (of conf/rig, conf/belt), objects, or mappings of what is other than in the standard ones.
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
    for key, standard in _file(f"{command}.yaml").items():
        if key not in config and key != "defaults":
            raise BeltError(f"{key}: is left out, and {command} needs it; give it a value, {key}=...")
        if isinstance(standard, bool):
            flag(key, config[key])
    model = config.get("model") or {}
    if model.get("name") in group_names("model"):
        for key, standard in _file(f"model/{model['name']}.yaml").items():
            if isinstance(standard, bool) and key in model:
                flag(f"model.{key}", model[key])


def model_settings(cfg: Mapping[str, Any]) -> Mapping[str, Any]:
    """A ``model`` group, with the lengths of an analytic march within their ranges."""
    flat = {f"model.{k}": v for k, v in cfg.items() if f"model.{k}" in RANGES}
    for key in flat:
        check_range(flat, key)
    return cfg


def rig_from(asked: Any) -> Rig:
    """The machine of a ``rig`` group, its name, or the machine itself."""
    cfg = group_from("rig", asked)
    if isinstance(cfg, Rig):
        return cfg
    flat = {f"rig.{k}": v for k, v in cfg.items()}
    centre = check_range(flat, "rig.centre_distance")
    common = check_range(flat, "rig.pulley_radius")
    radii = []
    for key in ("rig.head_radius", "rig.tail_radius"):
        given = flat.get(key)
        radii.append(common if given is None else _check_bounds(key, finite(key, given, "m"), "rig.pulley_radius"))
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
    names = ("width", "thickness", "youngs_modulus", "density", "poisson_ratio")
    return Belt(**{n: check_range(flat, f"belt.{n}") for n in names})


def schedule_from(spec: Any, name: str) -> Schedule:
    """Yaw against travel from an angle (a step at travel 0), a list of {at, over, yaw} in metres and angles, or as is.

    An angle is given in degrees, or as the adjustment {dx, d} of the pulley's axis in metres.
    """
    if isinstance(spec, Schedule):
        return spec
    if not isinstance(spec, Sequence) or isinstance(spec, str):
        return Schedule.step(_angle(name, spec))
    at, over, wanted = [], [], []
    for entry in spec:
        if not isinstance(entry, Mapping) or not {"at", "yaw"} <= set(entry) <= {"at", "over", "yaw"}:
            raise InputError(name, entry, "", "write {at: metres, yaw: degrees, over: metres}")
        at.append(finite(f"{name}.at", entry["at"], "m"))
        over.append(finite(f"{name}.over", entry.get("over", 0.0), "m"))
        wanted.append(_angle(f"{name}.yaw", entry["yaw"]))
        if at[-1] < 0 or over[-1] < 0 or (len(at) > 1 and at[-1] < at[-2] + over[-2]):
            raise InputError(f"{name}.at", at[-1], "m", "entries must follow one another from travel 0 on")
    if not at:
        return Schedule.step(0.0)
    return Schedule(at=np.array(at), over=np.array(over), change=np.diff([0.0, *wanted]))


def check_range(cfg: Mapping[str, Any], key: str) -> float:
    """A number within RANGES[key]."""
    if key not in cfg:
        raise BeltError(f"{key}: is left out; give it a value, {key}=...")
    return _check_bounds(key, finite(key, cfg[key], RANGES[key][2]), key)


def _check_bounds(name: str, value: float, key: str) -> float:
    low, high, unit = RANGES[key]
    if not low <= value <= high:
        raise InputError(name, f"{value:g}", unit, f"give a value between {low:g} and {high:g} {unit}".rstrip())
    return value


def _angle(name: str, value: Any) -> float:
    """Yaw [rad] from degrees, or from {dx, d} in metres by equation (1) of the paper: tan(yaw) = 2 dx / d, where the
    ends of the axis, d apart, are moved by dx in opposite directions."""
    if isinstance(value, Mapping):
        if set(value) != {"dx", "d"}:
            raise InputError(name, dict(value), "", "give either degrees or {dx: metres, d: metres}, equation (1)")
        dx, d = (finite(f"{name}.{key}", value[key], "m") for key in ("dx", "d"))
        if d <= 0.0:
            raise InputError(f"{name}.d", f"{d:g}", "m", "give the distance of the axis' ends, above 0")
        value = math.atan2(2.0 * dx, d) / si.DEGREE
    degrees = finite(name, value, "degrees")
    if abs(degrees) > MAX_YAW:
        raise InputError(name, f"{degrees:g}", "degrees", f"give the yaw in degrees, at most {MAX_YAW:g} either way")
    return degrees * si.DEGREE
