"""What ``watch=`` asks for, settled before any long work: Rerun is an extra, which a plain install lacks."""

import os
import sys
from importlib.util import find_spec

from belt_sim.errors import InputError

REMEDY = "needs Rerun: pip install 'belt-sim[watch]'"


def watch_asked(watch: str | None, *choices: str) -> str | None:
    """``watch`` if it is null or one of the choices; raises InputError otherwise, or where Rerun is not installed.

    "auto" stands for "rrd" where Rerun is installed; elsewhere it says so and stands for null.
    """
    if watch is not None and watch not in choices:
        raise InputError("watch", watch, "", f"use null, {' or '.join(choices)}")
    if watch == "viewer":
        if not has_display():
            raise InputError("watch", watch, "", "there is no display here; use watch=rrd")
        return watch
    if watch is None or find_spec("rerun"):
        return "rrd" if watch == "auto" else watch
    if watch == "auto":
        print(f"no recording: it {REMEDY}")
        return None
    raise InputError("watch", watch, "", REMEDY)


def has_display() -> bool:
    """Whether a window can be opened here."""
    return sys.platform in ("darwin", "win32") or any(os.environ.get(v) for v in ("DISPLAY", "WAYLAND_DISPLAY"))
