"""The commands: what there are, their keys with units, Hydra's errors in one line each. Behind each stands a function
that takes a run with its resolved configuration and leaves files in its folder."""

import difflib
import re
import shutil
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from belt_sim.io import CONF, group_names, sample_campaigns

HELP = ("-h", "--help")
OUTPUT = "standard output"  # the file name of its errors
#: command -> what it does, and where its function is in belt_sim (empty: in cli.py)
COMMANDS = {
    "simulate": ("one model, one case: curves and late rates", "commands.cases:simulate_command"),
    "view": ("a 3D belt in MuJoCo's viewer, with its movement enlarged", "commands.cases:view_command"),
    "scene": ("the same belt as MJCF that runs in plain MuJoCo", "commands.cases:scene_command"),
    "compare": (
        "a model against a measured campaign: where it agrees, where it fails",
        "commands.inference:compare_command",
    ),
    "diagnose": ("which physical effect the model lacks", "commands.inference:diagnose_command"),
    "import": ("a logger's files (CSV, xlsx ...) -> a campaign", "commands.campaigns:import_command"),
    "new": ("an empty, commented campaign with the runs that a diagnosis needs", "commands.campaigns:new_command"),
    "check": ("checks your data: slips in them, and what they can and cannot tell", "commands.inference:check_command"),
    "virtual-rig": ("make a campaign with a hidden effect", "commands.campaigns:rig_command"),
    "reveal": ("what was hidden in such a campaign", "commands.campaigns:reveal_command"),
    "export": ("the linear plant for a controller: FMU, MAT file, Bode plot", "commands.cases:export_command"),
    "map": ("very many cases of an analytic model, as one table", "commands.cases:map_command"),
    "report": ("write the report of a diagnosis again", "commands.inference:report_command"),
    "app": ("a local web page: sliders, own measurements, diagnoses", "app:app_command"),
    "new-effect": ("a file with a whole effect, to change into one of your own", ""),
    "demo": ("a diagnosis of a campaign that ships, into outputs/demo", ""),
    "completion": ('completion in bash and zsh: eval "$(belt-sim completion)"', ""),
}


def one_line(error: BaseException, command: str, conf: Path = CONF) -> str:
    """Hydra's commonest errors, in one line each that says what to type instead."""
    from hydra.errors import MissingConfigException

    keys, text, cause = known_keys(command, conf), str(error), error.__cause__
    found: Any = next((e for e in (error, cause) if getattr(e, "full_key", None)), error)
    key: str = getattr(found, "full_key", None) or ""
    first = " ".join((str(found) or str(cause or "") or " ").splitlines()[0].split())
    if isinstance(error, MissingConfigException) and error.missing_cfg_file:
        group, _, name = error.missing_cfg_file.rpartition("/")
        if not group:
            place = "of conf or --config-dir; --config-path takes the place of conf, --config-dir adds to it"
            return f"--config-name = {name}: no such file {place}"
        options = error.options or group_names(group)
        return f"{group} = {name}: use one of {', '.join(options)}" if options else f"{group}: no such key"
    if "." in key and isinstance(getattr(found, "parent_node", None), Mapping):  # of the model, rig ... that was chosen
        keys = [f"{key.rpartition('.')[0]}.{name}" for name in found.parent_node]
    if target := re.search(r"Error locating target '(.*?)'.*full_key: ([\w.]+)", text, re.DOTALL):
        return f"{target[2]}._target_ = {target[1]}: cannot be imported; name a class of an installed module"
    if "object_type=RangeSweep" in text:
        return "range(...): is all of a sweep's values; write them out to add others, as 10,20,30,50"
    if key and "Missing mandatory value" in f"{error} {cause}":
        meaning = next((about for name, _, about in _settings(conf / f"{command}.yaml") if name == key), "")
        names = f": {', '.join(sample_campaigns())}" if key == "campaign" else ""
        return f"{key}: is not given; write {key}=..." + (f" ({meaning}{names})" if meaning else "")
    for pattern, remedy in _SAID.items():
        if match := re.search(pattern, text):
            name = key or match.group(1)
            if "Could not delete" in pattern and name in keys:
                return f"{name}: is null, and so left out already"
            near = nearest(name, [k for k in keys if k != name]) if remedy == "no such key" else ""
            near = f"; write +{name}=..." if "append to your default list" in text and "@" not in name else near
            return f"{name or 'interval(...)'}: {remedy}{near}"
    if key:
        return f"{key}: {first}" if key in keys else f"{key}: no such key{nearest(key, keys)}"
    if isinstance(error, ValueError) and "--" in first:  # flags that exclude each other
        return f"{first.replace('shell_completion', 'shell-completion')}: give one of them"
    if isinstance(error, ValueError):  # Hydra checks the names of groups with it
        is_group = "group" in text.lower()
        return "a group (rig, belt, model) is named by one of its files, as rig=test_rig" if is_group else first
    first = re.sub(r"^\w+Exception: ", "", first)  # of Hydra's grammar
    return f"{first}: write key=value, lists as [a,b]; quote what holds signs, as key=\"'a,b'\""


