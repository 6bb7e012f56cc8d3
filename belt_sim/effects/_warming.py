"""A machine that warms up: what grows with time and tends to an end."""

import jax.numpy as jnp

from belt_sim.effects.base import Parameter

FOREVER = 1e5  # [s]: no record is so long that it would tell this from a straight line

_SMALL, _TERMS = 0.01, 6  # below it so many terms of the series are exact to 1e-15, above it 1 - exp is to 1e-14

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
    return rate * time_constant * _risen(time / time_constant)


def _risen(x):
    """1 - exp(-x) for x >= 0; nearly as exact as expm1, which costs a march much more."""
    series = 1.0
    for k in range(_TERMS, 1, -1):
        series = 1.0 - (1.0 / k) * x * series
    return jnp.where(x < _SMALL, x * series, 1.0 - jnp.exp(-x))
