"""Traced programs on disk: what a process has traced, the next one reads in a few milliseconds.

JAX keeps compiled code on disk, but finds it by the traced program: a diagnosis spent half of its time on tracing the
same ten marches again. ``jax.export`` writes a traced program (StableHLO) as a file. Its name is a hash of all that the
trace depends on: the package's own code, JAX's version, what the caller says of the function, and the types of the
arguments. So a program of other code is never read; the result is the same bit by bit (tests/limits).
"""

import hashlib
import sys
import threading
from collections.abc import Callable, Hashable, Iterable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import jax
from jax import export

from belt_sim.errors import BeltError
from belt_sim.files import write_with
from belt_sim.jax_setup import PROGRAMS, in_float64, least_effort
from belt_sim.provenance import code_hash

PACKAGE = "belt_sim."
FOLDER = "traced"  # below JAX's folder of compiled programs


def program_key(name: str, model: Any, effects: Iterable[type], *shape: Any) -> str | None:
    """Return a name for a program of a composition of laws and classes of effects, None where a part of it is not the
    package's own and its code therefore not in the hash; shape: whatever else shapes the trace, of plain values."""
    parts = [model.span, *effects, *map(type, model.built_in)]
    own = [getattr(sys.modules.get(p.__module__), p.__qualname__, None) is p for p in parts]
    if not (all(own) and all(p.__module__.startswith(PACKAGE) for p in parts)):
        return None
    laws = (model.name, sorted(model.hooks), sorted(model.contains), model.built_in, model.moments)
    return repr((name, laws, [(p.__module__, p.__qualname__) for p in parts], shape))


class StoredProgram:
    """A function compiled in float64, whose trace is kept on disk.

    function: takes pytrees of numbers, returns an array or a tuple of arrays; key: its name and everything that shapes
    its trace except the types of its arguments, as text; None: nothing is kept on disk; brief: as in ``jit_float64``.
    """

    def __init__(self, function: Callable[..., Any], key: str | None, *, brief: bool = False) -> None:
        self.function, self.key = function, key
        self.options = least_effort() if brief else None
        self.plain = jax.jit(function, compiler_options=self.options)
        self.programs: dict[Hashable, Callable[..., Any]] = {}
        self.lock = threading.Lock()

    def __call__(self, *arguments: Any) -> Any:
        """Return what the function gives."""
        return _call(self, arguments)

    def program_for(self, leaves: list[Any], structure: Any) -> Callable[..., Any]:
        """Return the compiled function of leaves (one argument each), from memory, from disk, or traced now."""
        types = tuple(map(jax.typeof, leaves))
        with self.lock:
            if (structure, types) not in self.programs:
                if len(self.programs) >= PROGRAMS:
                    self.programs.clear()
                self.programs[structure, types] = self._make(leaves, structure, types)
            return self.programs[structure, types]

    def _make(self, leaves: list[Any], structure: Any, types: tuple[Any, ...]) -> Callable[..., Any]:
        def of_leaves(*leaves: Any) -> Any:
            return self.function(*jax.tree.unflatten(structure, leaves))

        folder = jax.config.values["jax_compilation_cache_dir"]
        if self.key is None or not folder or jax.default_backend() != "cpu" or find_spec("flatbuffers") is None:
            return jax.jit(of_leaves, compiler_options=self.options)
        told = "\n".join([code_hash(), jax.__version__, self.key, str(structure), *map(str, types)])
        file = Path(folder) / FOLDER / f"{hashlib.sha256(told.encode()).hexdigest()}.stablehlo"
        if (written := _read(file)) is not None:
            exported = export.deserialize(bytearray(written))
        else:
            exported = export.export(jax.jit(of_leaves))(*leaves)
            written = bytes(exported.serialize())
            with suppress(OSError, BeltError):  # a full or read-only disk keeps none
                write_with(file, lambda path: path.write_bytes(hashlib.sha256(written).digest() + written))
        return jax.jit(exported.call, compiler_options=self.options)


def _read(file: Path) -> bytes | None:
    """What a file holds behind the hash of it; None where there is none, or it is damaged."""
    try:
        content = file.read_bytes()
    except OSError:
        return None
    hashed, written = content[:32], content[32:]
    return written if hashlib.sha256(written).digest() == hashed else None


@in_float64
def _call(stored: StoredProgram, arguments: tuple[Any, ...]) -> Any:
    leaves, structure = jax.tree.flatten(arguments)
    return stored.program_for(leaves, structure)(*leaves)
