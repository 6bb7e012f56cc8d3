"""Writing files so that nothing half-written is ever seen: a temporary name, then a rename."""

import json
import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any


def write_text(path: Path, text: str) -> Path:
    """Write ``text`` to ``path`` in one move."""
    return write_with(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def write_json(path: Path, content: Mapping[str, Any]) -> Path:
    """Write JSON in one move; numbers must be finite or None."""
    return write_text(path, json.dumps(content, indent=2, allow_nan=False) + "\n")


def write_with(path: Path, writer: Callable[[Path], Any]) -> Path:
    """Let ``writer`` fill a temporary file beside ``path``, then rename it."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        writer(temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    return path


def clear_drafts(folder: Path) -> None:
    """Remove the temporary files of ``write_with`` whose process has died while it wrote them."""
    for path in folder.glob(".*"):
        named = re.fullmatch(r"\.(.+)\.(\d+)(\.\w+)?", path.name)
        if named and path.is_file() and not _alive(int(named.group(2))):
            path.unlink(missing_ok=True)


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True
