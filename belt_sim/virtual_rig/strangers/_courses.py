"""Courses along the travel that several strangers follow."""

from functools import cache

import numpy as np

_RUNS, _KNOTS = 256, 400  # a random course is drawn for this many runs and steps


def smooth_step(s, at, over):
    """0 up to travel ``at``, 1 from ``at + over`` on."""
    t = np.clip((s - at) / over, 0.0, 1.0)
    return t * t * (3 - 2 * t)


def chance(seed: int, run, step: float):
    """A normal number for every run [shape of run] that changes with every whole ``step``."""
    return _drawn_once(seed)[run, min(int(step), _KNOTS - 1)]


@cache
def _drawn_once(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((_RUNS, _KNOTS))
