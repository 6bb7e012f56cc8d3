"""How fast a belt can run in 3D: its inertia must not matter, which the speed of its waves decides."""

import math

from belt_sim.case import Case

#: String speed over belt speed. Landings shake the spans; at a 35th of it sag and tension stay within 1 %.
SLOWNESS = 35.0
_FASTEST = 2.0  # [m/s]


def string_speed(case: Case) -> float:
    """Speed of waves along a span, sqrt(sigma / rho) [m/s]."""
    return math.sqrt(float(case.settings.tension) / float(case.belt.density))


def accurate(waves: float) -> float:
    """The fastest belt speed [m/s] at which inertia does not matter, for a string speed ``waves`` [m/s]."""
    return min(_FASTEST, waves / SLOWNESS)


def accelerated(
    travel: float, speed: float, until: float, top: float, acceleration: float, dt: float
) -> tuple[float, float]:
    """Travel [m] and speed [m/s] after a step [s] of a belt that is to stand still at ``until`` [m], inf = never.

    top [m/s]: its speed on the way; acceleration [m/s2], also of slowing down. It arrives exactly.
    """
    ahead = until - travel
    allowed = min(top, math.sqrt(2.0 * acceleration * max(ahead, 0.0)) + 0.5 * acceleration * dt)
    speed = min(speed + acceleration * dt, allowed)
    return (until, 0.0) if ahead <= speed * dt else (travel + speed * dt, speed)
