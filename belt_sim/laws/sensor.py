"""Sensor law: readings of the instruments."""

from dataclasses import dataclass

import jax.numpy as jnp

from belt_sim.pytree import pytree


@pytree
@dataclass(frozen=True, kw_only=True)
class Reading:
    """Readings of one run.

    travel [m] (n,): encoder travel of every sample; seen [m] (n,): belt travel that the lateral sensors show then;
    time [s] (n,); y [m] (4, n) at points 1-4 and tilt [rad] (2, n) at mid-span, upper and lower, as indicated.
    """

    travel: jnp.ndarray
    seen: jnp.ndarray
    time: jnp.ndarray
    y: jnp.ndarray
    tilt: jnp.ndarray
