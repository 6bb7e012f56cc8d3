"""Drive law: the commanded yaw of the pulleys against belt travel. Sensor law: readings of the instruments."""

from dataclasses import dataclass

import jax.numpy as jnp

from belt_sim.case import Schedule
from belt_sim.pytrees import pytree


def angle_at(schedule: Schedule, travel):
    """Return the yaw [rad] at a scalar ``travel`` [m]; a step includes its own travel."""
    share = jnp.where(
        schedule.over > 0,
        jnp.clip((travel - schedule.at) / jnp.where(schedule.over > 0, schedule.over, 1.0), 0.0, 1.0),
        (travel >= schedule.at).astype(float),
    )
    return jnp.sum(schedule.change * share)


def mean_angle(schedule: Schedule, start, end):
    """Return the mean yaw [rad] between two travels [m], which keeps the march of second order at steps of the yaw."""
    return jnp.sum(schedule.change * (_area(schedule, end) - _area(schedule, start))) / (end - start)


def _area(schedule: Schedule, travel):
    """Return the integral of every entry's share up to ``travel`` [m]."""
    beyond = jnp.maximum(travel - schedule.at, 0.0)
    over = schedule.over
    safe = jnp.where(over > 0, over, 1.0)
    ramp = jnp.where(beyond < over, beyond**2 / (2 * safe), beyond - over / 2)
    return jnp.where(over > 0, ramp, beyond)


@pytree
@dataclass(frozen=True, kw_only=True)
class Reading:
    """Readings of one run.

    travel [m] (n,): encoder travel of every sample; sensor_travel [m] (n,): belt travel that the lateral sensors show
    then; time [s] (n,); y [m] (4, n) at points 1-4 and tilt [rad] (2, n) at mid-span, upper and lower, as indicated.
    """

    travel: jnp.ndarray
    sensor_travel: jnp.ndarray
    time: jnp.ndarray
    y: jnp.ndarray
    tilt: jnp.ndarray
