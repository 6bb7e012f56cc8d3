"""Gain error of the edge sensors."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects._points import at_points
from belt_sim.effects.base import Effect, effect


@effect
@dataclass(frozen=True, kw_only=True)
class SensorGain(Effect):
    """A sensor shows (1 + g) y."""

    id = "sensor_gain"
    law = "sensor"
    affine = True
    reference = "physics sheet, section 7"
    parity = "odd"
    parameters = at_points("g", unit="1", meaning="gain error", plausible=(-0.3, 0.3), scale=0.02)
    g1: float = 0.0
    g2: float = 0.0
    g3: float = 0.0
    g4: float = 0.0

    def sensor(self, reading, case):
        gain = jnp.stack([self.g1, self.g2, self.g3, self.g4])
        return replace(reading, y=reading.y + gain[:, None] * reading.y)
