"""JAX as this project uses it. Importing this module changes nothing; what is needed is set where it is needed.

- float64: ``jit_float64`` functions and ``in_float64`` blocks compute in it, whatever the caller's JAX is set to.
- a cache of compiled code on disk: ``keep_programs()``, which the first use of ``bs.simulate`` and the like calls.
- the CPU, and no fused multiply-adds: ``prepare()``, which the command line calls before anything else. Which sums a
  fused multiply-add lands on depends on what else is compiled in, so that an effect of no strength would change the
  last bit of a result; without them it does not, for some 15 % of the speed. They are a property of XLA's CPU client,
  which is made once a process: ``prepare()`` must come before JAX's first computation.
- loops of an analytic march as one piece of machine code each: by default XLA calls a kernel for every few operations
  of a loop's step, which for the small arrays of a march costs two thirds of the time. Results are the same bit by bit.
- every program in one piece: by default XLA cuts a large one up to compile it on several cores, and puts the pieces
  together again whenever it is loaded, which then takes half as long again.
- whole programs on disk (``StoredProgram``): JAX keeps compiled code on disk, but finds it by the traced program, and a
  diagnosis spent half of its time on tracing the same ten marches again. Here a file is found by a hash of all that the
  trace depends on: the package's own code, JAX's version, what the caller says of the function, the types of the
  arguments, flags and processor. So a program of other code is never read; the result is the same.
"""

import functools
import hashlib
import os
import platform
import subprocess
import sys
import threading
import warnings
from ast import literal_eval
from collections.abc import Callable, Hashable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType
from typing import Any, ParamSpec, TypeVar
from uuid import uuid4

import jax
import jax.numpy as jnp
import jaxlib
import numpy as np

from belt_sim.errors import InputError
from belt_sim.io import code_hash, write_text, write_with

try:
    from jax.experimental import serialize_executable
except ImportError:  # JAX promises nothing of its experimental parts: without it, programs are compiled as usual
    serialize_executable = None  # type: ignore[assignment]

WORKERS = 2  # marches at once, unless told otherwise
CODE = code_hash()  # taken as the code is loaded: files may change while a process runs
P = ParamSpec("P")
R = TypeVar("R")


