"""Which effects are worth a joint refit beside a fitted set, and the best refit of each.

In the linear range one Gauss-Newton step tells what an effect would gain (score test). Those that promise most are
refitted, and so is what is nonlinear, of which a step says little.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit, Refit
from belt_sim.diagnosis.fits.linearisation import GridStart, Linearisation
from belt_sim.diagnosis.fits.plausibility import has_diverged, is_plausible, prefer_plausible
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.linear_algebra import basis

Names = tuple[str, ...]

REFITTED = 6  # effects beside one set; the others keep what their columns promise
PROMISING = 0.3  # share of the penalty that a step must gain


def screen(
    bench: Workbench, linearisation: Linearisation, names: Sequence[str], penalty: float, earlier: Mapping[str, Fit]
) -> dict[str, Fit]:
    """The linearised fit with each of ``names`` added: refitted where a step promises enough, else as that step has it.

    penalty, earlier: as in ``fit_best``.
    """
    steps = {name: best_gauss_newton_step(bench, linearisation, name) for name in names}
    gains = {n: linearisation.fit.chi2 - f.chi2 for n, f in steps.items()}
    promising = [n for n in names if gains[n] > PROMISING * penalty]
    first = sorted(promising, key=lambda n: -gains[n])[:REFITTED]
    nonlinear = find_nonlinear(bench, linearisation, {n: steps[n] for n in promising if n not in first})
    chosen = [n for n in promising if n in first or n in linearisation.starts or n in nonlinear]
    return steps | fit_best(bench, linearisation, chosen, penalty, earlier)


# One Gauss-Newton step, exact where an effect enters linearly.
#
# A number that only shapes an effect (where a weld is) says nothing while that is null: a step from null tries its null
# value alone, and an effect that is somewhere else promises next to nothing there. So a step is taken from each of the
# best points of its grid as well, and the best counts.
#
# The step of a nonlinear effect (a cover that soon is as soft as can be) may promise far too little: it goes nowhere
# near the size that the effect has, and what it does there is another shape. One prediction at the step's end tells.

NONLINEAR = 0.3  # share of what a step should do, by which an effect does something else


def best_gauss_newton_step(bench: Workbench, linearisation: Linearisation, name: str) -> Fit:
    """The best fit with one more effect than the linearised one, a step from null or from points of its grid."""
    null = linearisation.with_effect(bench, name)
    on_grid = [s for s in linearisation.starts.get(name, []) if isinstance(s, GridStart)]  # shapes are known there
    steps = map(_gauss_newton_step, [null, *(start.begin(bench, null) for start in on_grid)])
    return min(steps, key=lambda fit: fit.chi2)


def _gauss_newton_step(start: Fit) -> Fit:
    """The fit after one step, as the derivatives at ``start`` foresee it."""
    size = start.sensitivity
    scale = np.where(size > 1e-6, 1.0 / np.maximum(size, 1e-6), 0.0)
    step = scale * np.linalg.lstsq((start.columns * scale[:, None]).T, start.residual, rcond=1e-8)[0]
    vector = start.vector.copy()
    vector[start.free] += step
    residual = start.residual - step @ start.columns
    return replace(
        start,
        vector=vector,
        residual=residual,
        chi2=float(residual @ residual),
        values=start.values + np.einsum("k,krsn->rsn", step, start.slopes),
    )


def find_nonlinear(bench: Workbench, linearisation: Linearisation, steps: Mapping[str, Fit]) -> list[str]:
    """Effects that do something else at the ends of their steps than the derivatives foresee; none that a machine has
    on the other side of null only.
    """
    null, (low, high) = bench.forward.null(), bench.forward.sides
    ends = {n: np.clip(f.vector, low, high) for n, f in steps.items()}
    positions = {n: bench.forward.index(n) for n in steps}
    names = [n for n, k in positions.items() if not bench.forward.linear[k].all() and (ends[n] != null)[k].any()]
    if not names:
        return []
    values = bench.forward.values(np.stack([ends[n] for n in names]))
    fits = [steps[n] for n in names]
    back = [(ends[n] - f.vector)[f.free] for n, f in zip(names, fits, strict=True)]  # to the sides a machine has
    foreseen = np.stack([f.values + np.einsum("k,krsn->rsn", b, f.slopes) for f, b in zip(fits, back, strict=True)])
    change, linear = (bench.metric.whiten(v - linearisation.fit.values) for v in (values, foreseen))
    with np.errstate(over="ignore", invalid="ignore"):  # a step may end anywhere
        error, size = (np.linalg.norm(rows, axis=1) for rows in (change - linear, linear))
    finite = np.isfinite(values).all(axis=(1, 2, 3))
    return [names[k] for k in np.flatnonzero(~(finite & (error <= NONLINEAR * size)))]


# Joint refits, from several starts where an effect is nonlinear.


def fit_best(
    bench: Workbench, linearisation: Linearisation, names: Sequence[str], penalty: float, earlier: Mapping[str, Fit]
) -> dict[str, Fit]:
    """The best joint fit of the linearised fit's effects with each of ``names``.

    penalty: chi2 that each must gain; only what does, and the best of others nearly, is carried to its end; earlier:
    fits with these names, beside the same effects or different ones.
    """
    begun = [(name, start) for name in names for start in linearisation.refit_starts(bench, name, earlier.get(name))]
    owners, starts = [name for name, _ in begun], [start for _, start in begun]
    numbers = {name: len(start.free) - len(linearisation.fit.free) for name, start in begun}
    penalties = {name: penalty + PER_NUMBER * (k - 1) for name, k in numbers.items()}
    without = linearisation.fit.chi2
    race = Race(without, owners, penalties)
    fits = bench.fit(starts, race.find_hopeless)
    ends = [k for k in race.leaders(fits) if not fits[k].is_converged]
    for k, fit in zip(ends, bench.fit([fits[k] for k in ends]), strict=True):
        fits[k] = fit
    best: dict[str, Fit] = {}
    for name, fit in zip(owners, fits, strict=True):
        if not has_diverged(fit) and (name not in best or is_better(bench, fit, best[name])):
            best[name] = fit
    best = {n: f if f.chi2 <= without else linearisation.with_effect(bench, n) for n, f in best.items()}
    paying = [n for n, f in best.items() if f.is_converged and without - f.chi2 > penalty]
    return best | dict(zip(paying, prefer_plausible(bench, [best[n] for n in paying]), strict=True))


def is_better(bench: Workbench, one: Fit, other: Fit) -> bool:
    """Whether one fit is better than another; of two that readings do not tell apart, what a machine can have is."""
    if abs(one.chi2 - other.chi2) > ALIKE:
        return one.chi2 < other.chi2
    return (is_plausible(bench.forward, one), -one.chi2) > (is_plausible(bench.forward, other), -other.chi2)


PER_NUMBER = 2.0  # chi2 that each further free number must gain (Akaike): the 70 of an edge gain 70 by chance
ALIKE = 0.5  # chi2 by which two ends of one fit may differ along a valley that readings hardly bound
FRONT = 12.0  # chi2 behind the best effect, or the least that counts: further behind, no exact end is needed
HORIZON = 20.0  # steps as good as the next that a fit behind others is given
BEHIND = 0.3  # share of the best score so far; a valley is slow where it bends, and what is ahead now may lose
SAME_POINT = 0.02  # of a number, or its scale: two fits of an effect so near each other go the same way
FEWEST_STEPS = 2  # that every fit is given


@dataclass(frozen=True)
class Race:
    """Fits of several effects beside a set that fits with ``chi2``, each from several starts: which go on.

    owners: the effect of every fit; penalties: chi2 that every effect must gain.
    """

    chi2: float
    owners: Sequence[str]
    penalties: Mapping[str, float]

    def find_hopeless(self, refits: Sequence[Refit]) -> list[Refit]:
        """Each refit that has met a better one of its effect, or would be far behind the front of all even after
        HORIZON more steps as good as the next.
        """
        least = BEHIND * (self._front([refit.fit for refit in refits])[1] + FRONT) - FRONT
        hopeless: list[Refit] = []
        better: list[tuple[str, np.ndarray]] = []
        for name, refit in sorted(zip(self.owners, refits, strict=True), key=lambda pair: pair[1].fit.chi2):
            if not refit.settled and refit.is_ready and refit.steps >= FEWEST_STEPS:
                # a step that failed made the next ones short
                reach = refit.fit.chi2 - max(HORIZON * refit.predicted_gain(), refit.predicted_gain(radius=np.inf))
                same = [v for n, v in better if n == name]
                met = any(np.allclose(refit.fit.vector, v, rtol=SAME_POINT, atol=SAME_POINT) for v in same)
                if met or self._score(name, reach) < least:
                    hopeless.append(refit)
            better.append((name, refit.fit.vector))
        return hopeless

    def leaders(self, fits: Sequence[Fit]) -> list[int]:
        """Which fits are the best of effects near the front, or as good."""
        best, least = self._front(fits)
        near = {n for n, chi2 in best.items() if self._score(n, chi2) > least}
        return [k for k, n in enumerate(self.owners) if n in near and fits[k].chi2 < best[n] + ALIKE]

    def _front(self, fits: Sequence[Fit]) -> tuple[dict[str, float], float]:
        """The best chi2 of every effect, and the score below which none is near the front."""
        best: dict[str, float] = {}
        for name, fit in zip(self.owners, fits, strict=True):
            best[name] = min(fit.chi2, best.get(name, np.inf))
        return best, max([0.0, *(self._score(n, c) for n, c in best.items())]) - FRONT

    def _score(self, name: str, chi2: float) -> float:
        """The penalised gain."""
        return self.chi2 - chi2 - self.penalties[name]


# Pairs of effects, all at once in the linear range: where a third effect looks like the sum of two, a search that adds
# one effect after the other takes the third and never sees the two.
#
# Columns at null say little of a nonlinear effect (a guide that touches from some gap on). One that was fitted by
# itself is known where it then stands, and so is what each of the others would add there.

FEW = 4  # numbers of an effect, at most; one with more (a free edge profile) looks like no sum of others
NESTING = 1.0  # chi2, by which a pair must be ahead of its members
ALIKE_PAIRS = 1e-9  # of the largest eigenvalue of columns of unit length: those below are sums of the others


def leading_pairs(
    shapes: Mapping[str, np.ndarray], residual: np.ndarray, penalty: float, count: int, known: Mapping[frozenset, float]
) -> list[Names]:
    """At most ``count`` pairs of effects that promise more than any effect alone, best first.

    shapes: effect -> whitened shapes (k, N); residual (N,); penalty: chi2 that each effect must gain; known: gains of
    nonlinear effects, and of pairs with one of them, where that effect was fitted.
    """
    gains = linear_gains(shapes, residual)
    scores = {ids: max(gain, known.get(frozenset(ids), 0.0)) - penalty * len(ids) for ids, gain in gains.items()}
    alone = max((s for ids, s in scores.items() if len(ids) == 1), default=-np.inf)
    ahead: list[Names] = [ids for ids, score in scores.items() if len(ids) == 2 and score > alone + NESTING]
    return sorted(ahead, key=lambda ids: -scores[ids])[:count]


def linear_gains(shapes: Mapping[str, np.ndarray], residual: np.ndarray) -> dict[Names, float]:
    """chi2 that every effect of FEW numbers, and every pair of them, takes of a residual (N,) in the linear range;
    shapes: effect -> whitened shapes (k, N).
    """
    few = {n: rows for n, rows in shapes.items() if 0 < len(rows) <= FEW}
    rows = np.concatenate([np.empty((0, len(residual))), *few.values()])
    unit = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    gram, moments, ends = unit @ unit.T, unit @ residual, np.cumsum([0, *map(len, few.values())])
    places = {n: np.arange(*pair) for n, pair in zip(few, pairwise(ends), strict=True)}
    gains: dict[Names, float] = {}
    for ids in [*((n,) for n in few), *combinations(few, 2)]:
        own = np.concatenate([places[i] for i in ids])
        inverse = np.linalg.pinv(gram[np.ix_(own, own)], rcond=ALIKE_PAIRS, hermitian=True)
        gains[ids] = float(moments[own] @ inverse @ moments[own])
    return gains


def marginal_gains(fit: Fit, shapes: Mapping[str, np.ndarray]) -> dict[str, float]:
    """chi2 that each effect, by its whitened shapes (k, N), would gain beside a fit whose own numbers are refitted."""
    own = basis(fit.columns)
    spans = {name: np.concatenate([own, basis(rows - (rows @ own.T) @ own)]) for name, rows in shapes.items()}
    return {name: float(np.sum((span @ fit.residual) ** 2)) for name, span in spans.items()}
