"""Errors of the instruments: gain, zero, drift and delay of the edge sensors, and the scale of the encoder."""

import jax.numpy as jnp

from belt_sim.effects.base import PERCENT, Cause, Effect, effect, parameter
from belt_sim.line.runup import add


def _gain(point: int):
    return parameter("1", f"gain error at point {point}", plausible=(-0.3, 0.3), scale=0.02, shop=PERCENT)


def _offset(point: int):
    return parameter("m", f"offset at point {point}", plausible=(-2e-2, 2e-2), scale=2e-4)


def _drift(point: int):
    return parameter("m/s", f"drift at point {point}", plausible=(-2e-5, 2e-5), scale=1e-6, shop=(3.6e6, "mm/h"))


@effect
class SensorGain(Effect):
    """An edge sensor shows (1 + g) y."""

    title = "Gain error of the edge sensors"
    law = "sensor"
    reference = "docs/theory.md"
    parity = "odd"
    stage = 1  # after the belt's own edge
    cause = Cause(
        "an edge sensor shows the wrong scale", ("sensors",), "Move a target by a gauge block in front of the sensor."
    )
    g1: float = _gain(1)
    g2: float = _gain(2)
    g3: float = _gain(3)
    g4: float = _gain(4)

    def sensor(self, reading, case):
        gain = jnp.stack([self.g1, self.g2, self.g3, self.g4])
        return add(reading, y=gain[:, None] * reading.y)


@effect
class SensorOffset(Effect):
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
    c1: float = _offset(1)
    c2: float = _offset(2)
    c3: float = _offset(3)
    c4: float = _offset(4)

    def sensor(self, reading, case):
        offset = jnp.stack([self.c1, self.c2, self.c3, self.c4])
        return add(reading, y=offset[:, None])


@effect
class SensorDrift(Effect):
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
    d1: float = _drift(1)
    d2: float = _drift(2)
    d3: float = _drift(3)
    d4: float = _drift(4)

    def sensor(self, reading, case):
        drift = jnp.stack([self.d1, self.d2, self.d3, self.d4])
        return add(reading, y=drift[:, None] * reading.time)


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
