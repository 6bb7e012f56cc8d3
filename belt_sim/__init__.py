"""belt_sim: the lateral movement of steel belts, modelled, measured and compared.

    import belt_sim as bs

``simulate`` a case, ``load_campaign`` and ``compare`` a model with it, ``diagnose`` what the model lacks, ``plot`` and
``report`` the result. Tensions are in N/mm2 and yaws in degrees where settings are given as keywords, all else in SI.

Importing this package loads nothing and sets nothing; a name is loaded when it is first used. The first function that
computes gives JAX a cache of compiled programs on disk, where it has none (BELT_SIM_CACHE=off: no cache). Call
``prepare()`` before anything else for results that are the same to the last bit as those of the command line (see
jax_setup).
"""

import importlib
import re
from pathlib import Path
from typing import Any

#: the type stub is the one list of names: name -> its module and its name there
_STUB = Path(__file__).with_suffix(".pyi").read_text("utf-8")
_RENAMED = {there: name for name, there in re.findall(r"^(\w+) = (\w+)$", _STUB, re.MULTILINE)}
_PLACES = {_RENAMED.get(n, n): (home, n) for home, n in re.findall(r"^from (\S+) import (\w+)", _STUB, re.MULTILINE)}
__all__ = [*_PLACES, "__version__"]


def __getattr__(name: str) -> Any:
    """A name of ``__all__``, loaded when it is first used (PEP 562)."""
    if name == "__version__":
        globals()[name] = importlib.import_module("importlib.metadata").version("belt-sim")
        return globals()[name]
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home, there = _PLACES[name]
    if home == "belt_sim":  # a module of its own
        return importlib.import_module(f"belt_sim.{there}")
    if home.startswith("belt_sim.api."):
        importlib.import_module("belt_sim.jax_setup").keep_programs()
    return getattr(importlib.import_module(home), there)


def __dir__() -> list[str]:
    return sorted(__all__)
