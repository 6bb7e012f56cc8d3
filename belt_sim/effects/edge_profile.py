"""Edge profile: the belt's own edge is not straight."""

from dataclasses import dataclass, make_dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Cause, Effect, Parameter, effect

HARMONICS = 40
FALLS = 1.27  # measured edges: amplitudes fall as harmonic^-1.27


def _declare():
    """cos1, sin1, cos2, ...: harmonics of the belt length."""
    kinds = (("cos", "in phase"), ("sin", "in quadrature"))
    return {
        f"{short}{k}": Parameter(
            unit="m",
            meaning=f"harmonic {k} of the belt length, {words}",
            plausible=(-1e-2 / k, 1e-2 / k),
            scale=2e-4 / k**FALLS,
        )
        for k in range(1, HARMONICS + 1)
        for short, words in kinds
    }


_Harmonics = make_dataclass(
    "_Harmonics", [(name, float, 0.0) for name in _declare()], bases=(Effect,), frozen=True, kw_only=True
)


@effect
@dataclass(frozen=True, kw_only=True)
class EdgeProfile(_Harmonics):  # type: ignore[misc, valid-type]
    """Sensors see y + e(material point): e repeats every belt length and passes points 4, 1, 2, 3 in turn.

    e is free up to a wavelength of a fortieth of the belt; on a laboratory conveyor three harmonics left half of it,
    twenty a fifth. It is linear in the reading: a fit needs no march for it, and takes as many harmonics as show.
    """

    id = "edge_profile"
    law = "sensor"
    reference = "physics sheet, section 7; spectrum as measured on a laboratory conveyor, 1.9 mm peak to peak"
    parity = "even"
    tension_exponent = 0.0
    on_belt = True
    comes_round = True
    min_revolutions = 1.0  # seen once, but alike in all runs
    cause = Cause(
        "the belt's edge is not straight",
        ("upper", "lower"),
        "Look whether the reading repeats with every turn of the belt; average over whole turns.",
    )
    parameters = _declare()

    def sensor(self, reading, case):
        phase = _phase(reading.seen, case)
        cos, first, second = jnp.cos(phase), jnp.zeros(()), jnp.zeros(())
        for k in range(HARMONICS, 0, -1):  # Clenshaw's sums, of the cosines and of the sines
            size = jnp.stack([getattr(self, f"cos{k}"), getattr(self, f"sin{k}")])[:, None, None]
            first, second = size + 2.0 * cos * first - second, first
        return replace(reading, y=reading.y + first[0] * cos - second[0] + first[1] * jnp.sin(phase))

    @classmethod
    def columns(cls, seen, case):
        phase = jnp.arange(1, HARMONICS + 1)[:, None, None] * _phase(seen, case)
        return jnp.stack([jnp.cos(phase), jnp.sin(phase)], axis=1).reshape(-1, *phase.shape[1:])


def _phase(seen, case):
    """2 pi times the place on the belt over its length, of what passes points 1-4, shape (4, n).

    What lies at point 4 at travel 0 has none, whichever way the belt goes, in a run that starts at the marked place.
    """
    rig, direction, seen = case.rig, case.settings.direction, seen + case.settings.start
    at_1, at_2 = rig.span_length, rig.span_length + rig.wrap_tail
    along = jnp.stack([at_1, at_2, at_2 + rig.span_length, 0.0 * at_1])  # points 1-4 along the belt from 4
    return 2 * jnp.pi * (direction * seen[None] - along[:, None]) / rig.belt_length
