"""Whether a machine that could be real explains the readings as well as the best fit does.

Several numbers of an effect may be known only together: at one tension a load cell's gain does what its zero does, at
three nearly. One that saturates is known from below only: a cover that is soft enough does the same as a softer one.
The best fit then lies anywhere along a valley, mostly far from all machines. What counts is whether the valley passes
where they are: such a fit is made anew with every number held within what a machine could have, and taken where chi2
rises no further than truth does once in twenty.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import chdtri

from belt_sim.diagnosis.fits.candidate import ends, estimates, has_diverged, prior_sigma, spread_of
from belt_sim.diagnosis.fits.fit import Fit, Sides, room
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.results.found import Estimate

SELDOM = 0.05  # of campaigns, in which truth is further from the best fit


def within(bench: Workbench, fits: Sequence[Fit]) -> list[Fit]:
    """``fits``, each as a machine could have it where that explains the readings as well."""
    low, high = sides = _sides(bench)
    again = [k for k, fit in enumerate(fits) if _may_be_a_valley(bench, fit, sides)]
    if not again:
        return list(fits)
    begun = [bench.start(f.ids, np.clip(_nearest(bench, f), low, high), f.free) for f in (fits[k] for k in again)]
    found = list(fits)
    for k, inner in zip(again, bench.fit(begun, sides=sides), strict=True):
        beyond = np.sum((fits[k].vector < low) | (fits[k].vector > high))
        if inner.done and inner.chi2 - fits[k].chi2 < chdtri(max(beyond, 1), SELDOM):
            found[k] = inner
    return found


def each_alone(bench: Workbench, fit: Fit, name: str) -> Mapping[str, Estimate]:
    """What each size of an effect would be if its other sizes were nothing, for those that explain as much so."""
    own = [k for k in bench.forward.index(name) if not _only_shapes(bench, k)]
    if len(own) < 2:
        return {}
    null, begun = bench.forward.null(), []
    for kept in own:
        others = [k for k in own if k != kept]
        vector = fit.vector.copy()
        vector[others] = null[others]
        begun.append(bench.start(fit.ids, vector, [k for k in fit.free if k not in others]))
    found = {}
    for kept, alone in zip(own, bench.fit(begun), strict=True):
        if alone.done and alone.chi2 - fit.chi2 < chdtri(len(own) - 1, SELDOM):
            slot, u = bench.forward.slots[kept], np.sqrt(np.diag(spread_of(alone.columns)))[alone.free.index(kept)]
            told = float(alone.vector[kept] * slot.scale), float(u * slot.scale)
            found[slot.name] = Estimate(*told, slot.effect.parameters[slot.name].unit, True)
    return found


def _only_shapes(bench: Workbench, position: int) -> bool:
    slot = bench.forward.slots[position]
    return slot.effect.parameters[slot.name].modifier


def _may_be_a_valley(bench: Workbench, fit: Fit, sides: Sides) -> bool:
    """Whether numbers are impossible, but not the well-known one of an effect that has no other."""
    down, up = room(fit, sides)
    if has_diverged(fit) or (np.all(down <= 0.0) and np.all(up >= 0.0)):
        return False
    known = estimates(bench.forward, fit)
    single = [i for i in fit.ids if len(bench.forward.index(i)) == 1]
    return not any(not e.plausible for i in single for e in known[i].values())


def _sides(bench: Workbench) -> Sides:
    """Lowest and highest of every number."""
    low, high = (np.array(side) for side in bench.forward.sides)
    reached = np.array([ends(slot) for slot in bench.forward.slots]).reshape(-1, 2)
    low[: len(reached)] = np.maximum(low[: len(reached)], reached[:, 0])
    high[: len(reached)] = np.minimum(high[: len(reached)], reached[:, 1])
    return low, high


def _nearest(bench: Workbench, fit: Fit) -> np.ndarray:
    """The point along the valley, as the derivatives have it, where numbers are least for what machines have."""
    weight = prior_sigma(bench.forward, fit.free) ** -2.0
    away = (fit.vector - bench.forward.null())[fit.free]
    pull = fit.columns @ fit.residual - weight * away
    vector = fit.vector.copy()
    vector[fit.free] += np.linalg.solve(fit.columns @ fit.columns.T + np.diag(weight), pull)
    return vector
