"""What a verdict cannot be told apart from."""

from dataclasses import dataclass

import numpy as np

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.openset import OpenSet
from belt_sim.diagnosis.refits import Trial
from belt_sim.diagnosis.select import Selection

REPEATS = 2000  # imagined repetitions of the campaign
UNSEEN = 0.01  # probability kept for what neither library nor tests have thought of
IMITATED = 0.3  # the same where tests say that there is something: of six names beside an unknown two were not there
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
    return found + _additions(selection)


def _additions(selection: Selection) -> list[Rival]:
    """Effects that would fit beside the chosen ones, but whose held-out error speaks against them."""
    chosen, last = selection.chosen, selection.rounds[-1] if selection.rounds else []
    if not chosen.ids:
        return []
    return [
        Rival(chosen.ids[-1], t.id, float(np.sqrt(t.gain)), t.fit)
        for t in last
        if t.passes and t.fit.ids[:-1] == chosen.ids
    ]


def probabilities(selection: Selection, unknown: OpenSet, *, beside: bool = False) -> dict[str, float]:
    """Weight of every chosen effect against those that could stand in its place, and against none of them.

    unknown: the tests of what the base model leaves, or, beside, of what the chosen set leaves; a family of free shapes
    that takes more of it beyond chance than the chosen set does speaks for something that is not in the library.
    A difference of chi2 counts by what chance makes of one: where noise levels are uncertain that is more than 1 for
    each number.
    """
    free = max((unknown.gain[n] - unknown.threshold[n] for n in unknown.gain), default=-np.inf)
    rest = 0.0 if beside else selection.gain - sum(selection.threshold(i) for i in selection.chosen.ids)
    found = {}
    for name, trials in selection.swaps.items():
        own = _own(trials, name).score
        scores = [t.score for t in trials if t.plausible or t.id == name]
        none = max(-own, free - rest)  # not there at all, or unknown
        unit = max(selection.null.inflation(name), 1.0)
        weights = np.exp(np.clip((np.array([*scores, own + none]) - own) / (2.0 * unit), -700, 50))
        found[name] = float((1.0 - (UNSEEN if beside else IMITATED)) / np.sum(weights))
    return found


def selection_frequency(selection: Selection, seed: int) -> dict[str, float]:
    """How often each candidate would come first if the campaign were measured again, the best one being true.

    With m the part of a candidate's whitened residual that the best one does not have, its chi2 under fresh noise e
    is |m|^2 + 2 m.e up to terms common to all; m.e is normal with the Gram matrix of all m.
    """
    first = selection.rounds[0] if selection.rounds else []
    trials = [t for t in first if t.plausible and np.isfinite(t.threshold)]
    if not trials:
        return {}
    best = max(trials, key=lambda t: t.score)
    residuals = [t.fit.residual for t in trials] + [selection.base.residual]
    rest = np.stack([r - best.fit.residual for r in residuals])
    gram = rest @ rest.T
    values, vectors = np.linalg.eigh(gram)
    noise = np.random.default_rng(seed).standard_normal((REPEATS, len(rest))) * np.sqrt(np.maximum(values, 0.0))
    chi2 = np.diag(gram) + 2.0 * noise @ vectors.T
    scores = chi2[:, -1:] - chi2[:, :-1] - np.array([t.threshold for t in trials])
    ahead, passed = np.argmax(scores, axis=1), scores.max(axis=1) > 0
    return {t.id: float(np.mean((ahead == k) & passed)) for k, t in enumerate(trials)}


def _own(trials: list[Trial], name: str) -> Trial:
    return next(t for t in trials if t.id == name)
