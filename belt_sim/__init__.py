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
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the same names for editors and type checkers
    from belt_sim import mjx as mjx
    from belt_sim.api.campaigns import import_files as import_files
    from belt_sim.api.inference import check as check
    from belt_sim.api.inference import check_effect as check_effect
    from belt_sim.api.inference import compare as compare
    from belt_sim.api.inference import diagnose as diagnose
    from belt_sim.api.inference import discover as discover
    from belt_sim.api.inference import fit as fit
    from belt_sim.api.plot import plot as plot
    from belt_sim.api.plot import report as report
    from belt_sim.api.simulate import export as export
    from belt_sim.api.simulate import jax_function as jax_function
    from belt_sim.api.simulate import linearise as linearise
    from belt_sim.api.simulate import scene as scene
    from belt_sim.api.simulate import simulate as simulate
    from belt_sim.api.sweep import sweep as sweep
    from belt_sim.campaign import Campaign as Campaign
    from belt_sim.campaign import read_campaign
    from belt_sim.case import Belt as Belt
    from belt_sim.case import Case as Case
    from belt_sim.case import Rig as Rig
    from belt_sim.case import Schedule as Schedule
    from belt_sim.case import Settings as Settings
    from belt_sim.curves import Curves as Curves
    from belt_sim.effects.base import Effect as Effect
    from belt_sim.effects.base import library as library
    from belt_sim.errors import BeltError as BeltError
    from belt_sim.errors import InputError as InputError
    from belt_sim.jax_setup import prepare as prepare
    from belt_sim.linear.plant import close_loop as close_loop
    from belt_sim.model import model_named as model_named
    from belt_sim.model import models as models
    from belt_sim.results.check import Check as Check
    from belt_sim.results.diagnosis import Diagnosis as Diagnosis
    from belt_sim.results.diagnosis import Discovery as Discovery
    from belt_sim.results.diagnosis import Verdict as Verdict
    from belt_sim.results.errors import Comparison as Comparison
    from belt_sim.results.files import read_diagnosis
    from belt_sim.results.simulation import Simulation as Simulation
    from belt_sim.settings import make_case as make_case

    load_campaign, load_diagnosis = read_campaign, read_diagnosis
    __version__: str

#: module -> names of it that this package offers
_HOMES: dict[str, tuple[str, ...]] = {
    "belt_sim.api.campaigns": ("import_files",),
    "belt_sim.api.inference": ("check", "check_effect", "compare", "diagnose", "discover", "fit"),
    "belt_sim.api.plot": ("plot", "report"),
    "belt_sim.api.sweep": ("sweep",),
    "belt_sim.api.simulate": ("export", "jax_function", "linearise", "scene", "simulate"),
    "belt_sim.campaign": ("Campaign",),
    "belt_sim.case": ("Belt", "Case", "Rig", "Schedule", "Settings"),
    "belt_sim.settings": ("make_case",),
    "belt_sim.curves": ("Curves",),
    "belt_sim.effects.base": ("Effect", "library"),
    "belt_sim.errors": ("BeltError", "InputError"),
    "belt_sim.jax_setup": ("prepare",),
    "belt_sim.linear.plant": ("close_loop",),
    "belt_sim.model": ("model_named", "models"),
    "belt_sim.results.check": ("Check",),
    "belt_sim.results.errors": ("Comparison",),
    "belt_sim.results.diagnosis": ("Diagnosis", "Discovery", "Verdict"),
    "belt_sim.results.simulation": ("Simulation",),
}
_PLACES = {name: (home, name) for home, names in _HOMES.items() for name in names}
_PLACES |= {
    "load_campaign": ("belt_sim.campaign", "read_campaign"),
    "load_diagnosis": ("belt_sim.results.files", "read_diagnosis"),
}
__all__ = [*_PLACES, "__version__", "mjx"]


if not TYPE_CHECKING:  # a type checker would take any name to be there

    def __getattr__(name: str) -> Any:
        """A name of ``__all__``, loaded when it is first used (PEP 562)."""
        if name == "__version__":
            globals()[name] = importlib.import_module("importlib.metadata").version("belt-sim")
            return globals()[name]
        if name == "mjx":  # a module of its own, with MuJoCo MJX
            return importlib.import_module("belt_sim.mjx")
        if name not in _PLACES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        home, there = _PLACES[name]
        if home.startswith("belt_sim.api."):
            importlib.import_module("belt_sim.jax_setup").keep_programs()
        return getattr(importlib.import_module(home), there)


def __dir__() -> list[str]:
    return sorted(__all__)
