"""Runs and sweeps as Hydra calls us.

A run's folder is locked while the run is at work, filled in one move, and kept only as long as its inputs are the same.
``.hydra/run.json`` (belt-run/1) says what a run was: hashes of its configuration, of the code, of every file that it
read and of every file that it wrote. A sweep keeps a case only where all of them still hold.

Every case of a sweep, in whatever process, adds a line to ``.cases`` in the sweep's folder when it begins and when it
has ended: its number, its folder, its overrides, why it failed, in JSON. The last line of each becomes a row of
sweep.csv.
"""

import errno
import json
import os
import re
import shutil
import sys
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from itertools import islice
from math import inf
from modulefinder import ModuleFinder
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException
from hydra.experimental.callback import Callback
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from belt_sim.commands import COMMANDS, OUTPUT, known_keys, nearest, one_line
from belt_sim.errors import BeltError, InputError, whole
from belt_sim.io import (
    CONF,
    DRAFTS,
    clear_drafts,
    code_hash,
    config_hash,
    file_hash,
    read_json,
    write_json,
    write_with,
)

try:
    import fcntl
except ImportError:  # not on this system: runs in one folder at once are the user's business
    fcntl = None  # type: ignore[assignment]

RUN_SCHEMA = "belt-run/1"
NOTES = ".hydra"  # folder of what is said about a run
CASES = ".cases"
BUSY = "another run is at work there"
CASE_LOST = "its process or job was lost (killed, out of memory or of time); run the same command again"
CASE_STOPPED = "it was stopped; run the same command again"
#: of the run or sweep of this process: its folder, its lock, its configuration, and lines about what failed
at_work: dict[str, Any] = {}
#: engines that leave a GPU alone
ON_ONE_CORE = ("native", "line", "mujoco")
#: [bytes] of address space that JAX needs: with less, XLA ends the process in the midst of its work
LEAST_MEMORY = 2_500_000_000


def _lock(path: Path, key: str, folder: Path, remedy: str) -> Any:
    """The open file that is locked until it is closed; raises InputError where another process has it."""
    lock = path.open("a")
    if fcntl is not None:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            lock.close()
            raise InputError(key, str(folder), "", remedy) from error
    return lock


# ---- a run


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
        """The run that a configuration and Hydra's own part of it describe; raises BeltError for what has no value and
        for a key that the command does not know."""
        many = hydra.mode == RunMode.MULTIRUN
        try:
            path = Path(hydra.sweep.dir) / str(hydra.sweep.subdir) if many else Path(hydra.run.dir)
            used = re.findall(r"\$\{(\w+)", OmegaConf.to_yaml(config))  # by other values

            # a key that a file of the user's has and the command would not read; a model says what it takes
            known, own = known_keys(command), [*hydra.runtime.choices, *used]
            groups = {key.split(".")[0] for key in known if "." in key} - {"model"}
            inside = [f"{group}.{key}" for group in groups for key in config.get(group) or {}]
            for key in [*(str(key) for key in config if key not in own), *inside]:
                if key not in known:
                    raise BeltError(f"{key}: no such key{nearest(key, known)}")
            settings, number = plain_settings(config), hydra.job.num if many else None  # raises for what has no value
            return RunDir(path, command, settings, list(hydra.overrides.task), number)
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
            if record["schema"] != RUN_SCHEMA or record["config_sha256"] != config_hash(self.config):
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
    def outputs(self, *beside: str) -> Iterator[Path]:
        """A draft of the folder; when the block has ended, its files replace those of the command's last run.

        beside: files that the run wrote to the folder itself (a recording grows while it is watched). The record comes
        first, summary.json last: what is killed meanwhile does not match its record.
        """
        draft, record = self.path / f"{DRAFTS}.{os.getpid()}", self.path / NOTES / "run.json"
        read = input_hashes(self.config)  # as they were when the run began
        draft.mkdir(parents=True, exist_ok=True)
        try:
            yield draft
            names = sorted(str(p.relative_to(draft)) for p in draft.rglob("*") if p.is_file())
            names.sort(key=lambda name: name == "summary.json")
            before: list[str] = []  # what the command's last run left
            with suppress(OSError, BeltError, KeyError, TypeError):  # no record, or a damaged one
                last = read_json(record)
                before = [str(name) for name in last["files"]] if last["command"] == self.command else []
            files = {name: file_hash(draft / name) for name in names}
            files |= {name: file_hash(self.path / name) for name in beside if (self.path / name).is_file()}
            content = {"schema": RUN_SCHEMA, "command": self.command, "config_sha256": config_hash(self.config)}
            write_json(record, {**content, "code_sha256": code_hash(), "inputs": read, "files": files})
            at_work.pop("notes", None)  # Hydra's own of today hold from now on
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
        finally:
            shutil.rmtree(draft, ignore_errors=True)

    def carry_out(self, computed: Any = None) -> float | None:
        """Run the command in the folder, a case of a sweep only where its result is not there; return what it returns.

        The folder is locked meanwhile; raises InputError where another run is at work. A run that is refused leaves
        none. The function of the command is imported only now: JAX and MuJoCo take a while.
        """
        again = "" if self.case is None else self.why_not_done()
        if again is None:
            print(f"done before, kept: {self.path}", flush=True)
            if self.config.get("objective") is None:
                return None
        elif again:
            print(f"runs again, {again}: {self.path}", flush=True)
        prepare_jax(self.config.get("engine") not in (None, *ON_ONE_CORE))
        from belt_sim.settings import check_switches

        check_switches(self.command, self.config)
        task = resolve_name(f"belt_sim.{COMMANDS[self.command][1]}")
        if again is None:
            return task(self, done=True)  # type: ignore[no-any-return]
        with ExitStack() as stack:
            if "in_place" not in OmegaConf.load(CONF / f"{self.command}.yaml").defaults:
                notes = self.path / NOTES
                notes.mkdir(parents=True, exist_ok=True)
                remedy = f"{BUSY}; give each run a folder of its own"
                stack.enter_context(_lock(notes / "lock", "hydra.run.dir", self.path, remedy))
                clear_drafts(self.path)
                clear_drafts(notes)
            return task(self, **({} if computed is None else {"computed": computed}))  # type: ignore[no-any-return]


