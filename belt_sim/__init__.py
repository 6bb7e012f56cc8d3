"""belt_sim: the lateral movement of steel belts, modelled, measured and compared.

    import belt_sim as bs

``simulate`` a case, ``load_campaign`` and ``compare`` a model with it, ``diagnose`` what the model lacks, ``plot`` and
``report`` the result. Tensions are in N/mm2 and yaws in degrees where settings are given as keywords, all else in SI.

Importing this package loads nothing and sets nothing; a name is loaded when it is first asked for. Call ``prepare()``
before anything else for results that are the same to the last bit as those of the command line (see jax_setup).
"""

import importlib
from typing import Any

_HOMES = {
    "Belt": "belt_sim.rig",
    "BeltError": "belt_sim.errors",
    "Campaign": "belt_sim.campaign",
    "Case": "belt_sim.case",
    "Check": "belt_sim.results.check",
    "Comparison": "belt_sim.results.comparison",
    "Curves": "belt_sim.curves",
    "Diagnosis": "belt_sim.results.diagnosis",
    "Discovery": "belt_sim.results.discovery",
    "Effect": "belt_sim.effects.base",
    "InputError": "belt_sim.errors",
    "Rig": "belt_sim.rig",
    "Schedule": "belt_sim.case",
    "Settings": "belt_sim.case",
    "Simulation": "belt_sim.results.simulation",
    "Verdict": "belt_sim.results.verdict",
    "check": "belt_sim.api.inference",
    "compare": "belt_sim.api.inference",
    "diagnose": "belt_sim.api.inference",
    "discover": "belt_sim.api.inference",
    "export": "belt_sim.api.plant",
    "library": "belt_sim.effects.library",
    "linearise": "belt_sim.api.plant",
    "load_campaign": "belt_sim.campaign:read_campaign",
    "load_diagnosis": "belt_sim.results.json:read_diagnosis",
    "model_named": "belt_sim.registry",
    "plot": "belt_sim.api.plot",
    "prepare": "belt_sim.jax_setup",
    "report": "belt_sim.api.plot",
    "scene": "belt_sim.api.simulate",
    "simulate": "belt_sim.api.simulate",
    "traced": "belt_sim.api.simulate",
}
__all__ = list(_HOMES)


def __getattr__(name: str) -> Any:
    """A name of ``__all__``, loaded when it is first asked for (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home, _, there = _HOMES[name].partition(":")
    return getattr(importlib.import_module(home), there or name)


def __dir__() -> list[str]:
    return sorted(__all__)
