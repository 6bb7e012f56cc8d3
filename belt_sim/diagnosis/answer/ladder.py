"""Other base models first: what another span law of the house explains without any effect is no missing effect.

Each other model predicts the readings with nothing fitted; what it gains over the model asked for is compared with what
the chosen effects gain beyond chance. Effects that turn the one model into the other say the same, and stay.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.analytic.model import MODELS
from belt_sim.diagnosis.fits.workbench import Workbench, predicted
from belt_sim.diagnosis.readings.batches import WORKERS

HOUSE = ("beam_th1", "beam_th2", "strip", "strip_lift_off")
MOST = 0.8  # of the chi2 beyond noise: a model that takes less of it leaves something unexplained itself
SURER = 6.0  # chi2: a likelihood ratio of 20


@dataclass(frozen=True)
class Rung:
    """Another base model, its chi2 gain over the one asked for, the share of what that leaves beyond noise, and
    its rms error [m], with nothing fitted."""

    model: str
    gain: float
    share: float
    rms: float
    contains: frozenset[str]


def ladder(bench: Workbench, chi2: float) -> list[Rung]:
    """The other models of the house, best first; chi2: of the model asked for, on ``bench``."""
    asked = bench.forward.model
    beyond = max(chi2 - float(np.isfinite(bench.fitted.y).sum()), 1e-9)
    others = [MODELS[name] for name in HOUSE if name != asked.name]
    found = []
    with ThreadPoolExecutor(WORKERS) as pool:  # most of it is loading their code
        each = list(pool.map(partial(predicted, bench.campaign), others))
    for model, values in zip(others, each, strict=True):
        gain = chi2 - float(bench.metric.chi2(bench.fitted.y - values))
        lateral = [k for k, s in enumerate(bench.samples.signals) if s.kind == "lateral"]
        rms = float(np.sqrt(np.nanmean((bench.samples.y - values)[:, lateral] ** 2)))
        found.append(Rung(model.name, gain, gain / beyond, rms, model.contains))
    return sorted(found, key=lambda r: -r.gain)


def better_model(rungs: Sequence[Rung], asked: Composition, chosen: Sequence[str], value: float) -> Rung | None:
    """The model to use instead, where it explains what the one asked for does not, and more than ``chosen`` effects do.

    value: chi2 gain of the chosen effects beyond what chance gives them.
    """
    best = rungs[0] if rungs else None
    if best is None or best.gain <= max(value, 0.0) + SURER or best.share < MOST:
        return None
    said = frozenset(chosen)
    return None if said and said <= best.contains - asked.contains else best
