"""Names of a sweep's folders, made of what was overridden: no slashes, and never too long for a file system."""

import re
from collections.abc import Sequence
from hashlib import sha256

LONGEST = 120  # characters; file systems take 255 bytes, and a letter may have four


def folder_name(overrides: str) -> str:
    """A name of one folder for ``overrides`` (key=value, separated by commas): the same ones have the same name."""
    name = re.sub(r"[/\\:*?\"'<>|\s]+", "_", overrides)
    if name == overrides and len(name) <= LONGEST:
        return name
    return f"{name[:LONGEST]}-{sha256(overrides.encode()).hexdigest()[:8]}"


def sweep_folder(command: str, arguments: Sequence[str]) -> str:
    """The folder of a sweep that names none: one for each set of overrides, so that a sweep goes on in its own."""
    swept = sorted(a for a in arguments if "=" in a and not a.startswith(("hydra.", "hydra/")))
    return f"outputs/{command}/sweep/{folder_name(','.join(swept)) or 'all'}"
