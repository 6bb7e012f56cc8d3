"""The best step of a fit where numbers have to stay on their sides."""

import numpy as np
from scipy.linalg.lapack import dpocon, dpotrf, dpotrs

SMALL = 16  # numbers, up to which it costs nothing to look at all directions of a system
APART = 1e-6  # of the largest direction of a system: where it has more of all, any way to solve it is as exact
DEPENDENT = 1e-10  # the same, what is as good as none
NOTHING = 1e-6  # chi2, which letting go of a held number has to be worth


def inside(system: np.ndarray, along: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The step (k,) between ``low`` and ``high`` (k,) that is best by the quadratic of ``system`` and ``along``.

    Numbers that a free step takes beyond their sides are held there, and let go again where the others then pull them
    back: of two that are known only together, the corner where both end may lie far from their valley.
    """
    step, held = np.zeros(len(along)), np.zeros(len(along), dtype=bool)
    while not held.all():
        step[~held] = _beside_held(system, along, step, held)
        beyond = ~held & ((step < low) | (step > high))
        if not beyond.any():
            break
        step = np.where(beyond, np.clip(step, low, high), step)
        held |= beyond
    for _ in range(2 * np.count_nonzero(held)):
        pull = along - system @ step
        back = held & (low < high) & np.where(step <= low, pull > 0.0, pull < 0.0)
        gains = np.where(back, pull**2 / np.maximum(np.diag(system), 1e-30), 0.0)
        if not np.max(gains) > NOTHING:
            break
        held[np.argmax(gains)] = False
        _down(system, along, step, held, low, high)
    return step


def _down(system, along, step: np.ndarray, held: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Move a ``step`` within its sides to the best of what is not ``held``, holding what comes to a side on the way."""
    while not held.all():
        move = np.zeros(len(step))
        move[~held] = _beside_held(system, along, step, held) - step[~held]
        side = np.where(move > 0.0, high, low)
        share = np.full(len(step), np.inf)
        np.divide(side - step, move, out=share, where=move != 0.0)
        far = min(float(np.min(share)), 1.0)
        step += far * move
        ends = (share <= far) & (far < 1.0)
        if not ends.any():
            break
        step[ends], held[ends] = side[ends], True


def _beside_held(system: np.ndarray, along: np.ndarray, step: np.ndarray, held: np.ndarray) -> np.ndarray:
    """What solves the system for numbers that are not ``held``, the others where they are."""
    return _solved(system[np.ix_(~held, ~held)], along[~held] - system[np.ix_(~held, held)] @ step[held])


def _solved(system: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The shortest solution (k,) of a symmetric system (k, k) without the directions that it has next to nothing of."""
    if len(right) > SMALL:
        root, failed = dpotrf(system)
        if not failed and dpocon(root, np.abs(system).sum(axis=0).max())[0] > APART:
            return dpotrs(root, right)[0]
    return np.linalg.lstsq(system, right, rcond=DEPENDENT)[0]
