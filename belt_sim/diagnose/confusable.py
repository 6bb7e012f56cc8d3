"""What a verdict cannot be told apart from."""

from dataclasses import dataclass

import numpy as np

from belt_sim.diagnose.fit import Fit
from belt_sim.diagnose.select import Selection, Trial

RIVAL = 9.2  # a rival set within this score (likelihood ratio 100) cannot be excluded


@dataclass(frozen=True)
class Rival:
    """``other`` in the place of ``effect`` fits almost as well: sigma = sqrt of the chi2 between the two fits."""

    effect: str
    other: str
    sigma: float
    fit: Fit


def rivals(selection: Selection) -> list[Rival]:
    """For every chosen effect, the plausible ones that could stand in its place."""
    found = []
    for name, trials in selection.swaps.items():
        own = _own(trials, name)
        for t in trials:
            if t.id == name or not t.plausible or t.score < own.score - RIVAL:
                continue
            sigma = float(np.sqrt(max(t.fit.chi2 - own.fit.chi2, 0.0)))
            found.append(Rival(name, t.id, sigma, t.fit))
    return found


def probabilities(selection: Selection) -> dict[str, float]:
    """Weight of every chosen effect against those that could stand in its place."""
    found = {}
    for name, trials in selection.swaps.items():
        scores = np.array([t.score for t in trials if t.plausible or t.id == name])
        own = _own(trials, name).score
        found[name] = float(1.0 / np.sum(np.exp(np.clip((scores - own) / 2.0, -700, 50))))
    return found


def _own(trials: list[Trial], name: str) -> Trial:
    return next(t for t in trials if t.id == name)
