"""Drift of the edge sensors in time."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects._points import at_points
from belt_sim.effects.base import Effect, effect


@effect
@dataclass(frozen=True, kw_only=True)
class SensorDrift(Effect):
    """A sensor shows y + d t: constant in time, so per metre it falls with speed."""

    id = "sensor_drift"
    law = "sensor"
    affine = True
    reference = "physics sheet, section 7"
    parity = "even"
    tension_exponent = 0.0
    parameters = at_points("d", unit="m/s", meaning="drift", plausible=(-2e-5, 2e-5), scale=1e-6)
    d1: float = 0.0
    d2: float = 0.0
    d3: float = 0.0
    d4: float = 0.0

    def sensor(self, reading, case):
        drift = jnp.stack([self.d1, self.d2, self.d3, self.d4])
        return replace(reading, y=reading.y + drift[:, None] * reading.time)
