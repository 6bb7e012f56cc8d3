"""A run in its folder, as Hydra calls it: alone or as a case of a sweep.

The folder is locked while the run is at work, filled in one move, and kept only as long as its inputs are the same.

``.hydra/run.json`` (belt-run/1) says what a run was: hashes of its configuration, of the code, of every file that it
read and of every file that it wrote. A sweep keeps a case only where all of them still hold.
"""

import ast
import errno
import os
import shutil
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from math import inf
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import yaml
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from belt_sim.commands import sweep
from belt_sim.commands.words import COMMANDS, OUTPUT, one_line
from belt_sim.errors import BeltError, InputError
from belt_sim.io import (
    DRAFTS,
    careful_yaml,
    clear_drafts,
    code_hash,
    config_hash,
    file_hash,
    read_json,
    write_json,
    write_text,
)

try:
    import fcntl
except ImportError:  # not on this system: runs in one folder at once are the user's business
    fcntl = None  # type: ignore[assignment]

SCHEMA = "belt-run/1"
NOTES = ".hydra"  # folder of what is said about a run
FAILED = "failed.txt"


@dataclass(frozen=True)
class RunDir:
    """Where a run of ``command`` leaves its files. overrides: as typed; case: its number in a sweep."""

    path: Path
    command: str
    config: Mapping[str, Any]
    overrides: Sequence[str] = ()
    case: int | None = None

    @staticmethod
    def of_hydra(config: DictConfig, hydra: DictConfig, command: str) -> "RunDir":
        """The run that a configuration and Hydra's own part of it describe; raises BeltError for what has no value."""
        many = hydra.mode == RunMode.MULTIRUN
        try:
            path = Path(hydra.sweep.dir) / str(hydra.sweep.subdir) if many else Path(hydra.run.dir)
            return RunDir(path, command, plain(config), list(hydra.overrides.task), hydra.job.num if many else None)
        except OmegaConfBaseException as error:
            raise BeltError(one_line(error, command)) from error

    def text_setting(self, key: str, what: str) -> str:
        """A file or folder that the configuration names; raises InputError for what is no text."""
        value = self.config[key]
        if not isinstance(value, str) or not value.strip():
            raise InputError(key, "null" if value is None else value, "", f"name {what}")
        return value

    @property
    def campaign(self) -> str:
        """The campaign that the configuration names."""
        return self.text_setting("campaign", "the folder of a campaign")

    def why_not_done(self) -> str | None:
        """None when the folder holds the result of this very configuration, unharmed and of today's inputs and code;
        else why the case runs again, empty where it never came to its end."""
        try:
            record = read_json(self.path / NOTES / "run.json")
            if record["schema"] != SCHEMA or record["config_sha256"] != config_hash(self.config):
                return ""
            inputs, files = dict(record["inputs"]), dict(record["files"])
            if record["code_sha256"] != code_hash():
                return "the code of belt-sim has changed"
        except FileNotFoundError:
            return ""
        except (BeltError, KeyError, TypeError, ValueError):
            return f"{NOTES}/run.json is damaged"
        now = input_hashes(self.config)
        changed = sorted(name for name in inputs.keys() | now.keys() if inputs.get(name) != now.get(name))
        if changed:
            return f"{changed[0]} has changed"
        for name, digest in files.items():
            if not (self.path / name).is_file():
                return f"{name} is missing"
            if file_hash(self.path / name) != digest:
                return f"{name} has been changed"
        return None

    @contextmanager
    def open(self) -> Iterator[None]:
        """Around a run: the folder is locked, and a run that is refused leaves none. Raises InputError where another
        run is at work."""
        notes = self.path / NOTES
        notes.mkdir(parents=True, exist_ok=True)
        with _lock(notes / "lock", self.path):  # whoever is refused here leaves the folder to the run at work
            clear_drafts(self.path)
            clear_drafts(notes)
            (self.path / FAILED).unlink(missing_ok=True)
            yield

    @contextmanager
    def outputs(self, *beside: str) -> Iterator[Path]:
        """A draft of the folder; when the block has ended, its files replace those of the command's last run.

        beside: files that the run wrote to the folder itself (a recording grows while it is watched).
        """
        draft = self.path / f"{DRAFTS}.{os.getpid()}"
        read = input_hashes(self.config)  # as they were when the run began
        draft.mkdir(parents=True, exist_ok=True)
        try:
            yield draft
            self._move_in(draft, read, [name for name in beside if (self.path / name).is_file()])
        finally:
            shutil.rmtree(draft, ignore_errors=True)

    def _move_in(self, draft: Path, read: Mapping[str, str], beside: Sequence[str]) -> None:
        """The record comes first, summary.json last: what is killed meanwhile does not match its record."""
        names = sorted(str(p.relative_to(draft)) for p in draft.rglob("*") if p.is_file())
        names.sort(key=lambda name: name == "summary.json")
        record = self.path / NOTES / "run.json"
        before: list[str] = []  # what the command's last run left
        with suppress(OSError, BeltError, KeyError, TypeError):  # no record, or a damaged one
            content = read_json(record)
            before = [str(name) for name in content["files"]] if content["command"] == self.command else []
        files = {name: file_hash(draft / name) for name in names} | {n: file_hash(self.path / n) for n in beside}
        content = {"schema": SCHEMA, "command": self.command, "config_sha256": config_hash(self.config)}
        write_json(record, {**content, "code_sha256": code_hash(), "inputs": dict(read), "files": files})
        for name in names:
            place = self.path / name
            try:
                place.parent.mkdir(parents=True, exist_ok=True)
                os.replace(draft / name, place)
            except OSError as error:
                raise BeltError(f"{place}: {error.strerror}; move it away") from None
        for name in set(before) - set(files):
            if not Path(name).is_absolute() and ".." not in Path(name).parts:
                with suppress(OSError):
                    (self.path / name).unlink(missing_ok=True)

    def carry_out(self, computed: Any = None) -> float | None:
        """Run a case of a sweep unless its result is there; return what the command returns."""
        again = self.why_not_done()
        if again is None:
            (self.path / FAILED).unlink(missing_ok=True)
            print(f"done before, kept: {self.path}", flush=True)
            sought = self.config.get("objective") is not None
            return self._task()(self, done=True) if sought else None  # type: ignore[no-any-return]
        if again:
            print(f"runs again, {again}: {self.path}", flush=True)
        return self.carry_out_alone(**({} if computed is None else {"computed": computed}))

    def carry_out_alone(self, **given: Any) -> float | None:
        """Run the command in the folder; return what it returns."""
        task = self._task()
        with nullcontext() if self.command in WITHOUT_FOLDER else self.open():
            return task(self, **given)  # type: ignore[no-any-return]

    def _task(self) -> Callable[..., Any]:
        """The function of the command, imported only now: JAX and MuJoCo take a while."""
        prepare_jax(self.config.get("engine") not in (None, *ON_ONE_CORE))
        from belt_sim.settings import check_switches

        check_switches(self.command, self.config)
        return resolve_name(f"belt_sim.commands.{COMMANDS[self.command][1]}")  # type: ignore[no-any-return]

    def fail(self, message: str) -> None:
        """Write down why the case has failed; a disk that takes nothing more does not stop the other cases."""
        try:
            write_text(self.path / FAILED, " ".join(message.split()) + "\n")
        except OSError as error:
            print(f"belt-sim: {self.path} = {error.strerror or error}", file=sys.stderr)


