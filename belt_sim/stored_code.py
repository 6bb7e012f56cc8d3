"""Traced code that is kept between processes: it is neither traced nor lowered again.

JAX keeps what XLA compiled, but traces and lowers a function in every process before it looks there: a second for a
march with all effects in it. Here the lowered function itself (``jax.export``) is found by what made it: the sources
that may be traced, the versions of JAX, and a name that the caller gives to everything else that the function closes
over. It stands beside JAX's own cache (``jax_setup.prepare``), which has its compiled code; where that is off nothing
is kept.
"""

import hashlib
import os
import secrets
import shutil
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from threading import Barrier, Lock, stack_size
from typing import Any
from weakref import WeakKeyDictionary

import jax
import jaxlib
import numpy as np
from jax import export

from belt_sim.jax_setup import in_float64
from belt_sim.mappings import Programs

LOADERS = 2  # programs that are compiled or loaded at once
STACK = 256 * 2**20  # [bytes], of a thread that compiles and loads; what is not used costs nothing
LEAST_EFFORT = {"xla_backend_optimization_level": 0}
VERSIONS_KEPT = 8  # of the sources; code of older ones is deleted
_HERE = Path(__file__).parent
_written: WeakKeyDictionary[type, str] = WeakKeyDictionary()  # class that was written -> what says what it does
_OWN = "belt_sim."
#: what is traced: the files of this folder itself, and these
TRACED = (
    "analytic",
    "laws",
    "effects",
    "diagnosis/readings/forward.py",
    "diagnosis/readings/added_readings.py",
    "diagnosis/readings/as_set.py",
    "discovery/responses.py",
    "discovery/channels.py",
)


def kept(function: Callable[..., Any], name: str | None, brief: bool = False) -> Callable[..., Any]:
    """``function`` jitted in float64; it is stored by ``name``, arguments' shapes and sources.

    name: all that the function closes over, in words; None: nothing is stored. Arguments are pytrees of numbers, the
    result an array or a tuple of arrays. brief: it runs so seldom that compiling costs more, and is compiled with less
    effort, to code that is half as fast and rounds alike.
    """
    ready = Programs()
    compiling: defaultdict[Any, Lock] = defaultdict(Lock)

    def call(*args: Any) -> Any:
        leaves, tree = jax.tree.flatten(args)
        leaves = [np.asarray(x) for x in leaves]
        key = tree, tuple((x.shape, x.dtype.str) for x in leaves)
        program = ready.by_key.get(key)
        if program is None:
            with compiling[key]:  # one thread compiles, others of the same shapes wait
                program = ready.by_key.get(key)
                if program is None:
                    flat = in_float64(lambda: _compiled(function, tree, leaves, name, key, brief))
                    program = ready.by_key[key] = _loader().submit(flat).result()
        return program(*leaves)

    return in_float64(call)


def own(*things: Any) -> bool:
    """Whether classes and functions are this package's, so that its sources say what they do."""
    return all(t.__module__.startswith(_OWN) and "<" not in t.__qualname__ for t in things)


def written_as(cls: type, words: str) -> None:
    """Note that a class was written by this package, and in what words all that is traced of it."""
    _written[cls] = hashlib.sha256(words.encode()).hexdigest()


def is_written(effect: type) -> bool:
    """Whether an effect was written by this package, rather than stands in it."""
    return effect in _written


def model_name(model: Any, *effects: type) -> str | None:
    """What code of an analytic model with some effects is stored by; None where somebody's own code is in it."""
    written = [_written[e] for e in effects if is_written(e)]
    if not own(model.span, *(e for e in effects if not is_written(e)), *map(type, model.built_in)):
        return None
    named = f"{model.name} {model.span.__module__}.{model.span.__qualname__} {model.built_in} {model.moments}"
    return f"{named} {written}" if written else named


def sources() -> list[Path]:
    """All files whose code may be traced."""
    found = [*_HERE.glob("*.py")]
    for part in TRACED:
        found += [_HERE / part] if part.endswith(".py") else (_HERE / part).rglob("*.py")
    return sorted(found)


@cache
def _loader() -> ThreadPoolExecutor:
    """Threads with a deep stack, in which all is compiled or loaded.

    XLA links the kernels of a stored program by recursion, in an order that is another every time: programs of
    thousands of kernels may end an ordinary stack, and with it the process.
    """
    pool, all_there = ThreadPoolExecutor(LOADERS, thread_name_prefix="loader"), Barrier(LOADERS)
    before = stack_size(STACK)
    try:
        for begun in [pool.submit(all_there.wait) for _ in range(LOADERS)]:  # they are begun with this stack
            begun.result()
    finally:
        stack_size(before)
    return pool


def _compiled(function: Callable[..., Any], tree: Any, leaves: list, name: str | None, key: Any, brief: bool) -> Any:
    code = _ready(lambda *flat: function(*jax.tree.unflatten(tree, flat)), leaves, name, key)
    return code.lower(*leaves).compile(compiler_options=LEAST_EFFORT if brief else None)


def _ready(flat: Callable[..., Any], leaves: list[np.ndarray], name: str | None, key: Any) -> Any:
    """From the store, or traced and put there."""
    folder = None if name is None else _folder()
    if folder is None:
        return jax.jit(flat)
    place = folder / hashlib.sha256(f"{name} {key}".encode()).hexdigest()
    found = _loaded(place)
    if found is None:
        shapes = [jax.ShapeDtypeStruct(x.shape, x.dtype) for x in leaves]
        content = export.export(jax.jit(flat))(*shapes).serialize()
        _store(content, place)
        found = export.deserialize(content)
    return jax.jit(found.call)


def _loaded(place: Path) -> export.Exported | None:
    """The code of a file; None where there is none or it is damaged."""
    try:
        return export.deserialize(bytearray(place.read_bytes()))
    except Exception:  # whatever a damaged file leads to: it is traced again
        return None


def _store(content: bytes | bytearray, place: Path) -> None:
    """Write code in one go; a store that cannot be written to costs time only."""
    scratch = place.with_name(f".{place.name}.{secrets.token_hex(4)}")
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        scratch.write_bytes(content)
        scratch.replace(place)
    except OSError:
        scratch.unlink(missing_ok=True)


@cache
def _folder() -> Path | None:
    """Where code of these sources stands; None where JAX keeps no cache. That of old sources is deleted."""
    cache_dir = _setting("jax_compilation_cache_dir")
    if not cache_dir or not _setting("jax_enable_compilation_cache"):
        return None
    top = Path(cache_dir) / "traced"
    mine = top / _version()
    try:
        mine.mkdir(parents=True, exist_ok=True)
        os.utime(mine)
        others = [p for p in top.iterdir() if p.is_dir() and p != mine]
        others.sort(key=lambda p: p.stat().st_mtime, reverse=True)
    except OSError:
        return None
    for old in others[VERSIONS_KEPT - 1 :]:
        shutil.rmtree(old, ignore_errors=True)
    return mine


def _version() -> str:
    """Hash of all that decides what code is traced, beside its name: sources, JAX, platform."""
    found = hashlib.sha256()
    for path in sources():
        found.update(path.read_bytes())
    words = (jax.__version__, jaxlib.__version__, str(_setting("jax_platforms")))
    found.update(" ".join(words).encode())
    return found.hexdigest()[:24]


def _setting(name: str) -> Any:
    """Of JAX."""
    return getattr(jax.config, name)
