"""One run, one folder: locked while it runs, without what an earlier run left, and none for a run that was refused."""

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from belt_sim.errors import BeltError, InputError
from belt_sim.files import write_json

try:
    import fcntl
except ImportError:  # not on this system: runs in one folder at once are the user's business
    fcntl = None  # type: ignore[assignment]

#: commands whose run makes its folder anew; the others add to what is there
ANEW = ("simulate", "compare", "diagnose", "export", "virtual-rig")


@contextmanager
def own_folder(folder: Path, command: str) -> Iterator[None]:
    """Around a run of ``command`` in ``folder``; raises InputError when another run is at work there."""
    hidden = folder / ".hydra"
    with _locked(hidden / "lock", folder):  # whoever is refused here leaves the folder to the run that is at work
        try:
            before = _there(folder)
            yield
            if command in ANEW:
                _without_stale(folder, before, command)
        except BeltError:
            if folder.is_dir() and {p.name for p in folder.iterdir()} <= {".hydra"}:
                shutil.rmtree(hidden, ignore_errors=True)
                with suppress(OSError):
                    folder.rmdir()
            raise


@contextmanager
def _locked(path: Path, folder: Path) -> Iterator[None]:
    if fcntl is None or not path.parent.is_dir():
        yield
        return
    with path.open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            remedy = "another run is at work there; give each run a folder of its own"
            raise InputError("hydra.run.dir", str(folder), "", remedy) from error
        yield


def _there(folder: Path) -> dict[str, tuple[int, ...]]:
    """What tells a file written anew from one that was there: every writer but Rerun's renames into place."""
    found: dict[str, tuple[int, ...]] = {}
    for base, folders, names in os.walk(folder):
        folders[:] = [f for f in folders if f != ".hydra"]
        for name in names:
            status = (Path(base) / name).stat()
            kept = name == "summary.json"  # touched by a sweep that finds it done
            stamp = (status.st_ino, status.st_size, 0 if kept else status.st_mtime_ns)
            found[str((Path(base) / name).relative_to(folder))] = stamp
    return found


def _without_stale(folder: Path, before: dict[str, tuple[int, ...]], command: str) -> None:
    """Take away what the run of this command before this one left and this one did not write."""
    record = folder / ".hydra" / f"left_by_{command}.json"
    left = sorted(name for name, stamp in _there(folder).items() if before.get(name) != stamp)
    if not left or not record.parent.is_dir():
        return
    try:
        earlier = json.loads(record.read_text(encoding="utf-8"))["files"]
    except (OSError, ValueError, KeyError):
        earlier = []
    for name in set(earlier) & set(before) - set(left):
        (folder / name).unlink(missing_ok=True)
    write_json(record, {"files": left})
