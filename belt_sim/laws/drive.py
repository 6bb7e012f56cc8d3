"""Drive law: yaw as it is against yaw as commanded."""

import jax.numpy as jnp

from belt_sim.case import Schedule


def angle_at(schedule: Schedule, travel):
    """Yaw [rad] at ``travel`` [m], a scalar; a step counts from its own travel on."""
    share = jnp.where(
        schedule.over > 0,
        jnp.clip((travel - schedule.at) / jnp.where(schedule.over > 0, schedule.over, 1.0), 0.0, 1.0),
        (travel >= schedule.at).astype(float),
    )
    return jnp.sum(schedule.change * share)


def mean_angle(schedule: Schedule, start, end):
    """Mean yaw [rad] between two travels [m]: keeps the march of second order when a step falls inside."""
    return jnp.sum(schedule.change * (_area(schedule, end) - _area(schedule, start))) / (end - start)


def _area(schedule: Schedule, travel):
    """Integral of every entry's share up to ``travel`` [m]."""
    beyond = jnp.maximum(travel - schedule.at, 0.0)
    over = schedule.over
    safe = jnp.where(over > 0, over, 1.0)
    ramp = jnp.where(beyond < over, beyond**2 / (2 * safe), beyond - over / 2)
    return jnp.where(over > 0, ramp, beyond)
