"""A machine that warms up: what grows with time and tends to an end."""

import jax.numpy as jnp

from belt_sim.effects.base import Parameter

FOREVER = 1e5  # [s]: no record is so long that it would tell this from a straight line

TIME_CONSTANT = Parameter(
    unit="s",
    meaning="time constant of warming up",
    plausible=(30.0, FOREVER),
    scale=1e3,
    null=FOREVER,
    modifier=True,
    grid=(30.0, 60.0, 120.0, 300.0, 1000.0, FOREVER),
)


def warmed(rate, time_constant, state, case):
    """rate tau (1 - exp(-t/tau)) at a state's travel, t = s/v the time since travel 0."""
    time = state.travel / case.settings.speed
    return -rate * time_constant * jnp.expm1(-time / time_constant)