#: what Hydra says, with the key -> what to do
_SAID = {
    r"Ambiguous value for argument '(.*)'": "several values are a sweep; add -m, or write a list as [a,b]",
    r"Sweep parameters '(.*)' requires": "several values are a sweep; add -m",
    r"Could not append to config. An item is already at '(.*)'": "the key is there already; leave the + out",
    r"Could not delete from config. '?(.*?)'? does not exist": "no such key",
    r"Could not override '(.*)'": "no such key",
    r"Could not append override '(.*)'": "no such group, or it is there already",
    r"does not support sweep type : INTERVAL()": "is for a search; add hydra/sweeper=optuna",
    r"Key '(.*?)' is not in struct": "no such key",
    r"Multiple values for ([\w/]*)": "give it once",
}


def known_keys(command: str, conf: Path = CONF) -> list[str]:
    """The keys of a command's configuration and of the groups it starts with."""
    file = conf / f"{command}.yaml"
    keys = [key for key, _, _ in _settings(file)]
    for group, chosen in _groups(file):
        keys += [group, *(f"{group}.{key}" for key, _, _ in _settings(CONF / group / f"{chosen}.yaml"))]
    return keys


def nearest(name: str, known: Sequence[str], what: str = "keys") -> str:
    """The name that was meant, of the same group where that is known, else all of them where they are few."""
    group, _, own = name.rpartition(".")
    beside = {k.rpartition(".")[2]: k for k in known if group and k.rpartition(".")[0] == group}
    names = beside or {k: k for k in known}
    close = difflib.get_close_matches(own if beside else name, names, n=1)
    if close:
        return f"; did you mean {names[close[0]]}?"
    return f"; the {what} are {', '.join(names.values())}" if len(names) < 25 else ""


def help_text(command: str) -> str:
    """Return what a command does, and every key with its value, unit and meaning, as its files in conf have them."""
    file, wide = CONF / f"{command}.yaml", shutil.get_terminal_size().columns
    about = file.read_text(encoding="utf-8").partition("defaults:")[0]
    rows = [("", " ".join(line.lstrip("# ") for line in about.splitlines()))]
    rows += [("usage:", f"belt-sim {command} [KEY=VALUE ...]")]
    rows += [("      ", f"belt-sim {command} -m KEY=A,B,C   a sweep, a run a value"), ("", "")]
    rows += [("", "keys, with what they are set to:")]
    found: list[tuple[str, str, str]] = []
    for group, chosen in _groups(file):
        found.append((group, chosen, f"one of {', '.join(group_names(group))}"))
        found += [(f"  {group}.{k}", v, c) for k, v, c in _settings(CONF / group / f"{chosen}.yaml")]
    if command == "simulate":
        found.append(("+experiment", "...", f"one of {', '.join(group_names('experiment'))}"))
    found += _settings(file)
    keys = [(f"{k}=...", f"needed: {c}") if v == "???" else (f"{k}={v}", c) for k, v, c in found]
    longest = max(len(key) for key, _ in keys)
    rows += [(f"  {key:{longest}s} ", comment) for key, comment in keys]
    more = f"belt-sim {command} --cfg job KEY=VALUE ... shows the whole configuration and runs nothing."
    rows += [("", ""), ("", more)]
    lines = []
    for first, comment in rows:  # the comment below itself
        lead = f"{first} " if first else ""
        look: Any = {"initial_indent": lead, "subsequent_indent": " " * len(lead), "break_on_hyphens": False}
        lines.append(textwrap.fill(comment, max(wide, len(lead) + 20), **look) or lead.rstrip())
    return "\n".join(lines)


def _groups(file: Path) -> list[tuple[str, str]]:
    """Return the groups that a file of conf starts with, as (group, chosen)."""
    return re.findall(r"^  - (\w+): (\w+)", file.read_text(encoding="utf-8"), re.MULTILINE)


def _settings(file: Path) -> list[tuple[str, str, str]]:
    """Return the settings of a file of conf as (key, value, comment); ??? is the value of what must be given."""
    text = file.read_text(encoding="utf-8").split("\nhydra:\n")[0]
    return re.findall(r"^(\w+):[ \t]*([^#\n]*[^#\s])[ \t]*(?:#[ \t]*(.*))?$", text, re.MULTILINE)
