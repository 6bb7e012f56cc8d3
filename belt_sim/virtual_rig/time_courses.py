"""Courses in travel and time that several faults follow: steps, random walks, a machine that warms up."""

import math
from functools import cache

import numpy as np

_RUNS, _KNOTS = 256, 400  # a random course is drawn for this many runs and steps


def smooth_step(s, at, over):
    """0 up to travel ``at``, 1 from ``at + over`` on."""
    t = np.clip((s - at) / over, 0.0, 1.0)
    return t * t * (3 - 2 * t)


def random_course(seed: int, run, step: float):
    """A normal number for every run [shape of run] that changes with every whole ``step``."""
    return _drawn_once(seed)[run, min(int(step), _KNOTS - 1)]


@cache
def _drawn_once(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((_RUNS, _KNOTS))


SLOWEST = 1e5  # [s], as good as linear in a record


def warm_up(s, line, time_constant: float):
    """tau (1 - exp(-t/tau)) [s] at travel s, t the time since travel 0."""
    return time_constant * -np.expm1(-s / line.speed / time_constant)


class Warming:
    """Mixed into a fault with a ``time_constant``."""

    @classmethod
    def random_shape(cls, plan, rng):
        """A time constant between a tenth of the record and thrice it, or, one time in three, a linear drift."""
        lasts = plan.length / plan.runs[0].speed
        drawn = math.exp(rng.uniform(math.log(0.1 * lasts), math.log(3 * lasts)))
        return {"time_constant": SLOWEST if rng.random() < 1 / 3 else min(max(drawn, 30.0), SLOWEST)}

    @classmethod
    def shapes(cls, plan):
        """A linear drift, and one that settles within the record."""
        return {"time_constant": SLOWEST}, {"time_constant": max(30.0, 0.3 * plan.length / plan.runs[0].speed)}