def cores() -> int:
    """Processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def map_in_threads(function: Callable[[Any], Any], items: Iterable[Any], workers: int = WORKERS) -> list[Any]:
    """Return ``function`` of every item, computed in a few threads: XLA releases Python's lock, and a march, one long
    loop, uses one core."""
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(function, items))


def begin_in_thread(function: Callable[[], R]) -> Callable[[], R]:
    """Begin ``function`` in a thread beside what comes next, and return what waits for it and gives what it gave; the
    process ends after it."""
    pool = ThreadPoolExecutor(1)
    begun = pool.submit(function)
    pool.shutdown(wait=False)
    return begun.result


def one_blas_thread(function: Callable[P, R]) -> Callable[P, R]:
    """The function with BLAS in one thread while it runs: matrices here are small, and threads that wait burn time."""

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        from threadpoolctl import threadpool_limits

        with threadpool_limits(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return call


_CUDA = ("jax_cuda12_plugin", "jax_cuda13_plugin")
#: with this among XLA_FLAGS, results of a process can be compared bit for bit (see the module's text)
UNFUSED = "--xla_cpu_max_isa=AVX"
_WHOLE_LOOPS = f"--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold={2**30}"
_IN_ONE_PIECE = "--xla_cpu_parallel_codegen_split_count=1"
_FLAGS = (UNFUSED, _WHOLE_LOOPS, _IN_ONE_PIECE)
#: compiles three times as fast; code runs up to three times as long. JAX 0.11 has no fusion emitters to switch off
LEAST_EFFORT = {"xla_backend_optimization_level": 0, "xla_cpu_use_fusion_emitters": False}
#: of a march: it compiles in 6 s instead of 11 and in half the memory, and runs as fast, with the same results
MARCH_EFFORT = LEAST_EFFORT | {"xla_backend_optimization_level": 1}
#: of steps of a 3D belt in time: they compile in half the time, which a sixth more a step outweighs in long runs alone
STEP_EFFORT = dict(MARCH_EFFORT)
#: compiled programs of a kind that a process keeps: each maps memory, of which Linux allows 65,530 regions
PROGRAMS = 32


def jit_float64(
    function: Callable[..., Any], *, effort: dict[str, Any] | None = None, **options: Any
) -> Callable[..., Any]:
    """``jax.jit(function, **options)`` that traces and runs in float64.

    effort: of compiling, where that costs more than the runs: LEAST_EFFORT or STEP_EFFORT, which change last bits of a
    few functions only.
    """

    @functools.cache
    def compiled() -> Callable[..., Any]:
        return jax.jit(function, compiler_options=known_options(effort or {}), **options)

    return in_float64(functools.wraps(function)(lambda *args, **kwargs: compiled()(*args, **kwargs)))


def known_options(options: dict[str, Any]) -> dict[str, Any]:
    """Return those of some options of the compiler for CPUs that this XLA knows: they come and go with its versions."""
    on_cpu = jax.default_backend() == "cpu"
    return {name: value for name, value in options.items() if on_cpu and _is_known(name, value)}


@functools.cache
def _is_known(name: str, value: Any) -> bool:
    try:
        jax.jit(lambda: 0, compiler_options={name: value}).lower().compile()
    except jax.errors.JaxRuntimeError as error:
        if name not in str(error):
            raise
        return False
    return True


def _why_not_started(flags: Sequence[str]) -> str:
    """Return what XLA says as it ends a process with such XLA_FLAGS; empty where it starts."""
    command, cpu = [sys.executable, "-c", "import jax; jax.devices()"], {"JAX_PLATFORMS": "cpu"}
    environment = os.environ | cpu | {"XLA_FLAGS": " ".join(flags)}
    tried = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    said = [line for line in tried.stderr.splitlines() if "nknown flag" in line] or tried.stderr.splitlines()[-1:]
    return (" ".join(said) or f"exit status {tried.returncode}") if tried.returncode else ""


def in_float64(function: Callable[P, R]) -> Callable[P, R]:
    """The function with JAX in float64 for as long as it runs (in the calling thread)."""

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        with jax.enable_x64(True):
            return function(*args, **kwargs)

    return call


def prepare(space: bool = False) -> None:
    """Set JAX up for this process: CPU, unfused arithmetic, compiled code kept under BELT_SIM_CACHE or ~/.cache.

    space: a 3D belt of engine=mjx or quasi_static runs: on a GPU if there is one and JAX knows it (belt-sim[cuda]),
    else with all that the CPU can do, fused arithmetic as well.

    BELT_SIM_CACHE=off keeps none: every process then compiles everything itself, a minute for a diagnosis. What the
    environment already says (JAX_PLATFORMS; flags of the same names in XLA_FLAGS) stays.

    Raises InputError for variables that JAX cannot work with: XLA ends a process that has a flag which it does not
    know.
    """
    if jax.config.jax_disable_jit:  # type: ignore[attr-defined]
        raise InputError("JAX_DISABLE_JIT", "1", "", "belts are compiled; unset it")
    # without our own flags, which this process or the one that started it has set
    flags = " ".join(flag for flag in os.environ.get("XLA_FLAGS", "").split() if flag not in _FLAGS)
    if flags and (why := _why_not_started(os.environ["XLA_FLAGS"].split())):
        raise InputError("XLA_FLAGS", flags, "", f"XLA does not start with it ({why[-120:]}); unset it")

    wanted = "" if space and any(find_spec(name) for name in _CUDA) else "cpu"
    asked = os.environ.get("JAX_PLATFORMS")
    os.environ.setdefault("JAX_PLATFORMS", wanted)  # "": the fastest that there is
    jax.config.update("jax_platforms", os.environ["JAX_PLATFORMS"])
    if not space:
        said = os.environ.get("XLA_FLAGS", "").split()
        given = {flag.partition("=")[0] for flag in said}
        said += [flag for flag in _FLAGS if flag.partition("=")[0] not in given]
        os.environ["XLA_FLAGS"] = " ".join(said)
    if asked and asked != "cpu":
        try:
            jax.devices()
        except RuntimeError as error:
            first = str(error).splitlines()[0]
            raise InputError("JAX_PLATFORMS", asked, "", f"JAX finds no such device ({first}); use cpu") from error
    keep_programs(replace=True)


def keep_programs(replace: bool = False) -> None:
    """Keep compiled programs under BELT_SIM_CACHE or ~/.cache; where JAX has a cache already, only if ``replace``."""
    if not replace and jax.config.jax_compilation_cache_dir:  # type: ignore[attr-defined]
        return
    folder = os.environ.get("BELT_SIM_CACHE", str(Path.home() / ".cache" / "belt_sim" / "jax"))
    if folder == "off" and not replace:
        return
    jax.config.update("jax_enable_compilation_cache", folder != "off")
    jax.config.update("jax_compilation_cache_dir", None if folder == "off" else folder)
    # a folder that can only be read keeps nothing: no word of it for every program
    warnings.filterwarnings("ignore", "Error (reading|writing) persistent compilation cache entry")
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


STORED = "stored"  # below JAX's folder of compiled programs
UNREADABLE = (OSError, ValueError, SyntaxError)  # no such file, one that is damaged, or another's


def program_key(name: str, model: Any, effects: Iterable[type], *shape: Any) -> str | None:
    """Return a name for a program of a composition of laws and classes of effects; shape: whatever else shapes the
    trace, of plain values. None where the hash does not hold all of its code: a part, or a hook of a class, is not what
    the package's source has there."""
    parts = [model.span, *effects, *map(type, model.built_in)]
    if not all(getattr(sys.modules.get(p.__module__), p.__qualname__, None) is p for p in parts):
        return None
    members = [(p, p.__module__, p.__qualname__) for p in parts if not isinstance(p, type)]
    for c in dict.fromkeys(c for p in parts if isinstance(p, type) for c in p.__mro__[:-1]):
        members += [(m, c.__module__, f"{c.__qualname__}.{n}") for n, m in vars(c).items() if not n.startswith("__")]
    held = []  # names of functions, and values with theirs
    for member, module, place in members:
        function = getattr(member, "__func__", member)  # of a class method
        if isinstance(function, FunctionType):  # only its code tells: functools.wraps copies all else
            written = function.__code__.co_filename, function.__code__.co_qualname
            if not module.startswith("belt_sim.") or written != (sys.modules[module].__file__, place):
                return None
            held.append(place)
        elif callable(member) or hasattr(member, "__get__"):  # a partial method, a property, a compiled function
            return None
        else:
            held.append(f"{place} = {sorted(member) if isinstance(member, frozenset) else member}")
    laws = (model.name, sorted(model.hooks), sorted(model.contains), model.built_in, model.moments)
    return repr((name, laws, [(p.__module__, p.__qualname__) for p in parts], held, shape))


