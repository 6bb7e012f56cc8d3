"""Compiled code is given back before a process has no memory mappings left.

Linux allows a process so many mapped regions (``vm.max_map_count``, 65530 as it comes), and compiled code takes a few
for every kernel: a hundred and more for a program, kept as long as it may be called again. A process that compiles
enough (a challenge, a long sweep, a notebook) comes to the limit, and there XLA ends it: "LLVM compilation error:
Cannot allocate memory", then SIGABRT or SIGSEGV.
"""

import gc
import time
from pathlib import Path
from typing import Any
from weakref import WeakSet

import jax

SHARE = 0.6  # of the limit; a diagnosis adds up to 0.02 of it between two looks (1,227 mappings, campaign 9500011)
PAUSE = 2.0  # [s] between two looks: one takes 1 ms for 500 mappings, up to 60 ms for 9,000
_LIMIT = Path("/proc/sys/vm/max_map_count")
_MINE = Path("/proc/self/maps")


class Programs:
    """Compiled programs by what they were compiled for; they may be forgotten between two calls."""

    def __init__(self) -> None:
        self.by_key: dict[Any, Any] = {}
        _held.add(self)


_held: WeakSet[Programs] = WeakSet()
_looked = 0.0


def make_room() -> bool:
    """Forget compiled programs if the process has more than ``SHARE`` of the mappings that it may have.

    What is running keeps its own; what is forgotten is loaded anew when it is called. Does nothing within
    ``PAUSE`` of the last time, nor where the system sets no such limit. Returns whether anything was forgotten.
    """
    global _looked
    now = time.monotonic()
    if now < _looked + PAUSE:
        return False
    _looked = now
    if mappings() <= SHARE * limit():
        return False
    for programs in list(_held):
        programs.by_key.clear()
    jax.clear_caches()
    gc.collect()  # compiled code and what was traced for it refer to each other
    return True


def mappings() -> int:
    """Of this process; 0 where the system does not say."""
    try:
        return _MINE.read_bytes().count(b"\n")
    except OSError:
        return 0


def limit() -> float:
    """Most mappings of a process; infinite where the system sets none."""
    try:
        return int(_LIMIT.read_text())
    except OSError:
        return float("inf")