@contextmanager
def _lock(path: Path, folder: Path) -> Iterator[None]:
    if fcntl is None:
        yield
        return
    with path.open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            remedy = "another run is at work there; give each run a folder of its own"
            raise InputError("hydra.run.dir", str(folder), "", remedy) from error
        yield


#: commands that say themselves where their files go
WITHOUT_FOLDER = ("app", "report", "reveal", "scene")
#: engines that leave a GPU alone
ON_ONE_CORE = ("native", "line", "mujoco")
#: [bytes] of address space that JAX needs: with less, XLA ends the process in the midst of its work
LEAST_MEMORY = 2_500_000_000


def run_task(config: DictConfig, *, command: str, computed: Any = None) -> float | None:
    """What Hydra calls: the command in its folder, or what is left of it to do; returns the number that a search reads.

    computed: curves that a batch has found for the case. A failure is one line and counted (``sweep.note``); a case of
    a sweep that fails has it in failed.txt and stops no other case.
    """
    hydra = HydraConfig.get()
    many = hydra.mode == RunMode.MULTIRUN
    nothing = _worst(hydra) if many else None
    if many and sweep.failing_alike(hydra):
        return nothing
    run: RunDir | None = None
    failure, value = "", None
    try:
        run = RunDir.of_hydra(config, hydra, command)
        sweep.note(hydra, run.path.name, sweep.LOST) if many else None
        value = run.carry_out(computed) if many else run.carry_out_alone()
    except BeltError as error:
        failure = str(error)
    except OSError as error:
        failure = told(error, run.path if run else "hydra.run.dir")
        if error.filename == OUTPUT:
            sweep.at_work["crash"] = error
            return nothing
    except Exception as error:
        failure = f"{type(error).__name__}: {error}"
        if not many:
            sweep.at_work["crash"] = error  # Hydra would print words of its own
            return nothing
        traceback.print_exception(error, file=sys.stderr)
    if failure and many and run is not None:
        run.fail(failure)
    elif failure and hydra.output_subdir is not None:
        leave_nothing(Path(hydra.runtime.output_dir))
    sweep.note(hydra, run.path.name if run else "", failure)
    return nothing if failure else value