def run_task(config: DictConfig, *, command: str, computed: Any = None) -> float | None:
    """What Hydra calls: the command in its folder, or what is left of it to do; returns the number that a search reads.

    computed: curves that a batch has found for the case. A failure is one line and counted (``note_end``); a case of a
    sweep that fails stops no other, and counts in a search as the worst there is.
    """
    hydra: Any = HydraConfig.get()
    many, direction = hydra.mode == RunMode.MULTIRUN, OmegaConf.select(hydra, "sweeper.direction")
    worst = -inf if "maximize" in str(direction) else inf
    value = worst if many and direction is not None else None
    run: RunDir | None = None
    failure = failing_alike(hydra) if many else ""
    try:
        if not failure:
            run = RunDir.of_hydra(config, hydra, command)
            note_end(hydra, run.path.name, CASE_LOST) if many else None
            value = run.carry_out(computed)
            at_work.pop("notes", None)
    except BeltError as error:
        failure = explain(error, "") if isinstance(error, OSError) else str(error)
    except Exception as error:
        if getattr(error, "filename", None) == OUTPUT or not (many or isinstance(error, OSError)):
            at_work["crash"] = error  # Hydra would print words of its own
            return value
        if isinstance(error, OSError):
            failure = explain(error, run.path if run else "hydra.run.dir")
        else:
            failure = f"{type(error).__name__}: {error}"
            traceback.print_exception(error, file=sys.stderr)
    if failure and not many and hydra.output_subdir is not None and BUSY not in failure:
        # refused: nothing stays where Hydra alone noted something
        folder = Path(hydra.runtime.output_dir)
        with suppress(OSError):
            if {p.name for p in folder.iterdir()} <= {NOTES} and not (folder / NOTES / "run.json").exists():
                shutil.rmtree(folder / NOTES, ignore_errors=True)
                folder.rmdir()
    note_end(hydra, run.path.name if run else "", failure)
    return value


FREE_THE_DISK = "free the disk; what was finished is kept"
SYSTEM_REMEDIES = {
    errno.ENOMEM: "free memory, or ask for less at once",
    **{errno.ENOSPC: FREE_THE_DISK, errno.EDQUOT: FREE_THE_DISK},
    errno.EFBIG: "raise the limit of file sizes (ulimit -f)",
    errno.EMFILE: "raise the limit of open files (ulimit -n)",
    **dict.fromkeys((errno.EEXIST, errno.ENOTDIR, errno.ELOOP), "it is no folder; name another"),
}


