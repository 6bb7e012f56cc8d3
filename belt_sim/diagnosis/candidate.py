"""One set of effects as a candidate explanation, and how good it is."""

import numpy as np

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.forward import Forward
from belt_sim.results.found import Estimate


def estimates(forward: Forward, fit: Fit) -> dict[str, dict[str, Estimate]]:
    """Effect id -> parameter -> Estimate, for every parameter that the readings can see."""
    spread = np.sqrt(np.diag(fit.covariance)) if fit.free else np.empty(0)
    found: dict[str, dict[str, Estimate]] = {i: {} for i in fit.ids}
    for k, position in enumerate(fit.free):
        slot = forward.slots[position]
        if np.linalg.norm(fit.columns[k]) < 1e-6:
            continue
        declared = slot.effect.parameters[slot.name]
        value, u = float(fit.vector[position] * slot.scale), float(spread[k] * slot.scale)
        low, high = declared.plausible
        near = (low - 2 * u <= value <= high + 2 * u) or abs(value - declared.null) <= 2 * u
        found[slot.effect.id][slot.name] = Estimate(value, u, declared.unit, bool(near))
    return found


def is_plausible(forward: Forward, fit: Fit) -> bool:
    """True when every parameter that matters could be met on a real machine."""
    return all(e.plausible for params in estimates(forward, fit).values() for e in params.values())