def leave_nothing(folder: Path) -> None:
    """Remove the folder of a run that was refused, where it holds nothing but what Hydra noted."""
    with suppress(OSError):
        if {p.name for p in folder.iterdir()} <= {NOTES} and not (folder / NOTES / "run.json").exists():
            shutil.rmtree(folder / NOTES, ignore_errors=True)
            folder.rmdir()


def _worst(hydra: DictConfig) -> float | None:
    """What a case that failed counts in a search: the worst there is; None where nothing is sought."""
    direction = OmegaConf.select(hydra, "sweeper.direction")
    return None if direction is None else (-inf if "maximize" in str(direction) else inf)


def told(error: OSError, path: object) -> str:
    """An error of the system in one line: what it is about, what went wrong, what to do."""
    remedy = _REMEDIES.get(error.errno or 0, "choose a folder that can be written")
    return f"{error.filename or path} = {error.strerror or error}: {remedy}"


_REMEDIES = {
    errno.ENOMEM: "free memory, or ask for less at once",
    errno.ENOSPC: "free the disk; what was finished is kept",
    errno.EDQUOT: "free the disk; what was finished is kept",
    errno.EFBIG: "raise the limit of file sizes (ulimit -f)",
    errno.EMFILE: "raise the limit of open files (ulimit -n)",
}


def plain(config: DictConfig) -> dict[str, Any]:
    """A configuration as plain dicts and lists, without Hydra's own."""
    bare = OmegaConf.masked_copy(config, [k for k in config if k != "hydra"]) if "hydra" in config else config
    return OmegaConf.to_container(bare, resolve=True, throw_on_missing=True)  # type: ignore[return-value]


@cache
def prepare_jax(space: bool) -> None:
    """Set JAX up for this process; raises InputError for what it cannot work with."""
    if find_spec("resource") is not None:  # not on Windows
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY and limit < LEAST_MEMORY:
            needed = f"at least {LEAST_MEMORY / 1e9:g} GB of address space are needed"
            raise InputError(
                "ulimit -v", f"{limit / 1e9:.3g}", "GB", f"{needed}; raise the limit (ulimit -v unlimited)"
            )
    try:
        from belt_sim.jax_setup import check_environment, prepare
    except ValueError as error:  # JAX reads JAX_... as it is imported
        raise BeltError(f"JAX_...: {error}; unset it") from error
    check_environment()
    prepare(space)


def input_hashes(config: Any) -> dict[str, str]:
    """Path -> SHA-256 of every file that a configuration names: campaign folders, effects, scenes, mappings."""
    found: dict[str, str] = {}
    for path in _named_files(config):
        with suppress(OSError):  # a run that cannot read it says so
            found[str(path)] = file_hash(path)
    return found


def _named_files(value: Any, key: str = "") -> Iterator[Path]:
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _named_files(inner, str(name))
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from _named_files(inner, key)
    elif isinstance(value, str) and value and key not in ("out", "draft"):
        if key == "campaign":
            from belt_sim.campaign.folder import campaign_folder

            with suppress(OSError, BeltError):
                yield from sorted(p for p in campaign_folder(value).glob("*") if p.is_file())
        elif len(value) < 4096 and "\0" not in value and Path(value).suffix and Path(value).is_file():
            yield from _with_what_it_names(Path(value), set())


def _with_what_it_names(path: Path, seen: set[Path]) -> Iterator[Path]:
    """A file, the .py files that an effects.yaml names, and the modules beside a .py file that it imports."""
    if path in seen:
        return
    seen.add(path)
    yield path
    names: list[str] = []
    with suppress(OSError, ValueError, SyntaxError, yaml.YAMLError):
        if path.suffix in (".yaml", ".yml"):
            names = _python_files(careful_yaml(path.read_bytes(), path.name))
        elif path.suffix == ".py":
            names = _imports(path.read_text(encoding="utf-8"))
    for name in names:
        for place in (Path(name), path.parent / name):
            if place.is_file():
                yield from _with_what_it_names(place, seen)
                break


def _python_files(content: Any) -> list[str]:
    if isinstance(content, Mapping):
        return [name for inner in content.values() for name in _python_files(inner)]
    if isinstance(content, list):
        return [name for inner in content for name in _python_files(inner)]
    return [content] if isinstance(content, str) and content.endswith(".py") else []


def _imports(text: str) -> list[str]:
    names: list[str] = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.append(node.module)
    return [f"{name.replace('.', '/')}.py" for name in names]