@functools.cache
def _machine() -> tuple[str, ...]:
    """What machine code depends on besides its program: versions, flags, and what the processor is and can do."""
    processor = platform.processor()
    with suppress(OSError):
        first = Path("/proc/cpuinfo").read_text(encoding="utf-8").split("\n\n")[0].splitlines()
        processor = "\n".join(sorted(x for x in first if x.startswith(("model name", "flags", "Features", "CPU part"))))
    return jax.__version__, jaxlib.__version__, os.environ.get("XLA_FLAGS", ""), processor


def _digest(*parts: Any) -> str:
    return hashlib.sha256("\n".join(map(str, parts)).encode()).hexdigest()


def _load(file: Path) -> Callable[..., Any]:
    """The program of a file; raises UNREADABLE."""
    kept = file.read_bytes()
    if hashlib.sha256(kept[32:]).digest() != kept[:32]:
        raise ValueError(file)
    head, _, program = kept[32:].partition(b"\n")
    inputs, outputs, calls_lapack = literal_eval(head.decode())
    if calls_lapack:  # which JAX loads as it lowers what calls it
        jax.jit(jnp.linalg.cholesky).lower(jnp.eye(1))
    given, made = jax.tree.structure(((0,) * inputs, {})), jax.tree.structure(outputs)
    try:
        one = jax.devices()[:1]
        return serialize_executable.deserialize_and_load(program, given, made, execution_devices=one)
    except Exception as error:  # of whatever kind: XLA, pickle and an interface that may change each have their own
        raise ValueError(file) from error


