"""Measured campaigns on disk, format belt-campaign/1: read, validate, write, and look for dirty data.

A name is loaded when it is first used: a run of a model needs ``Campaign`` as a type, and no reader of files.
"""

import importlib
import re
from pathlib import Path
from typing import Any

#: the type stub is the one list of names: name -> its module
_STUB = Path(__file__).with_suffix(".pyi").read_text("utf-8")
_PLACES = {name: home for home, name in re.findall(r"^from (\S+) import (\w+)", _STUB, re.MULTILINE)}


def __getattr__(name: str) -> Any:
    """A name of this package, loaded when it is first used (PEP 562)."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_PLACES[name]), name)
