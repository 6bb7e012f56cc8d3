"""The folder of one run (locked while it runs, filled in one move, kept only as long as its inputs are the same), and a
run in it, alone or as a case of a sweep.

``.hydra/run.json`` (belt-run/1) says what a run was: hashes of its configuration, of the code, of every file that it
read and of every file that it wrote. A sweep keeps a case only where all of them still hold.
"""

import os
import shutil
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import yaml

from belt_sim.errors import BeltError, InputError
from belt_sim.files import DRAFTS, clear_drafts, read_json, write_json, write_text
from belt_sim.provenance import code_hash, config_hash, file_hash, input_hashes

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
            write_text(notes / "config.yaml", yaml.safe_dump(dict(self.config), sort_keys=False, allow_unicode=True))
            write_text(notes / "overrides.yaml", yaml.safe_dump(list(self.overrides), allow_unicode=True))
            try:
                yield
            except BeltError:
                if {p.name for p in self.path.iterdir()} <= {NOTES}:
                    shutil.rmtree(notes, ignore_errors=True)
                    with suppress(OSError):
                        self.path.rmdir()
                raise

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


WITHOUT_FOLDER = ("app", "map", "report", "reveal", "scene")  # commands that say themselves where their files go


@dataclass(frozen=True)
class Outcome:
    """How a run ended. value: what the command returns; failure: empty when it went well."""

    value: float | None = None
    failure: str = ""


#: command -> what it does, and where its function is in belt_sim.commands (empty: in cli)
COMMANDS = {
    "simulate": ("one model, one case: curves and late rates", "simulate:simulate"),
    "scene": ("a 3D belt as MJCF that runs in plain MuJoCo", "simulate:scene"),
    "compare": ("a model against a measured campaign: where it agrees, where it fails", "inference:compare"),
    "diagnose": ("which physical effect the model lacks", "inference:diagnose"),
    "import": ("a logger's files (CSV, xlsx ...) -> a campaign", "campaigns:import_"),
    "new": ("an empty, commented campaign with the runs that a diagnosis needs", "campaigns:new"),
    "check": ("the linter, and what a campaign can and cannot tell", "inference:check"),
    "virtual-rig": ("make a campaign with a hidden effect", "campaigns:virtual_rig"),
    "reveal": ("what was hidden in such a campaign", "campaigns:reveal"),
    "export": ("the linear plant for a controller: FMU, MAT file, Bode plot", "simulate:export"),
    "map": ("very many cases of an analytic model, as one table", "map:map_cases"),
    "report": ("write the report of a diagnosis again", "inference:report"),
    "app": ("a local web page: sliders, own measurements, diagnoses", "app:app"),
    "new-effect": ("a file with a whole effect, to be changed into one of your own", ""),
    "demo": ("a diagnosis of a campaign that ships, into outputs/demo", ""),
    "completion": ('completion in bash and zsh: eval "$(belt-sim completion)"', ""),
}


def task(command: str) -> Callable[..., Any]:
    """The function behind a command, imported only when it is needed."""
    return resolve_name(f"belt_sim.commands.{COMMANDS[command][1]}")  # type: ignore[no-any-return]


def run_alone(run: RunDir, **given: Any) -> float | None:
    """Run the command of ``run`` in its folder, and return what it returns."""
    from belt_sim.config import check_switches  # it loads JAX

    check_switches(run.command, run.config)
    with nullcontext() if run.command in WITHOUT_FOLDER else run.open():
        return task(run.command)(run, **given)  # type: ignore[no-any-return]


def run_case(run: RunDir, **given: Any) -> Outcome:
    """Run a case of a sweep unless its result is there; given: what the command takes beside its folder.

    A failure is told, stands in failed.txt of the case's folder, and stops no other case.
    """
    try:
        again = run.why_not_done()
        if again is None:
            print(f"done before, kept: {run.path}", flush=True)
            return Outcome(task(run.command)(run, done=True) if run.command == "simulate" else None)
        if again:
            print(f"runs again, {again}: {run.path}", flush=True)
        return Outcome(run_alone(run, **given))
    except BeltError as error:
        failure = str(error)
        print(f"belt-sim: {failure}", file=sys.stderr, flush=True)
    except OSError as error:  # a full disk
        failure = f"{error.filename or run.path} = {error.strerror or error}"
        print(f"belt-sim: {failure}", file=sys.stderr, flush=True)
    except Exception as error:
        failure = f"{type(error).__name__}: {error}"
        traceback.print_exception(error, file=sys.stderr)
    run.fail(failure)
    return Outcome(failure=failure)
