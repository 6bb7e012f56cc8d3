"""What a user typed that cannot be meant, said in one line with the nearest thing that can."""

import difflib
import re
from collections.abc import Sequence
from pathlib import Path

import yaml

from belt_sim.commands.folder_name import sweep_folder
from belt_sim.paths import CONF

#: Hydra's own flags that a command takes
FLAGS = (
    "--help",
    "-h",
    "--hydra-help",
    "--version",
    "--cfg",
    "-c",
    "--resolve",
    "--package",
    "-p",
    "--run",
    "-r",
    "--multirun",
    "-m",
    "--shell-completion",
    "-sc",
    "--config-path",
    "-cp",
    "--config-name",
    "-cn",
    "--config-dir",
    "-cd",
    "--experimental-rerun",
    "--info",
    "-i",
)
SWEEP = ("-m", "--multirun")
#: flags that a value follows
WITH_VALUE = ("--cfg", "-c", "--package", "-p", "--config-path", "-cp", "--config-name", "-cn", "--config-dir", "-cd")
#: key=value, as Hydra takes it
OVERRIDE = re.compile(r"[+~]*[A-Za-z_][\w./@]*=")
OPEN = ("model", "hydra")  # groups that take keys which their files do not list


def ordered(command: str, arguments: Sequence[str]) -> list[str]:
    """The arguments as Hydra wants them: the sweep flag and its folder in front, quotes round what is not ASCII."""
    front = [a for a in arguments if a in SWEEP]
    rest = [a for a in arguments if a not in SWEEP]
    if front and not any(a.startswith("hydra.sweep.dir=") for a in rest):
        front.append(f"hydra.sweep.dir='{sweep_folder(command, rest)}'")
    return front + [_quoted(a) for a in rest]


def files_named(command: str, arguments: Sequence[str]) -> list[str]:
    """The arguments of ``import`` with its bare file names as files=[...], quoted as Hydra wants it."""
    if command != "import":
        return list(arguments)
    after = {k + 1 for k, a in enumerate(arguments) if a in WITH_VALUE}
    bare = [
        a
        for k, a in enumerate(arguments)
        if k not in after and (Path(a).is_file() or not (a.startswith("-") or OVERRIDE.match(a)))
    ]
    others = [a for a in arguments if a not in bare]
    quoted = ",".join("'" + a.replace("\\", "\\\\").replace("'", "\\'") + "'" for a in bare)
    return [*others, f"files=[{quoted}]"] if bare else others


def _quoted(argument: str) -> str:
    """Hydra's grammar takes letters beyond ASCII, as paths have them, in quotes alone."""
    key, equals, value = argument.partition("=")
    if not equals or argument.isascii() or value[:1] in "'\"[{":
        return argument
    return f"{key}='{value.replace(chr(39), chr(92) + chr(39))}'"


def refused(command: str, arguments: Sequence[str]) -> str | None:
    """Why these arguments cannot be handed to Hydra; None when they can."""
    for argument in arguments:
        flag = argument.split("=")[0]
        if argument.startswith("-") and flag not in FLAGS:
            return f"{argument}: no such flag{_nearest(flag, FLAGS)} (settings are written key=value)"
        if argument.startswith("~"):
            return f"{argument}: no key can be left out; give it another value, key=value"
        added = argument.lstrip("+").split("=")[0].split("@")[0]
        if argument.startswith("+") and not (added.split(".")[0] in OPEN or (CONF / added).is_dir()):
            return f"{argument}: no such key{_nearest(added, known_keys(command))}"
    return None


def one_line(error: BaseException, command: str) -> str:
    """A message of Hydra's or OmegaConf's in one line, with what the user may have meant."""
    text = str(error)
    key = re.search(r"Could not override '([^']+)'|Key '([^']+)' is not in struct", text)
    if key:
        name = key.group(1) or key.group(2)
        return f"{name}: no such key{_nearest(name, known_keys(command))}"
    option = re.search(r"Could not (?:find|load) '([^']+)/([^'/]+?)'", text)
    if option:
        group, name = option.group(1), option.group(2).removesuffix(".yaml")
        options = ", ".join(sorted(p.stem for p in (CONF / group).glob("*.yaml")))
        return f"{group} = {name}: use one of {options}" if options else f"{group}: no such key"
    if text.startswith("Config group override"):
        return "a group (rig, belt, model) is named by one of its files, as rig=test_rig"
    if "grammar" in text or "parsing override" in text:
        first = " ".join(text.splitlines()[0].split())
        return f"{first}: write key=value, lists as [a,b], and put quotes around what holds brackets"
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    keep = [line for line in lines if not line.startswith(("full_key", "object_type", "reference_type"))]
    return "; ".join(keep[:3]) or type(error).__name__


def known_keys(command: str) -> list[str]:
    """The keys of a command's configuration and of the groups it starts with."""
    top = yaml.safe_load((CONF / f"{command}.yaml").read_text(encoding="utf-8"))
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
    return f"; the keys are {', '.join(known)}" if len(known) < len(FLAGS) else ""
