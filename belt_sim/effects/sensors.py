"""What instruments show: the belt's own edge; gain, zero, drift and delay of the edge sensors, scale of the encoder."""

from dataclasses import replace
from typing import Any, ClassVar

import jax.numpy as jnp

from belt_sim.effects.base import PERCENT, Cause, Effect, effect, parameter
from belt_sim.line.runup import add

EDGE_HARMONICS = 40
FALLS = 1.27  # measured edges: amplitudes fall as harmonic^-1.27


@effect
class EdgeProfile(Effect):
    """Sensors see y + e(material point): e repeats every belt length and passes points 4, 1, 2, 3 in turn.

    e is free up to a wavelength of a fortieth of the belt; on a laboratory conveyor three harmonics left half of it,
    twenty a fifth. It is linear in the reading: a fit needs no march for it, and takes as many harmonics as show.
    """

    title = "Edge profile: the belt's own edge is not straight"
    law = "sensor"
    reference = "docs/theory.md; spectrum as measured on a laboratory conveyor, 1.9 mm peak to peak"
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
    alike = {
        f"{short}{k}": parameter(
            "m", f"harmonic {k} of the belt length, {words}", plausible=(-1e-2 / k, 1e-2 / k), scale=2e-4 / k**FALLS
        )
        for k in range(1, EDGE_HARMONICS + 1)
        for short, words in (("cos", "in phase"), ("sin", "in quadrature"))
    }

    def sensor(self, reading, case):
        phase = _phase(reading.sensor_travel, case)
        cos, first, second = jnp.cos(phase), jnp.zeros(()), jnp.zeros(())
        for k in range(EDGE_HARMONICS, 0, -1):  # Clenshaw's sums, of the cosines and of the sines
            size = jnp.stack([getattr(self, f"cos{k}"), getattr(self, f"sin{k}")])[:, None, None]
            first, second = size + 2.0 * cos * first - second, first
        return replace(reading, y=reading.y + first[0] * cos - second[0] + first[1] * jnp.sin(phase))

    @classmethod
    def columns(cls, sensor_travel, case):
        phase = jnp.arange(1, EDGE_HARMONICS + 1)[:, None, None] * _phase(sensor_travel, case)
        return jnp.stack([jnp.cos(phase), jnp.sin(phase)], axis=1).reshape(-1, *phase.shape[1:])


def _phase(seen, case):
    """2 pi times the place on the belt over its length, of what passes points 1-4, shape (4, n).

    What lies at point 4 at travel 0 has none, whichever way the belt goes, in a run that starts at the marked place.
    """
    rig, direction, seen = case.rig, case.settings.direction, seen + case.settings.start
    at_1, at_2 = rig.span_length, rig.span_length + rig.wrap_tail
    along = jnp.stack([at_1, at_2, at_2 + rig.span_length, 0.0 * at_1])  # points 1-4 along the belt from 4
    return 2 * jnp.pi * (direction * seen[None] - along[:, None]) / rig.belt_length


# The instruments.


class _OfPoints(Effect):
    """Effects with a number at each point, named by ``letter``, that add so many times ``of`` to the readings."""

    letter: ClassVar[str]
    of: ClassVar[str] = ""  # a field of the readings; empty: one

    def sensor(self, reading, case):
        numbers = jnp.stack([getattr(self, f"{self.letter}{k}") for k in range(1, 5)])[:, None]
        return add(reading, y=numbers * getattr(reading, self.of) if self.of else numbers)


def _at_points(letter: str, unit: str, words: str, **more: Any) -> dict[str, Any]:
    return {f"{letter}{k}": parameter(unit, f"{words} at point {k}", **more) for k in range(1, 5)}


@effect
class SensorGain(_OfPoints):
    """An edge sensor shows (1 + g) y."""

    title = "Gain error of the edge sensors"
    law = "sensor"
    reference = "docs/theory.md"
    parity = "odd"
    stage = 1  # after the belt's own edge
    cause = Cause(
        "an edge sensor shows the wrong scale", ("sensors",), "Move a target by a gauge block in front of the sensor."
    )
    letter, of = "g", "y"
    alike = _at_points("g", "1", "gain error", plausible=(-0.3, 0.3), scale=0.02, shop=PERCENT)


@effect
class SensorOffset(_OfPoints):
    """An edge sensor shows y + c, the same c in every run."""

    title = "Zero error common to all runs of an edge sensor"
    law = "sensor"
    reference = "docs/theory.md"
    parity = "even"
    tension_exponent = 0.0
    stage = 2
    cause = Cause(
        "an edge sensor's zero is off", ("sensors",), "Set the sensor's zero on a straightedge along the machine."
    )
    letter = "c"
    alike = _at_points("c", "m", "offset", plausible=(-2e-2, 2e-2), scale=2e-4)


@effect
class SensorDrift(_OfPoints):
    """An edge sensor shows y + d t. The drift is constant in time, so per metre it falls with speed."""

    title = "Drift of the edge sensors in time"
    law = "sensor"
    reference = "docs/theory.md"
    parity = "even"
    tension_exponent = 0.0
    stage = 2
    cause = Cause(
        "an edge sensor drifts with time", ("sensors",), "Read the sensor against a fixed edge before and after a run."
    )
    letter, of = "d", "time"
    alike = _at_points("d", "m/s", "drift", plausible=(-2e-5, 2e-5), scale=1e-6, shop=(3.6e6, "mm/h"))


@effect
class SensorDelay(Effect):
    """Every edge sensor shows the position ``delay`` seconds ago, that is v delay metres of travel (filters, buses).

    At one speed it is a shift of the travel's zero and changes no late rate.
    """

    title = "Delay of the edge sensors"
    law = "sensor"
    reference = "dead time, any textbook on measurement"
    parity = "odd"
    tension_exponent = 0.0
    cause = Cause(
        "the edge sensors lag behind",
        ("sensors",),
        "Look up the sensors' filter time, and repeat a run at another speed.",
    )
    delay: float = parameter("s", "dead time of the edge sensors", plausible=(0.0, 5.0), scale=0.1)

    def sensor_travel(self, travel, case):
        return travel - self.delay * case.settings.speed


@effect
class EncoderScale(Effect):
    """The encoder shows (1 + e) times the true travel, which changes all rates and periods."""

    title = "Encoder scale: a metre on the display is not a metre of belt"
    law = "sensor"
    reference = "docs/theory.md"
    parity = "odd"
    tension_exponent = 0.0
    cause = Cause(
        "the travel encoder shows too much or too little",
        ("encoder",),
        "Mark the belt, run it one turn, and compare the display with the belt's length.",
    )
    e: float = parameter("1", "scale error", plausible=(-0.1, 0.1), scale=0.01, shop=PERCENT)

    def encoder(self, travel, case):
        return travel / (1.0 + self.e)
