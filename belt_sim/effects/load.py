"""Effects as people name them: ids, Python files of their own, mappings with numbers, or an effects.yaml."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from belt_sim.effects.base import Effect
from belt_sim.effects.library import library
from belt_sim.effects.plugins import own_effects
from belt_sim.errors import InputError

SCHEMA = "belt-effects/1"
BEYOND = 100.0  # times the largest plausible value: more is a slip of the pen


def load_classes(spec: Any) -> dict[str, type[Effect]]:
    """Effect classes named by ``spec`` (ids and .py files); the whole library when it is None."""
    if spec is None:
        return dict(library())
    classes: dict[str, type[Effect]] = {}
    for item in _entries(spec):
        classes |= _classes_of(_named(item)[0])
    return classes


def load_effects(spec: Any) -> tuple[Effect, ...]:
    """Effects with numbers, ready for a model.

    spec: None; an effects.yaml; or a list of ids, .py files and mappings {id: taper, kappa_t: 2e-5}. An id without
    numbers takes the effect's own default. Raises InputError for unknown names, wrong numbers, and for an effect
    that would do nothing.
    """
    loaded: list[Effect] = []
    for item in _entries(spec) if spec is not None else []:
        name, numbers = _named(item)
        loaded += [_build(cls, numbers) for cls in _classes_of(name).values()]
    ids = [e.id for e in loaded]
    for twice in {i for i in ids if ids.count(i) > 1}:
        raise InputError("effects", twice, "", "name each effect once")
    return tuple(loaded)


def save_effects(effects: Sequence[Effect], uncertainty: Mapping[str, Mapping[str, float]] | None = None) -> str:
    """The text of an effects.yaml that load_effects reads back; uncertainties stand beside as comments."""
    lines = [f"schema: {SCHEMA}", "effects:" if effects else "effects: []"]
    for e in effects:
        origin = getattr(type(e), "source_file", None)
        lines.append(f"  - id: {origin or e.id}")
        lines.append("    parameters:")
        for name, p in e.parameters.items():
            u = (uncertainty or {}).get(e.id, {}).get(name)
            beside = f"  # +- {u:.2g} {p.unit}" if u is not None else f"  # {p.unit}"
            lines.append(f"      {name}: {float(getattr(e, name))!r}{beside}")
    return "\n".join(lines) + "\n"


def _entries(spec: Any) -> list:
    if isinstance(spec, (str, Path)):
        text = str(spec)
        if text.endswith((".yaml", ".yml")):
            return _read_yaml(Path(text))
        return [text]
    if isinstance(spec, Mapping):
        return _listed(spec["effects"]) if "effects" in spec else [spec]
    return _listed(spec)


def _listed(spec: Any) -> list:
    if not isinstance(spec, Sequence) or isinstance(spec, str):
        raise InputError("effects", spec, "", "give a list, as [taper, my_effect.py], or an effects.yaml")
    return list(spec)


def _named(item: Any) -> tuple[str, dict[str, Any]]:
    """The id (or .py file) of an entry and its numbers."""
    if not isinstance(item, Mapping):
        return str(item), {}
    if "id" not in item:
        raise InputError("effects", dict(item), "", "every entry needs an id")
    numbers = {str(k): v for k, v in item.items() if k not in ("id", "parameters")}
    parameters = item.get("parameters") or {}
    if not isinstance(parameters, Mapping):
        raise InputError(f"effects.{item['id']}.parameters", parameters, "", "write name: number, one a line")
    return str(item["id"]), numbers | {str(k): v for k, v in parameters.items()}


def _read_yaml(path: Path) -> list:
    if not path.is_file():
        raise InputError("effects", str(path), "", "no such file; a diagnosis writes one as effects.yaml")
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InputError("effects", str(path), "", f"not readable as YAML: {str(error).splitlines()[0]}") from error
    if not isinstance(content, Mapping) or content.get("schema") != SCHEMA or "effects" not in content:
        raise InputError("effects", str(path), "", f"write 'schema: {SCHEMA}' and a list 'effects:'")
    return [_relative_to(path, item) for item in _listed(content["effects"] or [])]


def _relative_to(path: Path, item: Any) -> Any:
    """A user's .py named in a YAML stands beside that YAML unless its path says otherwise."""
    name = str(item.get("id", "")) if isinstance(item, Mapping) else str(item)
    if name.endswith(".py") and not Path(name).is_file() and (path.parent / name).is_file():
        return {**item, "id": str(path.parent / name)} if isinstance(item, Mapping) else str(path.parent / name)
    return item


def _classes_of(name: str) -> dict[str, type[Effect]]:
    if name.endswith(".py"):
        return own_effects(Path(name))
    known = library()
    if name not in known:
        raise InputError("effects", name, "", f"use one of {', '.join(known)}, or a .py file of your own")
    return {name: known[name]}


def _build(cls: type[Effect], numbers: Mapping[str, Any]) -> Effect:
    for name, value in numbers.items():
        if name not in cls.parameters:
            raise InputError(f"effects.{cls.id}.{name}", value, "", f"its parameters are {', '.join(cls.parameters)}")
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            unit = cls.parameters[name].unit
            raise InputError(f"effects.{cls.id}.{name}", value, unit, "give a finite number (write 2.0e-5, not 2e-5)")
        _refuse_absurd(cls, name, float(value))
    built = cls(**{n: float(v) for n, v in numbers.items()})
    if built.is_null():
        example = next(iter(cls.parameters))
        raise InputError(
            "effects",
            cls.id,
            "",
            f"it would do nothing; give numbers, e.g. effects=[{{id:{cls.id},{example}:...}}]",
        )
    return built


def _refuse_absurd(cls: type[Effect], name: str, value: float) -> None:
    """No machine is a hundred times beyond what is plausible."""
    parameter = cls.parameters[name]
    most = BEYOND * max(abs(p) for p in parameter.plausible)
    if abs(value) > most:
        low, high = parameter.plausible
        remedy = f"give at most {most:g} {parameter.unit}; {low:g} to {high:g} is plausible"
        raise InputError(f"effects.{cls.id}.{name}", f"{value:g}", parameter.unit, remedy)
