"""Effects as people name them: ids, Python files of their own, mappings with numbers, or YAML files of these."""

import difflib
import importlib.util
import inspect
import re
import sys
import textwrap
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

from belt_sim.effects.base import Effect, effects_in, library
from belt_sim.effects.generic_law import ID as LAW
from belt_sim.effects.generic_law import (
    TERM_NUMBERS,
    WIDTH,
    GenericLaw,
    law_effect,
    law_entry,
    law_of_entry,
    yaml_number,
)
from belt_sim.effects.law import COURSES, SHAPES, VARIABLES, number_name
from belt_sim.errors import InputError, finite
from belt_sim.io import careful_yaml
from belt_sim.line.hooks import HOOKS, line_of, overrides, wrong_file

SCHEMA, WITH_LAWS = "belt-effects/1", "belt-effects/2"  # version 2 may hold laws that were found
MOST_TIMES_PLAUSIBLE = 100.0  # times the largest plausible value: more is a slip of the pen


def load_classes(spec: Any) -> dict[str, type[Effect]]:
    """Effect classes that ``spec`` names (ids, .py and .yaml files, laws, classes); the library when it is None."""
    if spec is None:
        return dict(library())
    classes: dict[str, type[Effect]] = {}
    for item in _entries(spec):
        is_class = isinstance(item, type) and issubclass(item, Effect)
        found = {item.id: item} if is_class else _read_entry(item)[0]
        for twice in (i for i, cls in found.items() if classes.get(i, cls) is not cls):
            raise InputError("effects", twice, "", "two files have an effect of this id; give each an id of its own")
        classes |= found
    return classes


def load_effects(spec: Any) -> tuple[Effect, ...]:
    """Effects with numbers, ready for a model.

    spec: None; an effects.yaml; or a list of ids, .py and .yaml files and mappings {id: taper, kappa_t: 2e-5}. An id
    without numbers takes the effect's own default. Raises InputError for unknown names, wrong numbers, and for an
    effect that would do nothing.
    """
    loaded: list[Effect] = []
    for item in [] if spec is None else _entries(spec):
        classes, numbers = _read_entry(item)
        for cls in classes.values():
            loaded.append(cls(**check_numbers(cls, numbers)))
            if loaded[-1] == cls.null():
                example = f"effects=[{{id:{cls.id},{next(iter(cls.parameters))}:...}}]"
                raise InputError("effects", cls.id, "", f"it would do nothing; give numbers, e.g. {example}")
    ids = [e.id for e in loaded]
    for twice in {i for i in ids if ids.count(i) > 1}:
        raise InputError("effects", twice, "", "name each effect once")
    return tuple(loaded)


def check_numbers(cls: type[Effect], numbers: Mapping[str, Any]) -> dict[str, float]:
    """The numbers of an effect; raises InputError for one that is none, is far from plausible or too small."""
    checked: dict[str, float] = {}
    for parameter, value in numbers.items():
        name, p = f"effects.{cls.id}.{parameter}", cls.parameters.get(parameter)
        if p is None:
            raise InputError(name, value, "", f"its parameters are {', '.join(cls.parameters)}")
        as_text = " (write 2.0e-5, not 2e-5)" if re.fullmatch(r"[+-]?\d+e[+-]?\d+", str(value)) else ""
        number = checked[parameter] = finite(name, value, p.unit, f"give a finite number{as_text}")
        low, high = p.plausible
        most, bounds = MOST_TIMES_PLAUSIBLE * max(abs(low), abs(high)), ""
        if abs(number) > most:
            bounds = f"give at most {most:g} {p.unit}"
        elif number < p.null <= low and not p.modifier:
            bounds = f"must be {p.null:g} or more"
        if bounds:
            raise InputError(name, f"{number:g}", p.unit, f"{bounds}; {low:g} to {high:g} is plausible")
    return checked


