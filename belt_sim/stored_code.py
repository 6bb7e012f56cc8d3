"""Compiled code that is kept whole between processes: it is neither traced nor lowered again.

JAX keeps what XLA compiled, but traces and lowers a function in every process before it looks there: a second for a
march with all effects in it. Here the executable itself is found by what made it: the sources that may be traced, the
versions of JAX, the processor, and a name that the caller gives to everything else that the function closes over. It
stands beside JAX's own cache (``jax_setup.prepare``); where that is off nothing is kept.
"""

import hashlib
import os
import pickle
import platform
import secrets
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import jax
import jaxlib
import numpy as np

from belt_sim.jax_setup import in_float64

VERSIONS_KEPT = 8  # of the sources; code of older ones is deleted
_HERE = Path(__file__).parent
_OWN = "belt_sim."
#: what is traced: the files of this folder itself, and these
TRACED = ("analytic", "laws", "effects", "diagnosis/forward.py", "discovery/responses.py", "discovery/channels.py")


def kept(function: Callable[..., Any], name: str | None) -> Callable[..., Any]:
    """``function`` jitted in float64; its executables are stored by ``name``, arguments' shapes and sources.

    name: all that the function closes over, in words; None: nothing is stored. Arguments are pytrees of numbers, the
    result an array or a tuple of arrays.
    """
    ready: dict[Any, Any] = {}

    def call(*args: Any) -> Any:
        leaves, tree = jax.tree.flatten(args)
        leaves = [np.asarray(x) for x in leaves]
        key = tree, tuple((x.shape, x.dtype.str) for x in leaves)
        if key not in ready:
            ready[key] = _executable(lambda *flat: function(*jax.tree.unflatten(tree, flat)), leaves, name, key)
        return ready[key](*leaves)

    return in_float64(call)


def own(*things: Any) -> bool:
    """Whether classes and functions are this package's, so that its sources say what they do."""
    return all(t.__module__.startswith(_OWN) and "<" not in t.__qualname__ for t in things)


def sources() -> list[Path]:
    """All files whose code may be traced."""
    found = [*_HERE.glob("*.py")]
    for part in TRACED:
        found += [_HERE / part] if part.endswith(".py") else (_HERE / part).rglob("*.py")
    return sorted(found)


def _executable(flat: Callable[..., Any], leaves: list[np.ndarray], name: str | None, key: Any) -> Any:
    """From the store, or compiled and put there."""
    folder = None if name is None else _folder()
    if folder is None:
        return jax.jit(flat)
    place = folder / hashlib.sha256(f"{name} {key}".encode()).hexdigest()
    found = _loaded(place) if place.exists() else None
    if found is None:
        found = _compiled_anew(flat, leaves)
        _store(found, place)
    return found


def _compiled_anew(flat: Callable[..., Any], leaves: list[np.ndarray]) -> Any:
    """An executable that can be stored: one that JAX's own cache has loaded cannot, so it is not asked, nor given it
    (a name that it has not seen; no time is long enough to be worth keeping)."""
    flat.__name__ = f"stored_{secrets.token_hex(8)}"
    least = "jax_persistent_cache_min_compile_time_secs"
    before = _setting(least)
    jax.config.update(least, 1e9)
    try:
        return jax.jit(flat).lower(*leaves).compile()
    finally:
        jax.config.update(least, before)


def _loaded(place: Path) -> Any:
    """The executable of a file; None where it cannot be used."""
    from jax.experimental.serialize_executable import deserialize_and_load

    try:
        return deserialize_and_load(*pickle.loads(place.read_bytes()))
    except Exception:  # damaged, or of a machine that differs in what is not asked for: it is compiled again
        return None


def _store(made: Any, place: Path) -> None:
    """Write an executable in one go; a store that cannot be written to costs time only."""
    from jax.experimental.serialize_executable import serialize

    scratch = place.with_name(f".{place.name}.{secrets.token_hex(4)}")
    try:
        content = pickle.dumps(serialize(made))
        place.parent.mkdir(parents=True, exist_ok=True)
        scratch.write_bytes(content)
        scratch.replace(place)
    except OSError:
        scratch.unlink(missing_ok=True)


@cache
def _folder() -> Path | None:
    """Where executables of these sources stand; None where JAX keeps no cache. Those of old sources are deleted."""
    cache_dir = _setting("jax_compilation_cache_dir")
    if not cache_dir or not _setting("jax_enable_compilation_cache"):
        return None
    top = Path(cache_dir) / "executables"
    mine = top / _version()
    try:
        mine.mkdir(parents=True, exist_ok=True)
        os.utime(mine)
        newest = sorted((p for p in top.iterdir() if p.is_dir()), key=lambda p: p.stat().st_mtime, reverse=True)
    except OSError:
        return None
    for old in newest[VERSIONS_KEPT:]:
        shutil.rmtree(old, ignore_errors=True)
    return mine


def _version() -> str:
    """Hash of all that decides what code is compiled, beside its name: sources, JAX, processor, flags."""
    found = hashlib.sha256()
    for path in sources():
        found.update(path.read_bytes())
    flags = os.environ.get("XLA_FLAGS", ""), str(_setting("jax_platforms"))
    words = (jax.__version__, jaxlib.__version__, platform.platform(), _processor(), *flags)
    found.update(" ".join(words).encode())
    return found.hexdigest()[:24]


def _setting(name: str) -> Any:
    """Of JAX."""
    return getattr(jax.config, name)


def _processor() -> str:
    """What the processor can do."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line for line in lines if line.startswith(("flags", "Features"))), platform.processor())
