"""Sensor law: what the instruments say of a belt that moved."""

from dataclasses import dataclass

import jax.numpy as jnp

from belt_sim.pytree import pytree


@pytree
@dataclass(frozen=True, kw_only=True)
class Reading:
    """Readings on one run: travel as the encoder counts it, at which the true curves are looked up.

    travel [m] (n,): encoder travel of every sample; seen [m] (n,): belt travel that the lateral sensors show there;
    time [s] (n,); y [m] (4, n) at points 1-4 and tilt [rad] (2, n) at mid-span, upper and lower, as indicated.
    """

    travel: jnp.ndarray
    seen: jnp.ndarray
    time: jnp.ndarray
    y: jnp.ndarray
    tilt: jnp.ndarray
