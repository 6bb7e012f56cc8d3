"""How a machine warms up."""

import math

import numpy as np

SLOWEST = 1e5  # [s], as good as linear in a record


def warmed(s, line, time_constant: float):
    """tau (1 - exp(-t/tau)) [s] at travel s, t the time since travel 0."""
    return time_constant * -np.expm1(-s / line.speed / time_constant)


class Warming:
    """Mixed into a fault with a ``time_constant``."""

    @classmethod
    def shape_by_lot(cls, plan, rng):
        """A time constant between a tenth of the record and thrice it, or, one time in three, a linear drift."""
        lasts = plan.length / plan.runs[0].speed
        drawn = math.exp(rng.uniform(math.log(0.1 * lasts), math.log(3 * lasts)))
        return {"time_constant": SLOWEST if rng.random() < 1 / 3 else min(max(drawn, 30.0), SLOWEST)}

    @classmethod
    def shapes(cls, plan):
        """A linear drift, and one that settles within the record."""
        return {"time_constant": SLOWEST}, {"time_constant": max(30.0, 0.3 * plan.length / plan.runs[0].speed)}
