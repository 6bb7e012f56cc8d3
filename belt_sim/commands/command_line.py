"""What was typed -> the configurations of one run, or of the cases of a sweep; Hydra composes them.

A command is written ``belt-sim COMMAND key=value ...`` in Hydra's grammar of overrides; with -m, ``key=a,b,c`` is a
sweep. Whatever cannot be meant is an InputError or BeltError in one line.
"""

import difflib
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import Any

import yaml
from hydra import compose, initialize_config_dir
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException, MissingConfigException
from omegaconf import OmegaConf, open_dict
from omegaconf.errors import OmegaConfBaseException

from belt_sim.commands.run_dir import RunDir
from belt_sim.errors import BeltError
from belt_sim.files import CONF, group_names, sample_campaigns

SWEEP = ("-m", "--multirun")
HELP = ("-h", "--help")
SHOW = ("-c", "--cfg")
FLAGS = (*SWEEP, *HELP, *SHOW)
#: key=value, as Hydra takes it
OVERRIDE = re.compile(r"[+~]*[A-Za-z_][\w./@]*=")
OPEN = ("model", "hydra")  # groups that take keys which their files do not list
LONGEST = 120  # characters of a folder's name; file systems take 255 bytes, and a letter may have four


@dataclass(frozen=True)
class Request:
    """What a command line asks for. runs: one, or the cases of a sweep (a search makes its own); folder: of the
    sweep, None without one; swept: keys of which cases have different values; lines: overrides, ranges unexpanded;
    launcher, searcher: names of Hydra's groups, with their settings."""

    command: str
    runs: Sequence[RunDir]
    folder: Path | None = None
    swept: Sequence[str] = ()
    lines: Sequence[str] = ()
    launcher: str = "basic"
    launching: Mapping[str, Any] = field(default_factory=dict)
    searcher: str = "basic"
    searching: Mapping[str, Any] = field(default_factory=dict)


def compose_request(command: str, arguments: Sequence[str], *, conf: Path = CONF, fixed: Sequence[str] = ()) -> Request:
    """The configurations that the arguments of a command mean; fixed: overrides that come before all others."""
    _refuse(command, arguments, conf)
    overrides = [_quote(a) for a in arguments if a not in SWEEP]
    multirun = any(a in SWEEP for a in arguments)
    if multirun and not any(a.startswith("hydra.sweep.dir=") for a in overrides):
        overrides.append(f"hydra.sweep.dir='{sweep_folder(command, overrides)}'")
    with _hydra_errors(command, conf):
        parsed = OverridesParser.create().parse_overrides([*fixed, *overrides])
        single = [o for o in parsed if not o.is_sweep_override()]
        base = compose(command, [str(o.input_line) for o in single], return_hydra_config=True)
        hydra = base.hydra
        if not multirun and (hydra.mode is None or hydra.mode.name != "MULTIRUN"):
            if len(single) < len(parsed):
                line = next(o.input_line for o in parsed if o.is_sweep_override())
                raise BeltError(f"{line}: several values are a sweep; add -m, or write a list as [a,b]")
            folder = Path(hydra.run.dir)
            return Request(command, [RunDir(folder, command, plain(base), [a for a in overrides if not _is_hydras(a)])])
        choices, sweeper = hydra.runtime.choices, OmegaConf.to_container(hydra.sweeper)
        assert isinstance(sweeper, dict)
        settings = {"launcher": choices["hydra/launcher"], "searcher": choices["hydra/sweeper"], "searching": sweeper}
        settings["launching"] = OmegaConf.to_container(hydra.launcher, resolve=True)
        top = Path(hydra.sweep.dir)
        given = {f"{k}": f"{k}={v}" for k, v in (sweeper.get("params") or {}).items()}
        typed = {o.get_key_element(): str(o.input_line) for o in parsed if not o.is_hydra_override()}
        lists = _lists(given | typed) if settings["searcher"] == "basic" else {}
        inner = [str(o.input_line) for o in parsed if o.is_hydra_override()]
        lines = [*(given | typed).values(), *inner]
        combined = product(*lists.values()) if settings["searcher"] == "basic" else []
        runs = [_case(command, top, inner, list(c), number) for number, c in enumerate(combined)]
    swept = [k.lstrip("+") for k, values in lists.items() if len(values) > 1]
    return Request(command, runs, top, swept, lines, **settings)