def save_effects(
    effects: Sequence[Effect], uncertainty: Mapping[str, Mapping[str, float]] | None = None, notes: Sequence[str] = ()
) -> str:
    """The text of an effects.yaml that load_effects reads back; comments: uncertainties, and notes on a law."""
    schema = WITH_LAWS if any(isinstance(e, GenericLaw) for e in effects) else SCHEMA
    lines = [f"schema: {schema}", "effects:" if effects else "effects: []"]
    for e in effects:
        if isinstance(e, GenericLaw):
            # ``law_entry`` with words, units and uncertainties as comments
            own = (uncertainty or {}).get(e.id, {})
            entry = law_entry(e)
            lines += [f"  - id: {LAW}", *(f"    # {line}" for note in notes for line in textwrap.wrap(note, WIDTH))]
            lines += [f"    tension: {yaml_number(entry['tension'])}  # Pa, at which the sizes hold", "    terms:"]
            for k, (t, term) in enumerate(zip(e.content.law.terms, entry["terms"], strict=True)):
                words = {
                    "points" if t.place.points else "place": t.place.words,
                    "variable": VARIABLES[t.form.variable][1],
                    "shape": f"{SHAPES[t.form.shape].words}, x: the variable",
                    "course": COURSES[t.form.course].words,
                }
                if not t.form.is_carried and t.form.course != "constant":  # what s is in the formula
                    since = " since the yaw was set" if t.form.since_yaw else ""
                    words["course"] += f", s: time{since} [s]" if t.form.timed else f", s: travel{since} [m]"
                for name, value in term.items():
                    text, comment = str(value).lower() if name == "timed" else str(value), words.get(name, "")
                    if name in TERM_NUMBERS:
                        number, u = e.parameters[number_name(name, k)], own.get(number_name(name, k))
                        parts = number.unit if number.unit != "1" else "", number.meaning, f"+- {u:.2g}" if u else ""
                        text, comment = yaml_number(value), ", ".join(part for part in parts if part)
                    begin = "- " if name == "place" else "  "
                    lines.append(f"      {begin}{name}: {text}{'  # ' + comment if comment else ''}")
            continue
        origin = getattr(type(e), "source_file", None)
        lines.append(f"  - id: {origin or e.id}")
        lines.append("    parameters:")
        for name, p in e.parameters.items():
            u = (uncertainty or {}).get(e.id, {}).get(name)
            beside = f"  # +- {u:.2g} {p.unit}" if u is not None else f"  # {p.unit}"
            lines.append(f"      {name}: {yaml_number(getattr(e, name))}{beside}")
    return "\n".join(lines) + "\n"


def _entries(spec: Any) -> list:
    if isinstance(spec, (str, Path)):
        text = str(spec)
        if text.endswith((".yaml", ".yml")):
            path = Path(text)
            if not path.is_file():
                raise InputError("effects", text, "", "no such file; a diagnosis writes one as effects.yaml")
            try:
                content = careful_yaml(path.read_bytes(), text)
            except ValueError as error:
                raise InputError("effects", text, "", f"{error}; mend the file") from None
            known = isinstance(content, Mapping) and content.get("schema") in (SCHEMA, WITH_LAWS)
            if not known or "effects" not in content:
                raise InputError("effects", text, "", f"write 'schema: {SCHEMA}' and a list 'effects:'")
            entries = _as_list(content["effects"] or [])
            for k, item in enumerate(entries):  # a .py named there stands beside it unless its path says otherwise
                name = str(item.get("id", "")) if isinstance(item, Mapping) else str(item)
                beside = path.parent / name
                if name.endswith(".py") and beside.is_file():
                    entries[k] = {**item, "id": str(beside)} if isinstance(item, Mapping) else str(beside)
            return entries
        return [text]
    if isinstance(spec, Mapping):
        return _as_list(spec["effects"]) if "effects" in spec else [spec]
    found = [_entries(item) if isinstance(item, str | Path) else [item] for item in _as_list(spec)]
    return [entry for entries in found for entry in entries]


def _as_list(spec: Any) -> list:
    if not isinstance(spec, Sequence) or isinstance(spec, str):
        raise InputError("effects", spec, "", "give a list, as [taper, my_effect.py], or an effects.yaml")
    return list(spec)


