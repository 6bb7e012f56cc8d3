"""Where the files of the package stand, files written so that nothing half-written is ever seen, and what a result came
from: versions, commit, command line and the hash of its configuration."""

import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import yaml

from belt_sim.errors import BeltError, UnwritableError

#: what travels with the package: at the top of a checkout, or inside an installed package
PACKAGE = Path(__file__).resolve().parent
ROOT = PACKAGE.parent  # of a checkout
INSTALLED = (PACKAGE / "_shipped").is_dir()
_TOP = PACKAGE / "_shipped" if INSTALLED else ROOT
CONF = _TOP / "conf"
MODEL_FOLDER = _TOP / "models"
CAMPAIGNS = MODEL_FOLDER / "campaigns"


def group_names(group: str) -> list[str]:
    """Names of the files of a group of conf, as rig, belt and model."""
    return sorted(path.stem for path in (CONF / group).glob("*.yaml"))


def sample_campaigns() -> list[str]:
    """Names of the campaigns that ship."""
    return sorted(path.parent.name for path in CAMPAIGNS.glob("*/campaign.yaml"))


#: Largest YAML that is read from a user [bytes], and how deep it may nest.
LARGEST_YAML, DEEPEST = 1_000_000, 40


class CarefulLoader(yaml.SafeLoader):
    """YAML in which nothing is stated twice, no alias multiplies, nothing nests beyond DEEPEST, and dates are text.

    So are 012, 0x10 and 1:30, numbers of YAML 1.1 to other bases than ten.
    """

    depth = 0
    yaml_implicit_resolvers = {
        first: [(tag, rule) for tag, rule in rules if tag.rpartition(":")[2] not in ("timestamp", "int", "float")]
        for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }

    def compose_node(self, parent: Any, index: Any) -> Any:
        """A node, one floor deeper; raises MarkedYAMLError for an alias and for too many floors."""
        event = self.peek_event()  # type: ignore[no-untyped-call]
        mark: Any = event.start_mark
        if isinstance(event, yaml.AliasEvent):
            problem = "write the value out; anchors and aliases are not read here"
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=mark)
        self.depth += 1
        if self.depth > DEEPEST:
            problem = f"brackets or levels nest deeper than {DEEPEST}"
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=mark)
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        """A mapping; raises MarkedYAMLError for a key that stands there twice."""
        seen: set[str] = set()
        for key, _ in node.value:
            if str(key.value) in seen:
                raise yaml.MarkedYAMLError(problem=f"{key.value} is stated twice", problem_mark=key.start_mark)
            seen.add(str(key.value))
        return super().construct_mapping(node, deep)


_NUMBERS = {
    "int": r"[-+]?(?:0|[1-9][0-9]*)$",
    "float": r"[-+]?(?:(?:0|[1-9][0-9]*)\.[0-9]*|\.[0-9]+)(?:[eE][-+][0-9]+)?$"
    r"|[-+]?\.(?:inf|Inf|INF)$|\.(?:nan|NaN|NAN)$",
}
for _kind, _rule in _NUMBERS.items():
    CarefulLoader.add_implicit_resolver(f"tag:yaml.org,2002:{_kind}", re.compile(_rule), [*"-+.0123456789"])


def careful_yaml(data: bytes, name: str) -> Any:
    """The content of a user's YAML; raises ValueError with one line that names the place and what is wrong there."""
    if len(data) > LARGEST_YAML:
        raise ValueError(f"{name}: has {len(data)} bytes; at most {LARGEST_YAML} are read")
    try:
        return yaml.load(data.decode("utf-8-sig"), Loader=CarefulLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = f":{mark.line + 1}" if mark else ""
        raise ValueError(f"{name}{line}: {' '.join(str(error.problem or error.context).split())}") from None
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        raise ValueError(f"{name}: not readable as YAML ({' '.join(str(error).split())[:200]})") from None


DRAFTS = ".draft"  # a folder of files that a process has not finished


def write_text(path: Path, text: str) -> Path:
    """Write ``text`` to ``path`` in one move."""
    return write_with(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def write_json(path: Path, content: Mapping[str, Any]) -> Path:
    """Write JSON in one move; numbers must be finite or None."""
    return write_text(path, json.dumps(content, indent=2, allow_nan=False) + "\n")


def write_with(path: Path, writer: Callable[[Path], Any]) -> Path:
    """Let ``writer`` fill a temporary file beside ``path``, then rename it. Raises UnwritableError."""
    path = Path(path)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        writer(temporary)
        os.replace(temporary, path)
    except OSError as error:
        about = str(path) if error.filename in (None, str(temporary)) else error.filename
        raise UnwritableError(error.errno, error.strerror or str(error), about) from error
    finally:
        with suppress(OSError):  # as where a file stands in place of a folder
            temporary.unlink()
    return path


def read_json(path: Path) -> dict[str, Any]:
    """The mapping in a JSON file; raises FileNotFoundError, and BeltError for a file that holds anything else."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise
    except (OSError, ValueError, RecursionError) as error:
        raise BeltError(f"{path}: damaged, no JSON can be read from it ({type(error).__name__}); remove it") from error
    if not isinstance(content, dict):
        raise BeltError(f"{path}: damaged, it holds no mapping; remove it")
    return content


def clear_drafts(folder: Path) -> None:
    """Remove what a killed process has left of ``write_with``, and its drafts, from a folder that this one locks."""
    for path in (p for p in folder.glob(".*") if re.fullmatch(r"\..+\.\d+(\.\w+)?", p.name)):
        if path.is_file():
            path.unlink(missing_ok=True)
        elif path.name.startswith(f"{DRAFTS}."):
            shutil.rmtree(path, ignore_errors=True)


PACKAGES = ("belt-sim", "mujoco", "jax", "numpy", "scipy", "hydra-core")


def provenance(config: Any = None) -> dict[str, Any]:
    """Versions, commit, command line and the hash of a resolved configuration.

    A study puts ``python -m studies.NAME`` in front of its command line, a command of belt-sim its name. An installed
    package has no commit, whatever repository it may lie in.
    """
    program = sys.argv[0] if sys.argv[0].startswith(("python -m ", "belt-sim ")) else "belt-sim"
    typed = [a for a in sys.argv[1:] if not a.startswith("hydra.job.name=")]  # the command's name
    return code_origin() | {
        "command": shlex.join([*program.split(), *typed]),
        "config_sha256": config_hash(config) if config is not None else None,
    }


def config_hash(config: Any) -> str:
    """SHA-256 of a configuration (mappings, lists, numbers, strings)."""
    return hashlib.sha256(json.dumps(config, sort_keys=True, default=str).encode()).hexdigest()


@cache
def code_origin() -> dict[str, Any]:
    """Versions of Python and the packages, and the commit of a checkout; None for what cannot be told."""
    versions: dict[str, str | None] = dict.fromkeys(PACKAGES)
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            versions[package] = version(package)
    versions["python"] = sys.version.split()[0]
    commit = None
    if not INSTALLED and (ROOT / ".git").exists():
        with suppress(OSError, subprocess.TimeoutExpired):
            asked = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
            commit = (
                subprocess.run(asked, capture_output=True, text=True, timeout=5, check=False).stdout.strip() or None
            )
    return {"versions": versions, "commit": commit}


@cache
def code_hash() -> str:
    """SHA-256 of the package's own code."""
    found = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        found.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return found.hexdigest()


def file_hash(path: Path) -> str:
    """SHA-256 of a file's content."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
