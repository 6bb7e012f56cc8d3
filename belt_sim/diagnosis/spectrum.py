"""How large the many harmonics of a linear effect are before a reading: they fall as their scales do, all together.

Nobody knows how straight a belt's edge is, but a belt of which thirty numbers hardly show has none of millimetres.
Refits that may take each number for anything a machine allows predict such an edge worse than no edge at all.
"""

import numpy as np

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.forward import Forward

SIZES = np.geomspace(1e-3, 1e3, 121)  # beside the scales and beside one sigma


def with_harmonics(forward: Forward, fit: Fit, sigma: np.ndarray) -> np.ndarray:
    """``sigma`` (k,), of every free number before any reading, where those of a linear effect are Gaussian with a
    common size in units of their scales: that at which numbers like the fitted ones are likeliest."""
    found = sigma.copy()
    spread = np.diag(fit.covariance)
    for cls in (c for c in forward.classes if c.linear and c.id in fit.ids):
        rows = np.isin(fit.free, forward.index(cls.id))
        if rows.any():
            size = _common_size(fit.vector[fit.free][rows], spread[rows])
            found[rows] = np.minimum(sigma[rows], size)
    return found


def _common_size(numbers: np.ndarray, variance: np.ndarray) -> float:
    """One sigma of the Gaussian about zero from which ``numbers`` (k,) of ``variance`` (k,) most likely come."""
    tried = SIZES * np.sqrt(np.median(variance) + np.median(numbers**2))
    total = tried[:, None] ** 2 + variance
    return float(tried[np.argmin(np.sum(numbers**2 / total + np.log(total), axis=1))])
