"""Writing files so that nothing half-written is ever seen: a temporary name, then a rename."""

import json
import os
import re
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from belt_sim.errors import BeltError

_PICTURES = ".pictures"


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


def pictures_of(folder: Path) -> Path:
    """The hidden folder in which this process has the pictures of a folder until all are drawn."""
    return folder / f"{_PICTURES}.{os.getpid()}"


def moved_in(drafts: Path, folder: Path) -> None:
    """Move every file of a hidden folder into the one that it belongs to; raises BeltError where one cannot be."""
    for path in sorted(drafts.glob("*")):
        try:
            os.replace(path, folder / path.name)
        except OSError as error:
            raise BeltError(f"{folder / path.name}: {error.strerror}; move it away") from None


def clear_drafts(folder: Path) -> None:
    """Remove the temporary files of ``write_with``, and hidden folders of pictures, whose process has died."""
    for path in folder.glob(".*"):
        named = re.fullmatch(r"\.(.+)\.(\d+)(\.\w+)?", path.name)
        if not named or _alive(int(named.group(2))):
            continue
        if path.is_file():
            path.unlink(missing_ok=True)
        elif path.name.startswith(f"{_PICTURES}."):
            shutil.rmtree(path, ignore_errors=True)


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True