def explain(error: OSError, path: object) -> str:
    """An error of the system in one line: what it is about, what went wrong, what to do."""
    remedy = SYSTEM_REMEDIES.get(error.errno or 0, "choose a file or folder that can be read and written")
    return f"{error.filename or path} = {error.strerror or error}: {remedy}"


def plain_settings(config: DictConfig) -> dict[str, Any]:
    """A configuration as plain dicts and lists, without Hydra's own."""
    bare = OmegaConf.masked_copy(config, [str(k) for k in config if k != "hydra"]) if "hydra" in config else config
    return OmegaConf.to_container(bare, resolve=True, throw_on_missing=True)  # type: ignore[return-value]


@cache
def prepare_jax(space: bool) -> None:
    """Set JAX up for this process; raises InputError for what it cannot work with."""
    if find_spec("resource") is not None:  # not on Windows
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY and limit < LEAST_MEMORY:
            needed = f"at least {LEAST_MEMORY / 1e9:g} GB of address space are needed"
            remedy = f"{needed}; raise the limit (ulimit -v unlimited)"
            raise InputError("ulimit -v", f"{limit / 1e9:.3g}", "GB", remedy)
    try:
        from belt_sim.jax_setup import prepare
    except ValueError as error:  # JAX reads JAX_... as it is imported
        raise BeltError(f"JAX_...: {error}; unset it") from error
    prepare(space)


class _Imports(ModuleFinder):
    """What a file imports, a module that does not compile included, which it may go without."""

    def load_module(self, fqname: str, fp: Any, pathname: str, file_info: Any) -> Any:
        """A module without what it imports, where its text is no Python."""
        try:
            return super().load_module(fqname, fp, pathname, file_info)
        except SyntaxError:
            module: Any = self.add_module(fqname)
            module.__file__ = pathname
            return module


def input_hashes(config: Any) -> dict[str, str]:
    """Path -> SHA-256 of every file that a configuration names (campaign folders, effects, scenes, mappings), of the
    .py files that an effects.yaml names, and of all modules that these import from their own or the current folder."""
    found: dict[str, str] = {}
    left: list[tuple[str, Any]] = [("", config)]  # keys, and what stands there
    while left:
        key, value = left.pop()
        if isinstance(value, Mapping):
            left += [(str(name), inner) for name, inner in value.items()]
        elif isinstance(value, list | tuple):
            left += [(key, inner) for inner in value]
        elif key == "campaign" and isinstance(value, str) and value:
            from belt_sim.campaign.folder import campaign_folder

            with suppress(OSError, BeltError):
                left += [("", path) for path in campaign_folder(value).glob("*")]
        elif isinstance(value, Path) or (isinstance(value, str) and key not in ("out", "draft") and "." in value[-10:]):
            path = Path(value)
            if str(path) in found:
                continue
            with suppress(OSError, ValueError):  # no file; a run that cannot read it says so
                found[str(path)] = file_hash(path)
                if path.suffix == ".py":
                    finder = _Imports([str(path.parent), os.getcwd()], excludes=["belt_sim"])
                    with suppress(Exception):  # what it cannot follow; the modules found so far count
                        finder.run_script(str(path))
                    files = [getattr(module, "__file__", None) for module in finder.modules.values()]
                    found |= {file: file_hash(Path(file)) for file in files if file}
                elif path.suffix in (".yaml", ".yml"):
                    text = path.read_text(encoding="utf-8", errors="replace")
                    names = [name.strip(" -\t") for name in re.findall(r"[^\n'\"\[\],:{}]+\.py\b", text)]
                    both = ((path.parent / name, Path(name)) for name in names)
                    places = (next((p for p in two if p.is_file()), None) for two in both)
                    left += [("", place) for place in places if place is not None]
    return found


# ---- a sweep


