"""Completion of commands, keys and names in bash and zsh: ``eval "$(belt-sim completion)"``."""

from collections.abc import Iterable
from pathlib import Path

import yaml

from belt_sim.paths import CAMPAIGNS, CONF

GROUPS = ("rig", "belt", "model")
#: filled in by ``script``; the value of any key may be a file
_SCRIPT = """_belt_sim() {{
  local line=${{COMP_LINE:0:COMP_POINT}} words
  local current=${{line##* }} command
  read -r _ command _ <<< "$line "
  [[ $line == *\\ *\\ * ]] || command=
  case $command in
{cases}
  *) words="{commands}" ;;
  esac
  COMPREPLY=($(compgen -W "$words" -- "$current"))
  [[ $current == *=* ]] || return
  local value=${{current#*=}}
  COMPREPLY+=($(compgen -f -P "${{current%%=*}}=" -- "$value"))
  COMPREPLY=("${{COMPREPLY[@]#"${{current%"$value"}}"}}")
}}
[ -z "$ZSH_VERSION" ] || {{ autoload -U +X bashcompinit && bashcompinit; }}
complete -o nospace -F _belt_sim belt-sim
"""


def script(commands: Iterable[str]) -> str:
    """Return the script that a shell evaluates: the words of every command, as its file in conf lists them."""
    names = [*commands, "--help", "--version"]
    cases = [f'  {c}) words="{" ".join(words(c))}" ;;' for c in names if (CONF / f"{c}.yaml").is_file()]
    return _SCRIPT.format(cases="\n".join(cases), commands=" ".join(names))


def words(command: str) -> list[str]:
    """Return what may follow a command: its keys with =, names of rigs, belts, models and campaigns, flags."""
    settings = yaml.safe_load((CONF / f"{command}.yaml").read_text(encoding="utf-8"))
    groups = {
        name: default for entry in settings["defaults"] if isinstance(entry, dict) for name, default in entry.items()
    }
    keys = [f"{k}=" for k in settings if k not in ("defaults", "hydra")]
    found = [k for k in keys if k != "campaign="]
    for group in (g for g in GROUPS if g in groups):
        found += [f"{group}={name}" for name in _names(CONF / group)]
        found += [
            f"{group}.{key}=" for key in yaml.safe_load((CONF / group / f"{groups[group]}.yaml").read_text("utf-8"))
        ]
    if "campaign=" in keys:
        found += [f"campaign={p.parent.name}" for p in sorted(CAMPAIGNS.glob("*/campaign.yaml"))]
    if command == "simulate":
        found += [f"+experiment={name}" for name in _names(CONF / "experiment")] + ["-m"]
    return [*found, "--help"]


def _names(folder: Path) -> list[str]:
    return sorted(p.stem for p in folder.glob("*.yaml"))
