"""One set of effects as a candidate explanation: its numbers, and whether a real machine could have them."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.forward import Forward, Slot
from belt_sim.results.found import COVERAGE_95, Estimate

DIVERGED = 1e4  # times a parameter's scale: no optimum but a direction in which the readings say nothing
ALIKE = 1e-12  # beside 1, what is left of the square of a derivative that others make up
EDGE = 2.0  # what a machine could have is a judgement, good to this factor
FAINT = 1e-6  # a parameter that moves no reading by this many sigma is not in the readings


def estimates(forward: Forward, fit: Fit) -> dict[str, dict[str, Estimate]]:
    """Effect id -> parameter -> Estimate, where the readings say more of a number than its plausible range does."""
    return _estimates(forward, fit, list(range(len(fit.free))))


def _estimates(forward: Forward, fit: Fit, rows: Sequence[int]) -> dict[str, dict[str, Estimate]]:
    """The same of the numbers at ``rows`` of a fit, the others held."""
    seen = [k for k in rows if np.linalg.norm(fit.columns[k]) >= FAINT]
    own = fit.columns[list(rows)]
    spread = dict(zip(rows, np.sqrt(np.diag(spread_of(own))), strict=True))
    slots, values = [forward.slots[fit.free[k]] for k in seen], [fit.vector[fit.free[k]] for k in seen]
    return {i: {} for i in fit.ids} | _found(slots, np.array(values), np.array([spread[k] for k in seen]))


def spread_of(columns: np.ndarray) -> np.ndarray:
    """Covariance (k, k) of numbers with whitened derivatives ``columns`` (k, N), large along what no reading shows."""
    size = np.maximum(np.linalg.norm(columns, axis=1), 1e-30)
    alike = columns / size[:, None]
    return np.linalg.inv(alike @ alike.T + ALIKE * np.eye(len(size))) / np.outer(size, size)


def _given_shapes(forward: Forward, fit: Fit) -> dict[str, dict[str, Estimate]]:
    """Estimates with everything held that only shapes what others do.

    At one speed nobody knows from which speed on traction is lost, and so not how much is lost per unit of speed: no
    number can be told, but that some is lost is known.
    """
    slots = [forward.slots[p] for p in fit.free]
    rows = [k for k, s in enumerate(slots) if not s.effect.parameters[s.name].modifier]
    return _estimates(forward, fit, rows)


def _found(slots: Sequence[Slot], values: np.ndarray, spread: np.ndarray) -> dict[str, dict[str, Estimate]]:
    """Effect id -> parameter -> Estimate of numbers and their sigmas in units of their scales.

    What the only size of an effect is, its gain comes from. One of several may be hardly bound by the readings and far
    out at the best fit by chance, as what only shapes others: what a machine has then fits as well.
    """
    found: dict[str, dict[str, Estimate]] = {}
    sizes = Counter(s.effect.id for s in slots if not s.effect.parameters[s.name].modifier)
    for slot, x, dx in zip(slots, values, spread, strict=True):
        declared = slot.effect.parameters[slot.name]
        value, u, (low, high) = float(x * slot.scale), float(dx * slot.scale), declared.plausible
        of_effect = found.setdefault(slot.effect.id, {})
        least, most = value - COVERAGE_95 * u, value + COVERAGE_95 * u
        if least <= low and most >= high:
            continue  # the readings exclude nothing of what a machine could have
        away = value - declared.null
        lowest, highest = _with_slack(low - declared.null, -EDGE), _with_slack(high - declared.null, EDGE)
        one_of_several = declared.modifier or sizes[slot.effect.id] > 1
        reach = COVERAGE_95 * u if one_of_several else 0.0
        there = lowest - reach <= away <= highest + reach or abs(away) <= 2.0 * u
        of_effect[slot.name] = Estimate(value, u, declared.unit, bool(there))
    return found


def _with_slack(bound: float, factor: float) -> float:
    """A bound relative to null, a factor further up, or down where that is negative."""
    return bound * abs(factor) if bound * factor > 0.0 else bound / abs(factor)


def is_plausible(forward: Forward, fit: Fit) -> bool:
    """True when every effect has a number that was found, all found could be met on a real machine, none diverged."""
    if has_diverged(fit):
        return False
    found = estimates(forward, fit)
    given = _given_shapes(forward, fit) if not all(found.values()) else {}
    return _all_met({i: numbers or given[i] for i, numbers in found.items()})


def is_possible(slots: Sequence[Slot], values: np.ndarray, spread: np.ndarray) -> bool:
    """The same of numbers (k,) and their sigmas (k,) in units of their scales."""
    seen = spread > 0.0
    return _all_met(_found([s for s, there in zip(slots, seen, strict=True) if there], values[seen], spread[seen]))


def _all_met(found: dict[str, dict[str, Estimate]]) -> bool:
    return all(params and all(e.plausible for e in params.values()) for params in found.values())


def has_diverged(fit: Fit) -> bool:
    """True where a fit has left the range of numbers: what it says is no finding."""
    numbers = [fit.vector[fit.free], fit.values, np.array([fit.chi2])]
    return bool(any(not np.isfinite(x).all() for x in numbers) or np.any(np.abs(fit.vector[fit.free]) > DIVERGED))


def prior_sigma(forward: Forward, free: Sequence[int]) -> np.ndarray:
    """What is known of parameters before any reading: one sigma (k,) about null in units of their scales, from what a
    real machine could have.
    """
    reach = []
    for position in free:
        slot = forward.slots[position]
        declared = slot.effect.parameters[slot.name]
        reach.append(max(abs(bound - declared.null) for bound in declared.plausible) / slot.scale)
    return np.array(reach)
