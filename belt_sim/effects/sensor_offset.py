"""Zero error common to all runs of an edge sensor."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects._points import at_points
from belt_sim.effects.base import Effect, effect


@effect
@dataclass(frozen=True, kw_only=True)
class SensorOffset(Effect):
    """A sensor shows y + c, the same in every run."""

    id = "sensor_offset"
    law = "sensor"
    affine = True
    reference = "physics sheet, section 7"
    parity = "even"
    only_when_named = True
    tension_exponent = 0.0
    parameters = at_points("c", unit="m", meaning="offset", plausible=(-2e-2, 2e-2), scale=2e-4)
    c1: float = 0.0
    c2: float = 0.0
    c3: float = 0.0
    c4: float = 0.0

    def sensor(self, reading, case):
        offset = jnp.stack([self.c1, self.c2, self.c3, self.c4])
        return replace(reading, y=reading.y + offset[:, None])
