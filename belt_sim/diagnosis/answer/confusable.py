"""What a verdict cannot be told apart from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from belt_sim.diagnosis.choice.decide import one_more
from belt_sim.diagnosis.choice.refits import Trial
from belt_sim.diagnosis.choice.select import Selection
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.left_over.openset import OpenSet
from belt_sim.results.words import TOGETHER

REPEATS = 2000  # imagined repetitions of the campaign
UNSEEN = 0.01  # probability kept for what neither library nor tests have thought of
IMITATED = 0.3  # the same where tests say that there is something: of six names beside an unknown two were not there
HELD = 0.95  # of the probability, in the smallest set of effects that is told: what is left out has the rest
PERHAPS = 4.6  # chi2 (a likelihood ratio of 10) by which one effect more may miss what chance gives it, and be told


@dataclass(frozen=True)
class Rival:
    """``other`` in the place of ``effect`` fits almost as well: sigma = sqrt of the chi2 between the two fits."""

    effect: str
    other: str
    sigma: float
    fit: Fit


def rivals(selection: Selection) -> list[Rival]:
    """For every chosen effect, the plausible ones that could stand in its place, and one effect more that may be there.

    Effects in its place are those of the smallest set that holds so much of the probability.
    """
    found = []
    for name, trials in selection.swaps.items():
        own = _own(trials, name)
        found += [_rival(name, t.id, t.fit, own.fit) for t in _likeliest(selection, name) if t is not own]
    return found + _larger(selection)


def _rival(effect: str, other: str, fit: Fit, own: Fit) -> Rival:
    return Rival(effect, other, float(np.sqrt(abs(fit.chi2 - own.chi2))), fit)


def _likeliest(selection: Selection, name: str) -> list[Trial]:
    """The smallest set of effects in the place of one that holds enough of their probability, likeliest first."""
    trials = _possible(selection, name)
    weights = np.exp(_log_weights(selection, name, trials))
    order = np.argsort(-weights, kind="stable")
    before = np.cumsum(weights[order]) - weights[order]
    return [trials[k] for k, sum_before in zip(order, before, strict=True) if sum_before < HELD * weights.sum()]


def _possible(selection: Selection, name: str) -> list[Trial]:
    return [t for t in selection.swaps[name] if t.plausible or t.id == name]


def _log_weights(selection: Selection, name: str, trials: Sequence[Trial]) -> np.ndarray:
    """log of the weight of each against that of the chosen effect ``name``.

    A difference of chi2 counts by what chance makes of one: where noise levels are uncertain that is more than 1 for
    each number.
    """
    own = _own(selection.swaps[name], name).score
    return np.clip((np.array([t.score for t in trials]) - own) / (2.0 * _unit(selection, name)), -700, 50)


def _unit(selection: Selection, name: str) -> float:
    return max(selection.null.inflation(name), 1.0)


def _larger(selection: Selection) -> list[Rival]:
    """Sets of one effect more: those that nearly pay for it, and those that would, were the held-out error not worse.

    They stand in the place of the effect that was chosen last.
    """
    chosen = selection.chosen
    if not chosen.ids:
        return []
    last, rest = chosen.ids[-1], set(chosen.ids[:-1])
    worth, found = _worth(selection), []
    for t in selection.larger:
        together = [i for i in t.fit.ids if i not in rest]
        unit = max(_unit(selection, i) for i in together)
        if t.plausible and t.score > worth - PERHAPS * unit:
            found.append(_rival(last, TOGETHER.join(together), t.fit, chosen))
    return found


def probabilities(selection: Selection, unknown: OpenSet, *, beside: bool = False) -> dict[str, float]:
    """Weight of every chosen effect against those that could stand in its place, and against none of them.

    unknown: the tests of what the base model leaves, or, beside, of what the chosen set leaves; a family of free shapes
    that takes more of it beyond chance than the chosen set does speaks for something that is not in the library.
    """
    free = max((unknown.gain[n] - unknown.threshold[n] for n in unknown.gain), default=-np.inf)
    rest = 0.0 if beside else _worth(selection)
    found = {}
    for name, trials in selection.swaps.items():
        own = _own(trials, name).score
        few = one_more(selection.chosen.ids) - one_more(selection.chosen.ids[1:])  # likelier without it by these odds
        none = max(few * _unit(selection, name) - own, free - rest)  # not there at all, or unknown
        others = np.exp(_log_weights(selection, name, _possible(selection, name)))
        unnamed = np.exp(np.clip(none / (2.0 * _unit(selection, name)), -700, 50))
        weights = [*others, unnamed, *_without(selection, name)]
        found[name] = float((1.0 - (UNSEEN if beside else IMITATED)) / np.sum(weights))
    return found


def _without(selection: Selection, name: str) -> np.ndarray:
    """Weights of larger sets that do without an effect, against that of the chosen set."""
    sets = [t for t in selection.larger if t.plausible and name not in t.fit.ids]
    units = np.array([max(_unit(selection, i) for i in t.fit.ids) for t in sets])
    ahead, odds = np.array([t.score for t in sets]) - _worth(selection), one_more(selection.chosen.ids)
    more = np.array([one_more(t.fit.ids) - odds for t in sets])  # by which one fault more is less likely
    return np.exp(np.clip((ahead / units - more) / 2.0, -700, 50))


def _worth(selection: Selection) -> float:
    """What the chosen set explains above what chance would give it."""
    return selection.gain - sum(selection.threshold(i) for i in selection.chosen.ids)


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
