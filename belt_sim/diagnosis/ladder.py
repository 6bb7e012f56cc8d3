"""Other base models first: what another span law of the house explains without any effect is no missing effect.

Each other model predicts the readings with nothing fitted; what it gains over the model asked for is compared with what
the chosen effects gain beyond chance. Effects that turn the one model into the other say the same, and stay.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.analytic.model import MODELS
from belt_sim.diagnosis.decide import NESTING
from belt_sim.diagnosis.workbench import Workbench, workbench

HOUSE = ("beam_th1", "beam_th2", "strip", "strip_lift_off")


@dataclass(frozen=True)
class Rung:
    """Another base model, its chi2 gain over the one that was asked for and its rms error [m], with nothing fitted."""

    model: str
    gain: float
    rms: float
    contains: frozenset[str]


def ladder(bench: Workbench, chi2: float) -> list[Rung]:
    """The other models of the house, best first; chi2: of the model asked for, on ``bench``."""
    asked = bench.forward.model
    found = []
    for model in (MODELS[name] for name in HOUSE if name != asked.name):
        other = workbench(bench.campaign, model, ())
        values = other.forward.values(other.forward.null()[None])[0]
        gain = chi2 - float(bench.metric.chi2(bench.fitted.y - values))
        lateral = [k for k, s in enumerate(bench.samples.signals) if s.kind == "lateral"]
        rms = float(np.sqrt(np.nanmean((bench.samples.y - values)[:, lateral] ** 2)))
        found.append(Rung(model.name, gain, rms, model.contains))
    return sorted(found, key=lambda r: -r.gain)


def better_model(rungs: Sequence[Rung], asked: Composition, chosen: Sequence[str], value: float) -> Rung | None:
    """The model to use instead, where it explains more than ``chosen`` effects do.

    value: chi2 gain of the chosen effects beyond what chance gives them.
    """
    best = rungs[0] if rungs else None
    if best is None or best.gain <= max(value, 0.0) + NESTING:
        return None
    said = frozenset(chosen)
    return None if said and said <= best.contains - asked.contains else best
