"""How large the many harmonics of a linear effect are before a reading: they fall as their scales do, all together.

Nobody knows how straight a belt's edge is, but a belt of which thirty numbers hardly show has none of millimetres.
Refits that may take each number for anything a machine allows predict such an edge worse than no edge at all.
"""

from collections.abc import Sequence

import numpy as np

from belt_sim.diagnosis.readings.as_set import Slot

SIZES = np.geomspace(1e-3, 1e3, 121)  # that are tried, beside a typical number and its sigma


def with_harmonics(slots: Sequence[Slot], numbers: np.ndarray, variance: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """``sigma`` (k,), of numbers before any reading, where those of a linear effect are Gaussian with a common size:
    that at which numbers (k,) as they were fitted, of such variance (k,), are likeliest; all in units of their scales.
    """
    found = sigma.copy()
    for cls in {s.effect for s in slots if s.effect.is_additive()}:
        rows = np.array([s.effect is cls for s in slots])
        found[rows] = np.minimum(sigma[rows], _common_size(numbers[rows], variance[rows]))
    return found


def _common_size(numbers: np.ndarray, variance: np.ndarray) -> float:
    """One sigma of the Gaussian about zero from which ``numbers`` (k,) of ``variance`` (k,) most likely come."""
    tried = SIZES * np.sqrt(np.median(variance) + np.median(numbers**2))
    total = tried[:, None] ** 2 + variance
    return float(tried[np.argmin(np.sum(numbers**2 / total + np.log(total), axis=1))])