def case_of(command: str, request: Request, overrides: Sequence[str], number: int, conf: Path = CONF) -> RunDir:
    """One case of a search, with what it is to try."""
    assert request.folder is not None
    with _hydra_errors(command, conf):
        return _case(command, request.folder, [], list(overrides), number)


def _lists(overrides: Mapping[str, str]) -> dict[str, list[str]]:
    """Key -> its values as overrides, one where it is not swept."""
    found = {}
    for override in OverridesParser.create().parse_overrides(list(overrides.values())):
        key = override.get_key_element()
        if not override.is_sweep_override():
            found[key] = [str(override.input_line)]
        elif override.is_choice_sweep() and hasattr(override.value(), "filter"):  # glob(...)
            found[key] = [f"{key}={name}" for name in override.value().filter(group_names(key))]  # type: ignore[union-attr]
        elif override.is_discrete_sweep():
            found[key] = [f"{key}={value}" for value in override.sweep_string_iterator()]
        else:
            raise BeltError(f"{override.input_line}: an interval is for a search; add hydra/sweeper=optuna")
    return found


def _case(command: str, top: Path, inner: Sequence[str], overrides: Sequence[str], number: int) -> RunDir:
    config = compose(command, [*inner, *overrides, f"hydra.job.num={number}"], return_hydra_config=True)
    return RunDir(top / str(config.hydra.sweep.subdir), command, plain(config), overrides, number)


def plain(config: Any) -> dict[str, Any]:
    """A configuration as plain dicts and lists, without Hydra's own."""
    with open_dict(config):
        config.pop("hydra", None)
    return OmegaConf.to_container(config, resolve=True, throw_on_missing=True)  # type: ignore[return-value]


@contextmanager
def _hydra_errors(command: str, conf: Path) -> Iterator[None]:
    """Hydra's errors are one line."""
    OmegaConf.register_new_resolver("folder_name", folder_name, replace=True)
    try:
        with initialize_config_dir(version_base="1.3", config_dir=str(conf), job_name=command):
            yield
    except (HydraException, OmegaConfBaseException, ValueError) as error:
        if isinstance(error, BeltError):
            raise
        raise BeltError(_one_line(error, command, conf)) from error


def _one_line(error: BaseException, command: str, conf: Path) -> str:
    if isinstance(error, MissingConfigException) and error.missing_cfg_file:
        group, _, name = error.missing_cfg_file.rpartition("/")
        options = error.options or sorted(p.stem for p in (conf / group).glob("*.yaml"))
        return f"{group} = {name}: use one of {', '.join(options)}" if options else f"{group}: no such key"
    key = getattr(error, "full_key", None) or getattr(error.__cause__, "full_key", None)
    if key and "Missing mandatory value" in str(error):
        return f"{key}: is not given; write {key}=...{_what_to_give(key, command, conf)}"
    if key:
        return f"{key}: no such key{_nearest(key, known_keys(command, conf))}"
    if isinstance(error, ValueError):  # Hydra checks the names of groups with it
        return "a group (rig, belt, model) is named by one of its files, as rig=test_rig"
    first = " ".join(str(error).splitlines()[0].split())
    return f"{first}: write key=value, lists as [a,b], and put quotes around what holds brackets"


def _what_to_give(key: str, command: str, conf: Path) -> str:
    """Return in brackets what stands beside a key in its file, with the campaigns that ship."""
    meaning = dict(_settings(conf / f"{command}.yaml")).get(f"{key}=...", "").removeprefix("needed: ")
    names = f": {', '.join(sample_campaigns())}" if key == "campaign" else ""
    return f" ({meaning}{names})" if meaning else ""


def _refuse(command: str, arguments: Sequence[str], conf: Path) -> None:
    for argument in arguments:
        flag = argument.split("=")[0]
        if argument.startswith("-") and flag not in SWEEP:
            raise BeltError(f"{argument}: no such flag{_nearest(flag, FLAGS)} (settings are written key=value)")
        if argument.startswith("~"):
            raise BeltError(f"{argument}: no key can be left out; give it another value, key=value")
        added = argument.lstrip("+").split("=")[0].split("@")[0]
        if argument.startswith("+") and not (added.split(".")[0] in OPEN or (conf / added).is_dir()):
            raise BeltError(f"{argument}: no such key{_nearest(added, known_keys(command, conf))}")