@functools.cache
def _can_store() -> bool:
    """Whether this JAX writes a program and reads it again; asked before the first program is compiled for the disk."""
    try:
        content, given, made = serialize_executable.serialize(jax.jit(lambda: 0).lower().compile())
        serialize_executable.deserialize_and_load(content, given, made, execution_devices=jax.devices()[:1])
    except Exception:
        return False
    return True


class StoredProgram:
    """A function compiled in float64, which is kept on disk.

    function: takes pytrees of numbers, returns arrays in tuples, lists and dicts; key: its name and everything that
    shapes its trace except the types of its arguments, as text; None: nothing is kept on disk; brief: it is
    compiled with LEAST_EFFORT, as it runs so seldom that compiling costs more.
    """

    def __init__(self, function: Callable[..., Any], key: str | None, *, brief: bool = False) -> None:
        self.function, self.key = function, key
        self.effort = LEAST_EFFORT if brief else MARCH_EFFORT
        self.programs: dict[Hashable, Callable[..., Any]] = {}
        self.lock = threading.Lock()

    def __call__(self, *arguments: Any) -> Any:
        """Return what the function gives, by its program from memory, from disk, or traced now."""
        leaves, structure = jax.tree.flatten(arguments)
        leaves = [x if hasattr(x, "dtype") else np.asarray(x) for x in leaves]  # a plain number needs no other program
        with jax.enable_x64(True):
            types = tuple(map(jax.typeof, leaves))
            with self.lock:
                if (structure, types) not in self.programs:
                    if len(self.programs) >= PROGRAMS:
                        self.programs.clear()
                    self.programs[structure, types] = self._make(leaves, structure, types)
                program = self.programs[structure, types]
            return program(*leaves)

    def _make(self, leaves: list[Any], structure: Any, types: tuple[Any, ...]) -> Callable[..., Any]:
        """Return the compiled function of leaves, one argument each, from disk or traced now."""

        def stored_program(*leaves: Any) -> Any:
            return self.function(*jax.tree.unflatten(structure, leaves))

        compiled = functools.partial(jax.jit, stored_program)
        folder = jax.config.jax_compilation_cache_dir  # type: ignore[attr-defined]
        if self.key is None or not folder or jax.default_backend() != "cpu":
            return compiled(compiler_options=known_options(self.effort))
        asked = Path(folder) / STORED / _digest(CODE, self.key, structure, types, self.effort, *_machine())
        with suppress(*UNREADABLE):
            return _load(asked.with_name(asked.read_text()))
        if not _can_store():
            return compiled(compiler_options=known_options(self.effort))

        # a name of its own: a program that JAX finds in its own cache cannot be written again
        name = stored_program.__name__ = stored_program.__qualname__ = f"program_{uuid4().hex}"
        traced = compiled(keep_unused=True, compiler_options=known_options(self.effort)).lower(*leaves)
        # take out of it where its operations stand in the code: a third of it, and a tenth of loading it; JAX does not
        # document what does so, and they stay where that fails
        module: Any = traced.compiler_ir()
        with suppress(Exception), module.context:
            from jaxlib.mlir.passmanager import PassManager

            PassManager.parse("builtin.module(strip-debuginfo)").run(module.operation)

        # the same compiled program may be there already, of other code
        text = traced.as_text().replace(name, "")
        file = asked.with_name(f"{_digest(text, traced.in_tree, traced.out_tree, self.effort, *_machine())}.program")
        found = None
        with suppress(*UNREADABLE):
            found = _load(file)
        program: Any = found or traced.compile()
        for left in Path(folder).glob(f"*{name}*"):  # in JAX's own cache, where nothing finds it again
            left.unlink(missing_ok=True)
        with suppress(Exception):  # JAX cannot write every program, and a full or read-only disk keeps none
            if found is None:  # as ``_load`` reads it
                content, inputs, outputs = serialize_executable.serialize(program)
                nested = jax.tree.unflatten(outputs, [0] * outputs.num_leaves)
                head = f"{(inputs.num_leaves, nested, 'lapack' in (program.as_text() or ''))}\n".encode()
                kept = hashlib.sha256(head + content).digest() + head + content
                write_with(file, lambda path: path.write_bytes(kept))
            write_text(asked, file.name)
        return program
