"""One set of effects as a candidate explanation: its numbers, and whether a real machine could have them."""

from collections.abc import Sequence

import numpy as np

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.forward import Forward
from belt_sim.results.found import COVERAGE_95, Estimate

DIVERGED = 1e4  # times a parameter's scale: no optimum but a direction in which the readings say nothing
FAINT = 1e-6  # a parameter that moves no reading by this many sigma is not in the readings


def estimates(forward: Forward, fit: Fit) -> dict[str, dict[str, Estimate]]:
    """Effect id -> parameter -> Estimate, where the readings say more of a number than its plausible range does."""
    spread = np.sqrt(np.diag(fit.covariance)) if fit.free else np.empty(0)
    found: dict[str, dict[str, Estimate]] = {i: {} for i in fit.ids}
    for k, position in enumerate(fit.free):
        slot = forward.slots[position]
        if np.linalg.norm(fit.columns[k]) < FAINT:
            continue
        declared = slot.effect.parameters[slot.name]
        value, u = float(fit.vector[position] * slot.scale), float(spread[k] * slot.scale)
        if not _is_found(value, u, declared.plausible):
            continue
        low, high = declared.plausible
        there = low <= value <= high or abs(value - declared.null) <= 2.0 * u
        found[slot.effect.id][slot.name] = Estimate(value, u, declared.unit, bool(there))
    return found


def _is_found(value: float, u: float, plausible: tuple[float, float]) -> bool:
    """Whether the readings exclude anything at all of what a machine could have."""
    low, high = plausible
    return value - COVERAGE_95 * u > low or value + COVERAGE_95 * u < high


def is_plausible(forward: Forward, fit: Fit) -> bool:
    """True when every effect has a number that was found, all found could be met on a real machine, none diverged."""
    if has_diverged(fit):
        return False
    seen = estimates(forward, fit)
    return all(params and all(e.plausible for e in params.values()) for params in seen.values())


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