def _read_entry(item: Any) -> tuple[dict[str, type[Effect]], dict[str, Any]]:
    """The effect classes of an entry by id, and its numbers; raises InputError, of a Python file with its line."""
    if isinstance(item, Mapping) and item.get("id") == LAW:
        return {LAW: law_effect(law_of_entry(item))}, {}
    name, numbers, known = str(item), dict[str, Any](), library()
    if isinstance(item, Mapping):
        if "id" not in item:
            raise InputError("effects", dict(item), "", "every entry needs an id")
        name, parameters = str(item["id"]), item.get("parameters") or {}
        if not isinstance(parameters, Mapping):
            raise InputError(f"effects.{name}.parameters", parameters, "", "write name: number, one a line")
        beside = {k: v for k, v in item.items() if k not in ("id", "parameters")}
        numbers = {str(k): v for k, v in (beside | dict(parameters)).items()}
    if name == LAW:
        raise InputError("effects", name, "", "give the file of the law; a diagnosis writes one as found_law.yaml")
    if name in known and not name.endswith(".py"):
        return {name: known[name]}, numbers
    if not name.endswith(".py"):
        raise InputError("effects", name, "", f"use one of {', '.join(known)}, or a .py file of your own")

    # the classes of a Python file, each declaration checked
    path = Path(name)
    if not path.is_file():
        raise InputError("effects", str(path), "", "no such file")
    path = path.resolve()
    module = "user_effect_" + sha256(str(path).encode() + path.read_bytes()).hexdigest()[:12]  # as the file is today
    is_new = module not in sys.modules
    if is_new:
        spec = importlib.util.spec_from_file_location(module, path)
        assert spec is not None
        assert spec.loader is not None
        sys.modules[module] = importlib.util.module_from_spec(spec)
        try:
            spec.loader.exec_module(sys.modules[module])
        except (Exception, SystemExit) as error:
            del sys.modules[module]
            line = getattr(error, "lineno", None) or line_of(error, path)
            is_told = isinstance(error, InputError)  # by ``effect``, of a declaration
            what = f"{error}" if is_told else f"the file does not import: {type(error).__name__}: {error}"
            raise wrong_file(path, line, what) from error
    found = effects_in(sys.modules[module])
    if not found:
        raise wrong_file(path, 1, "it defines no effect; docs/write_an_effect.md and belt-sim new-effect show one")
    if is_new:
        try:
            for cls in found:
                _inspect(cls, path)
        except InputError:
            del sys.modules[module]
            raise
    return {cls.id: cls for cls in found}, numbers


# Effects in a user's own Python file: what is wrong with one is said in a line with file, line and remedy.


_UNITS = {"1", "m", "s", "rad", "N", "Pa", "kg", "K", "J", "W", "Hz"}


def _inspect(cls: type[Effect], path: Path) -> None:
    """The declaration of one effect: finished, of its law, with hooks that exist and units that do."""
    cls.source_file = str(path)  # type: ignore[attr-defined]
    here = inspect.getsourcelines(cls)[1]
    if cls.id in library():
        raise wrong_file(path, here, f"the library has an effect of this id ({cls.id}); give yours another")
    if "declared" not in vars(cls):
        raise wrong_file(path, here, f"write @effect above the class {cls.__name__}")
    for name, parameter in cls.parameters.items():
        unknown = [t for t in re.findall(r"[A-Za-z]+", parameter.unit) if t not in _UNITS]
        if unknown:
            raise wrong_file(
                path, here, f"{name} has the unit {parameter.unit!r}: write it in SI, e.g. 1/m, rad or N m"
            )
    for name, function in vars(cls).items():
        if not inspect.isfunction(function) or name.startswith("_"):
            continue
        line, given = function.__code__.co_firstlineno, list(inspect.signature(function).parameters)
        if hasattr(Effect, name):
            wanted = list(inspect.signature(getattr(Effect, name)).parameters)
        elif close := difflib.get_close_matches(name, HOOKS, n=1):
            raise wrong_file(path, line, f"{name}: no hook of this name; did you mean {close[0]}?")
        else:
            continue
        if len(wanted) != len(given):
            raise wrong_file(path, line, f"write {name}({', '.join(wanted)}), not {name}({', '.join(given)})")
    own = overrides(cls)
    if not own:
        raise wrong_file(path, here, f"{cls.__name__} overrides no hook; the hooks are {', '.join(HOOKS)}")
    laws = sorted({law for hook in own for law in HOOKS[hook].laws})
    if cls.law not in laws:
        raise wrong_file(path, here, f"law = {cls.law!r} but {', '.join(sorted(own))} changes {' or '.join(laws)}")
