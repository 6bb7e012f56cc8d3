"""What a result came from: versions, commit, command, configuration, and the files and the code it depends on."""

import ast
import hashlib
import json
import shlex
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import yaml

from belt_sim.errors import BeltError
from belt_sim.files import INSTALLED, PACKAGE, ROOT, careful_yaml

PACKAGES = ("belt-sim", "mujoco", "jax", "numpy", "scipy", "hydra-core")


def provenance(config: Any = None) -> dict[str, Any]:
    """Versions, commit, command line and the hash of a resolved configuration."""
    return {
        "versions": {p: version_of(p) for p in PACKAGES} | {"python": sys.version.split()[0]},
        "commit": _commit(),
        "command": _command(),
        "config_sha256": config_hash(config) if config is not None else None,
    }


def config_hash(config: Any) -> str:
    """SHA-256 of a configuration (mappings, lists, numbers, strings)."""
    return hashlib.sha256(json.dumps(config, sort_keys=True, default=str).encode()).hexdigest()


def _command() -> str:
    """The command line; a study puts ``python -m studies.NAME`` in front, a command of belt-sim its name."""
    program = sys.argv[0] if sys.argv[0].startswith(("python -m ", "belt-sim ")) else "belt-sim"
    typed = [a for a in sys.argv[1:] if not a.startswith("hydra.job.name=")]  # the command's name
    return shlex.join([*program.split(), *typed])


@cache
def version_of(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _commit() -> str | None:
    """Of the checkout; None for an installed package, whatever repository it may lie in."""
    return None if INSTALLED or not (ROOT / ".git").exists() else _head(ROOT)


@cache
def _head(checkout: Path) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(checkout), "rev-parse", "HEAD"], capture_output=True, text=True, timeout=5, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() or None


@cache
def code_hash() -> str:
    """SHA-256 of the package's own code."""
    found = sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        found.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return found.hexdigest()


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


def file_hash(path: Path) -> str:
    """SHA-256 of a file's content."""
    return sha256(path.read_bytes()).hexdigest()
