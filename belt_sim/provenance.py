"""What a result came from: versions, commit, command, configuration."""

import hashlib
import json
import shlex
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from belt_sim.files import INSTALLED, ROOT

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
    """The command line; a study puts ``python -m studies.NAME`` in front."""
    program = sys.argv[0] if sys.argv[0].startswith("python -m ") else "belt-sim"
    return shlex.join([*program.split(), *sys.argv[1:]])


def version_of(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _commit() -> str | None:
    """Of the checkout; None for an installed package, whatever repository it may lie in."""
    if INSTALLED or not (ROOT / ".git").exists():
        return None
    try:
        done = subprocess.run(
            ["git", "-C", str(ROOT), "rev-parse", "HEAD"], capture_output=True, text=True, timeout=5, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() or None
