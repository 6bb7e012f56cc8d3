"""Effects in a user's own Python file: what is wrong with one is said in a line with file, line and remedy."""

import difflib
import importlib.util
import inspect
import re
import sys
import traceback
from collections.abc import Callable
from functools import wraps
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any

from belt_sim.effects.base import HOOKS, LAW_OF_HOOK, Effect, overrides
from belt_sim.effects.library import effects_in, library
from belt_sim.errors import BeltError, InputError

_UNITS = {"1", "m", "s", "rad", "N", "Pa", "kg", "K", "J", "W", "Hz"}
#: what JAX says of a value that is not there yet -> what to write instead
_REMEDIES = {
    "TracerBoolConversionError": "write jnp.where(condition, a, b) for 'if'",
    "TracerArrayConversionError": "use jax.numpy for numpy",
    "ConcretizationTypeError": "use jax.numpy, and no float() or int() of it",
    "TracerIntegerConversionError": "use jax.numpy, and no int() of it",
}


def own_effects(path: Path) -> dict[str, type[Effect]]:
    """Effect classes of a Python file by id, each declaration checked; raises InputError naming file and line."""
    if not path.is_file():
        raise InputError("effects", str(path), "", "no such file")
    path = path.resolve()
    name = "user_effect_" + sha256(str(path).encode() + path.read_bytes()).hexdigest()[:12]  # as the file is today
    known = name in sys.modules
    module = sys.modules[name] if known else _imported(path, name)
    found = effects_in(module)
    if not found:
        raise _wrong(path, 1, "it defines no Effect with an id; see README, 'An effect of your own'")
    if not known:
        try:
            for cls in found.values():
                _inspect(cls, path)
                _guard(cls, path)
        except InputError:
            del sys.modules[name]
            raise
    return found


def _imported(path: Path, name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        line = getattr(error, "lineno", None) or _line_of(error, path)
        raise _wrong(path, line, f"the file does not import: {type(error).__name__}: {error}") from error
    return module


def _inspect(cls: type[Effect], path: Path) -> None:
    """The declaration of one effect: finished, of its law, with hooks that exist and units that do."""
    cls.source_file = str(path)  # type: ignore[attr-defined]
    here = inspect.getsourcelines(cls)[1]
    if cls.id in library():
        raise _wrong(path, here, f"the library has an effect of this id ({cls.id}); give yours another")
    if "declared" not in vars(cls):
        raise _wrong(path, here, f"write @effect above @dataclass of {cls.__name__}")
    for name, parameter in cls.parameters.items():
        unknown = [t for t in re.findall(r"[A-Za-z]+", parameter.unit) if t not in _UNITS]
        if unknown:
            raise _wrong(path, here, f"{name} has the unit {parameter.unit!r}: write it in SI, e.g. 1/m, rad or N m")
    for name, function in vars(cls).items():
        if inspect.isfunction(function) and not name.startswith("_"):
            _inspect_hook(cls, name, function, path)
    own = overrides(cls)
    if not own:
        raise _wrong(path, here, f"{cls.__name__} overrides no hook; the hooks are {', '.join(HOOKS)}")
    if not any(cls.law in LAW_OF_HOOK.get(hook, (cls.law,)) for hook in own):
        laws = sorted({law for hook in own for law in LAW_OF_HOOK[hook]})
        raise _wrong(path, here, f"law = {cls.law!r} but {', '.join(sorted(own))} changes {' or '.join(laws)}")


def _inspect_hook(cls: type[Effect], name: str, function: Callable[..., Any], path: Path) -> None:
    line = function.__code__.co_firstlineno
    base = getattr(Effect, name, None)
    if base is None:
        close = difflib.get_close_matches(name, HOOKS, n=1)
        if close:
            raise _wrong(path, line, f"{name}: no hook of this name; did you mean {close[0]}?")
        return
    wanted, given = (list(inspect.signature(f).parameters) for f in (base, function))
    if len(wanted) != len(given):
        raise _wrong(path, line, f"write {name}({', '.join(wanted)}), not {name}({', '.join(given)})")


def _guard(cls: type[Effect], path: Path) -> None:
    """Make every hook of one's own say where it fails."""
    for hook in overrides(cls):
        function = vars(cls).get(hook)
        if inspect.isfunction(function):
            setattr(cls, hook, _guarded(function, hook, path))


def _guarded(function: Callable[..., Any], hook: str, path: Path) -> Callable[..., Any]:
    @wraps(function)
    def asked(*arguments: Any) -> Any:
        try:
            answer = function(*arguments)
        except BeltError:
            raise
        except Exception as error:
            kind = type(error).__name__
            remedy = _REMEDIES.get(kind) or str(error).splitlines()[0]
            raise _wrong(path, _line_of(error, path), f"{hook}: {kind}: {remedy}") from error
        if answer is None:
            line = function.__code__.co_firstlineno
            raise _wrong(path, line, f"{hook} returns nothing; end it with return and its first argument, changed")
        return answer

    return asked


def _line_of(error: BaseException, path: Path) -> int:
    """The last line of the file that an error came through."""
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
    return lines[-1] or 1 if lines else 1


def _wrong(path: Path, line: int, what: str) -> InputError:
    return InputError("effects", f"{path}, line {line}", "", what)
