"""Tails of two laws: chi2, which single gains have by chance, and Gumbel's, which the largest of many has.

The same figures as ``scipy.stats``, from the functions below it: that module takes a quarter of a second to import,
and longer for its checks than for a tail.
"""

import numpy as np
from scipy import special
from scipy.optimize import brentq

EXACT = 1e-14  # to which the scale of a fit is found


def chi2_cdf(x, numbers):
    """Probability that a chi2 of so many numbers is at most ``x``."""
    return special.chdtr(numbers, x)


def chi2_sf(x, numbers):
    """Probability that it is larger."""
    return special.chdtrc(numbers, x)


def chi2_logsf(x, numbers):
    """The logarithm of that; -inf where it underflows."""
    below = special.chdtr(numbers, x)
    with np.errstate(divide="ignore"):
        return np.where(below > 0.5, np.log(special.chdtrc(numbers, x)), np.log1p(-below))[()]


def chi2_isf(p, numbers):
    """The chi2 that is exceeded with probability ``p``."""
    return special.chdtri(numbers, p)


def gumbel_sf(x: float, location: float, scale: float) -> float:
    """Probability that the largest exceeds ``x``."""
    return float(-np.expm1(-np.exp(-(x - location) / scale)))


def gumbel_isf(p: float, location: float, scale: float) -> float:
    """What the largest exceeds with probability ``p``."""
    return float(location - scale * np.log(-np.log1p(-p)))


def gumbel_fit(largest: np.ndarray) -> tuple[float, float]:
    """Location and scale of Gumbel's law by maximum likelihood."""

    def off(scale: float) -> float:
        weights = np.exp((largest.min() - largest) / scale)
        return float(largest.mean() - np.average(largest, weights=weights) - scale)

    low, high = 0.5, 2.0
    while np.sign(off(low)) == np.sign(off(high)) and low > 0.0:
        low, high = 0.5 * low, 2.0 * high
    scale = float(brentq(off, low, high, xtol=EXACT, rtol=EXACT))
    return -scale * float(special.logsumexp(-largest / scale) - np.log(len(largest))), scale