class Sweep(Callback):
    """Hydra's callback. stop_after: a sweep whose first so many cases fail alike stops; None: it tries all."""

    def __init__(self, stop_after: int | None = 5) -> None:
        self.stop_after = stop_after

    def on_run_start(self, config: DictConfig, **kwargs: Any) -> None:
        """Keep the notes of the folder's last run, over which Hydra writes before a run is refused or fails."""
        with _end_process_where_refused(config), suppress(OSError, TypeError, OmegaConfBaseException):
            at_work["folder"] = Path(config.hydra.run.dir)
            notes = at_work["folder"] / config.hydra.output_subdir
            at_work["notes"] = {path: path.read_bytes() for path in notes.glob("*.yaml")}

    def on_multirun_start(self, config: DictConfig, **kwargs: Any) -> None:
        """Lock the folder and begin its notes; end the process where another sweep is at work there, or where the sweep
        cannot be: of no values, or a search without an objective that can be."""
        folder, params = Path(config.hydra.sweep.dir), OmegaConf.select(config, "hydra.sweeper.params") or {}
        typed = [*(f"{key}={value}" for key, value in params.items()), *config.hydra.overrides.task]
        at_work["folder"] = folder
        with _end_process_where_refused(config):
            if self.stop_after is not None:
                whole("hydra.callbacks.sweep.stop_after", self.stop_after, otherwise="null or ")
            with suppress(HydraException):  # which the sweeper says
                parser = OverridesParser.create(config_loader=GlobalHydra.instance().config_loader())
                swept = {o.get_key_element(): o for o in parser.parse_overrides(typed) if o.is_discrete_sweep()}
                for key, sweep in swept.items():
                    text = str(sweep.input_line).partition("=")[2]
                    if re.match(r"sort\(\s*range\(", text):  # whose ends Hydra loses
                        remedy = "Hydra sorts this range wrongly; write it upwards, as range(10,41,10)"
                        raise InputError(key, text, "", remedy)
                    if next(sweep.sweep_iterator(), None) is None:
                        raise InputError(key, text, "", "a sweep of no values; give one at least")
            if OmegaConf.select(config, "hydra.sweeper.direction") is not None:
                if (objective := OmegaConf.select(config, "objective")) is None:
                    example = "objective={start: 10, within: 0.5, beyond: 0.2}"
                    raise InputError("objective", "null", "", f"a search makes a number small: state it, as {example}")
                prepare_jax(OmegaConf.select(config, "engine") not in (None, *ON_ONE_CORE))
                from belt_sim.commands.cases import CentringGoal

                with suppress(OmegaConfBaseException):  # raised for what the trials have yet to fill in
                    if OmegaConf.is_config(objective):
                        objective = OmegaConf.to_container(objective, resolve=True, throw_on_missing=True)
                    CentringGoal.from_setting(objective)
                import optuna

                optuna.logging.set_verbosity(optuna.logging.WARNING)
            folder.mkdir(parents=True, exist_ok=True)
            remedy = "another sweep is at work there; wait for it, or give this one a folder of its own"
            lock = _lock(folder / CASES, "hydra.sweep.dir", folder, remedy)
            lock.truncate(0)
            clear_drafts(folder)
            at_work.update(config=config, lock=lock)


@contextmanager
def _end_process_where_refused(config: DictConfig) -> Iterator[None]:
    """Around a callback, of whose errors Hydra only warns; nothing runs where Hydra is to change the folder, from which
    results and the user's files are named."""
    try:
        if config.hydra.job.chdir:
            raise InputError("hydra.job.chdir", "true", "", "files are named from the current folder; leave it out")
        yield
    except (BeltError, OSError) as error:
        said = explain(error, at_work["folder"]) if isinstance(error, OSError) else error
        print(f"belt-sim: {said}", file=sys.stderr)
        sys.exit(1)


def note_end(hydra: DictConfig, name: str, failure: str) -> None:
    """Note how a run or case has ended (CASE_LOST: it begins); a failure is told, once where cases fail alike."""
    if hydra.mode != RunMode.MULTIRUN:
        if failure:
            at_work.setdefault("failures", []).append(failure)
            print(f"belt-sim: {failure}", file=sys.stderr, flush=True)
        return
    if failure not in ("", CASE_LOST) and all(case["failed"] != failure for case in noted_cases(hydra)):
        print(f"belt-sim: {failure}", file=sys.stderr, flush=True)
    line = {"number": hydra.job.num, "run": name, "overrides": list(hydra.overrides.task)}
    with suppress(OSError), (Path(hydra.sweep.dir) / CASES).open("a", encoding="utf-8") as file:
        file.write(json.dumps(line | {"failed": failure}) + "\n")


def noted_cases(hydra: DictConfig) -> Iterator[dict[str, Any]]:
    """The beginnings and ends of a sweep's cases, in their order."""
    with suppress(OSError, ValueError), (Path(hydra.sweep.dir) / CASES).open(encoding="utf-8") as file:
        for line in file:
            yield json.loads(line)