def known_keys(command: str, conf: Path = CONF) -> list[str]:
    """The keys of a command's configuration and of the groups it starts with."""
    top = yaml.safe_load((conf / f"{command}.yaml").read_text(encoding="utf-8"))
    keys = [k for k in top if k not in ("defaults", "hydra")]
    for entry in top.get("defaults", []):
        for group, option in entry.items() if isinstance(entry, dict) else ():
            file = CONF / group / f"{option}.yaml"
            if file.is_file():
                inside = yaml.safe_load(file.read_text(encoding="utf-8")) or {}
                keys += [group, *(f"{group}.{k}" for k in inside)]
    return keys


def _nearest(name: str, known: Sequence[str]) -> str:
    close = difflib.get_close_matches(name, known, n=1)
    if close:
        return f"; did you mean {close[0]}?"
    return f"; the keys are {', '.join(known)}" if len(known) < 25 else ""


def help_text(command: str) -> str:
    """Return what a command does, and every key with its value, unit and meaning, as its files in conf have them."""
    text = (CONF / f"{command}.yaml").read_text(encoding="utf-8").split("\nhydra:\n")[0]
    about, _, settings = text.partition("defaults:")
    said = [line.lstrip("# ") for line in about.splitlines()]
    rows: list[tuple[str, str]] = []
    for group, chosen in re.findall(r"- (\w+): (\w+)", settings):
        rows.append((f"{group}={chosen}", f"one of {', '.join(group_names(group))}"))
        rows += [(f"  {group}.{k}", c) for k, c in _settings(CONF / group / f"{chosen}.yaml")]
    if command == "simulate":
        rows.append(("+experiment=...", f"one of {', '.join(group_names('experiment'))}"))
    rows += _settings(CONF / f"{command}.yaml")
    wide = max(len(key) for key, _ in rows)
    lines = [f"  {key:{wide}s}  {comment}".rstrip() for key, comment in rows]
    usage = [f"usage: belt-sim {command} [KEY=VALUE ...]"]
    usage.append(f"       belt-sim {command} -m KEY=A,B,C   a sweep, a run a value")
    more = f"belt-sim {command} --cfg job KEY=VALUE ... shows the whole configuration and runs nothing."
    return "\n".join([*said, *usage, "", "keys, with what they are set to:", *lines, "", more])


def _settings(file: Path) -> list[tuple[str, str]]:
    """Return the settings of a file of conf as (key=value, comment); ??? stands for what must be given."""
    text = file.read_text(encoding="utf-8").split("\nhydra:\n")[0]
    found = re.findall(r"^(\w+):[ \t]*([^#\n]*[^#\s])[ \t]*(?:#[ \t]*(.*))?$", text, re.MULTILINE)
    return [(f"{k}={'...' if v == '???' else v}", ("needed: " if v == "???" else "") + c) for k, v, c in found]


def import_arguments(arguments: Sequence[str]) -> list[str]:
    """The arguments of ``import`` with its bare file names as files=[...], quoted as Hydra wants it."""
    after = {k + 1 for k, a in enumerate(arguments) if a in SHOW}
    loose = [a for k, a in enumerate(arguments) if k not in after]
    bare = [a for a in loose if Path(a).is_file() or not (a.startswith("-") or OVERRIDE.match(a))]
    others = [a for a in arguments if a not in bare]
    quoted = ",".join("'" + a.replace("\\", "\\\\").replace("'", "\\'") + "'" for a in bare)
    return [*others, f"files=[{quoted}]"] if bare else others


def _quote(argument: str) -> str:
    """Hydra's grammar takes letters beyond ASCII, as paths have them, in quotes alone."""
    key, equals, value = argument.partition("=")
    if not equals or argument.isascii() or value[:1] in "'\"[{":
        return argument
    return f"{key}='{value.replace(chr(39), chr(92) + chr(39))}'"


def _is_hydras(override: str) -> bool:
    return override.lstrip("+").startswith(("hydra.", "hydra/"))


def folder_name(overrides: str) -> str:
    """A name of one folder for ``overrides`` (key=value, separated by commas): the same ones have the same name."""
    name = re.sub(r"[/\\:*?\"'<>|\s]+", "_", overrides)
    if name == overrides and len(name) <= LONGEST:
        return name
    return f"{name[:LONGEST]}-{sha256(overrides.encode()).hexdigest()[:8]}"


def sweep_folder(command: str, arguments: Sequence[str]) -> str:
    """The folder of a sweep that names none: one for each set of overrides, so that a sweep goes on in its own."""
    swept = sorted(a for a in arguments if "=" in a and not _is_hydras(a))
    return f"outputs/{command}/sweep/{folder_name(','.join(swept)) or 'all'}"
