"""What the instruments may do by themselves: white noise, wander, and errors shared by a run.

The covariance of one run and signal is white^2 I + wander^2 exp(-|ds|/length), or where the wander is smooth, with a
slope everywhere as a slow drift of temperature has it, (1 + r) exp(-r) with r = sqrt(3) |ds|/length (Matern 3/2). Zero,
gain and setting errors are shared by a whole run and are carried as nuisances with a prior (metric.py). The stated
levels may be off; levels.py reads them off the campaign, as factors on what is stated.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from belt_sim.campaign import SignalSheet

SMOOTH = float(np.sqrt(3.0))  # over the length of a smooth wander: one over that of its exponential
FREE_ZERO = 0.02  # [m], one sigma of a zero that is read off a record: more than any sensor was set off by
FLOOR = 1e-9  # [m or rad], so that a signal stated as perfect still has a covariance


class Reach(NamedTuple):
    """How far a wander reaches, as a factor on the stated length; whether it is smooth."""

    length: float = 1.0
    smooth: bool = False


@dataclass(frozen=True, kw_only=True)
class Levels:
    """Factors on the stated white noise, wander and wander length, one for all signals or one each; smooth: whether
    the wander is, in all of them.

    read: whether they were read off the campaign, and from how many repeats (0: from what single runs leave beside all
    candidates); trusted: False where they are so far from what is stated that something unknown may be in them.
    """

    white: float | tuple[float, ...] = 1.0
    wander: float | tuple[float, ...] = 1.0
    length: float | tuple[float, ...] = 1.0
    smooth: bool = False
    repeats: int = 0
    read: bool = False
    trusted: bool = True

    @property
    def sentence(self) -> str:
        """Where the levels come from, and what that costs."""
        if self.repeats:
            return "Noise levels were read off repeated runs."
        if not self.read:
            return "Noise levels are as stated in the campaign; nothing in it can confirm them."
        if self.trusted:
            return (
                "Without repeated runs, noise levels were read off what single runs leave; they agree with the stated."
            )
        return (
            "Single runs scatter far more or less than the campaign states, and no run was repeated: noise cannot be "
            "told from what the model lacks. Repeat two runs."
        )

    def of_signal(self, s: int) -> tuple[float, float, Reach]:
        """White noise, wander and its reach of signal ``s``; one beyond those that were read is like the first."""
        each = (x if isinstance(x, tuple) else (x,) for x in (self.white, self.wander, self.length))
        white, wander, length = (float(x[s if s < len(x) else 0]) for x in each)
        return white, wander, Reach(length, self.smooth)


def covariance(signal: SignalSheet, travel: np.ndarray, per_bin: float, levels: Levels, s: int = 0) -> np.ndarray:
    """Covariance (n, n) of one run's samples of one signal, the ``s``-th, without what a run shares."""
    white, wander, reach = levels.of_signal(s)
    noise = (white * max(signal.white, FLOOR)) ** 2 / per_bin
    return wander**2 * wander_kernel(signal, travel, reach) + noise * np.eye(len(travel))


def wander_kernel(signal: SignalSheet, travel: np.ndarray, reach: Reach) -> np.ndarray:
    """Covariance (n, n) of the wander, of the stated size."""
    apart = np.abs(travel[:, None] - travel[None, :]) / (reach.length * max(signal.wander_length, 1e-6))
    if not reach.smooth:
        return signal.wander_sd**2 * np.exp(-apart)
    return signal.wander_sd**2 * (1.0 + SMOOTH * apart) * np.exp(-SMOOTH * apart)


def whitener(cov: np.ndarray) -> np.ndarray:
    """Inverse of the lower Cholesky factor: it turns noise of covariance ``cov`` into unit white noise."""
    lower = cholesky(cov, lower=True)
    return solve_triangular(lower, np.eye(len(cov)), lower=True)