def failing_alike(hydra: DictConfig) -> str:
    """Why the first cases of a sweep failed and the sweep stops, where all of them did so alike; else empty."""
    most, key = OmegaConf.select(hydra, "callbacks.sweep.stop_after"), "hydra.callbacks.sweep.stop_after"
    if most is None:
        return ""
    first = list(islice((case["failed"] for case in noted_cases(hydra) if case["failed"] != CASE_LOST), most))
    alike = len(first) == most and len(set(first)) == 1 and first[0]
    said = f"the first {most} cases failed alike ({alike}): the sweep stops; {key}=null tries all cases"
    return said if alike else ""


def end_sweep() -> None:
    """The table, pictures and recording of the sweep of this process, if it runs one; its lock is given back."""
    config = at_work.pop("config", None)
    if config is None:
        return
    folder = Path(config.hydra.sweep.dir)
    ends, why = {case["number"]: case for case in noted_cases(config.hydra)}, failing_alike(config.hydra)
    cases = [case for _, case in sorted(ends.items()) if not why or case["failed"] != why]
    if sys.exc_info()[0] is KeyboardInterrupt:
        cases = [case | {"failed": CASE_STOPPED} if case["failed"] == CASE_LOST else case for case in cases]
    failures = [case["failed"] for case in cases if case["failed"]]
    at_work.setdefault("failures", []).extend(failures)
    if len(cases) > 1 and OmegaConf.select(config, "hydra.job.name") == "simulate":
        _write_table(folder, cases, config)
    best = folder / "optimization_results.yaml"
    if OmegaConf.select(config, "hydra.sweeper.direction") is not None and best.is_file():
        if len(failures) == len(cases):
            best.unlink()
            print(f"belt-sim: none of the {len(cases)} trials came to its end", file=sys.stderr)
        else:
            found: Any = OmegaConf.to_container(OmegaConf.load(best))
            print(f"best of {len(cases)}: {found.get('best_value')} with {found.get('best_params')}")
    (folder / CASES).unlink(missing_ok=True)
    at_work.pop("lock").close()


def _write_table(folder: Path, cases: Sequence[Mapping[str, Any]], config: DictConfig) -> None:
    """sweep.csv, what failed last; pictures of the sweep, and one recording of its runs where they were recorded."""
    import pandas as pd

    from belt_sim.api.plot import numbers_first
    from belt_sim.show.curves import draw_sweep, read_run, record_sweep

    rows: list[dict[str, Any]] = []
    typed = [dict(o.lstrip("+").split("=", 1) for o in case["overrides"] if "=" in o) for case in cases]
    swept = [key for key in typed[0] if len({own.get(key) for own in typed}) > 1]
    for case, own in zip(cases, typed, strict=True):
        told, failed = dict[str, Any](), case["failed"] or None
        try:
            if not failed:
                summary = read_json(folder / case["run"] / "summary.json")
                told = {k: summary[k] for k in ("model", "tension_n_per_mm2", "yaw_deg", "travel_m", "settled")}
                told |= {f"rate{k}_mm_per_m": v for k, v in summary["rate_mm_per_m"].items()}
                told |= {f"offset_{k}_mm": v for k, v in summary["offset_mm"].items()}
                told |= {"steady_rate_mm_per_m": summary.get("steady_rate_mm_per_m")}
        except (BeltError, OSError, KeyError, TypeError) as error:
            failed, told = f"summary.json is damaged: {error}", {}
        rows.append({"run": case["run"]} | {key: own[key] for key in swept if key in own} | told | {"failed": failed})
    rows.sort(key=lambda row: row["failed"] is not None)
    table = pd.DataFrame(rows)
    write_with(folder / "sweep.csv", lambda path: table.to_csv(path, index=False))
    there = [folder / row["run"] for row in rows if not row["failed"]]
    with numbers_first("the pictures of the sweep"):
        finished = [read_run(path) for path in there]
        if config.pictures is True and there:
            draw_sweep(folder, finished)
        if config.watch == "rrd" and any(run.curves is not None for run in finished):
            record_sweep(folder / "sweep.rrd", finished)
    some = f", {len(rows) - len(there)} of them failed" if len(there) < len(rows) else ""
    print(f"sweep of {len(rows)} runs{some}: {folder / 'sweep.csv'}", flush=True)
