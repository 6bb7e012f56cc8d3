"""Edge profile: the belt's own edge is not straight."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Effect, Parameter, effect

HARMONICS = 3


def _declare():
    kinds = (("cos", "in phase"), ("sin", "in quadrature"))
    return {
        f"{short}{k}": Parameter(
            unit="m", meaning=f"harmonic {k} of the belt length, {words}", plausible=(-1e-2, 1e-2), scale=2e-4
        )
        for k in range(1, HARMONICS + 1)
        for short, words in kinds
    }


@effect
@dataclass(frozen=True, kw_only=True)
class EdgeProfile(Effect):
    """Sensors see y + e(material point): e repeats every belt length and passes points 4, 1, 2, 3 in turn."""

    id = "edge_profile"
    law = "sensor"
    reference = "physics sheet, section 7"
    parity = "even"
    tension_exponent = 0.0
    on_belt = True
    min_revolutions = 2.0
    parameters = _declare()
    cos1: float = 0.0
    sin1: float = 0.0
    cos2: float = 0.0
    sin2: float = 0.0
    cos3: float = 0.0
    sin3: float = 0.0

    def sensor(self, reading, case):
        rig, direction = case.rig, case.settings.direction
        at_1, at_2 = rig.span_length, rig.span_length + rig.wrap_tail
        along = jnp.stack([at_1, at_2, at_2 + rig.span_length, 0.0 * at_1])  # points 1-4 along the belt from 4
        phase = 2 * jnp.pi * (reading.seen[None] - direction * along[:, None]) / rig.belt_length
        shape = 0.0
        for k in range(1, HARMONICS + 1):
            cos, sin = getattr(self, f"cos{k}"), getattr(self, f"sin{k}")
            shape = shape + cos * jnp.cos(k * phase) + sin * jnp.sin(k * phase)
        return replace(reading, y=reading.y + shape)
