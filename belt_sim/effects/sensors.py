"""Errors of the instruments: gain, zero, drift and delay of the edge sensors, and the scale of the encoder."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import PERCENT, Cause, Effect, Parameter, effect


def _at_points(letter: str, **kwargs) -> dict[str, Parameter]:
    """Return parameters letter1..letter4 of the sensors at points 1-4."""
    meaning = kwargs.pop("meaning")
    return {f"{letter}{k}": Parameter(meaning=f"{meaning} at point {k}", **kwargs) for k in (1, 2, 3, 4)}


@effect
@dataclass(frozen=True, kw_only=True)
class SensorGain(Effect):
    """An edge sensor shows (1 + g) y."""

    id = "sensor_gain"
    title = "Gain error of the edge sensors"
    law = "sensor"
    reference = "physics sheet, section 7"
    parity = "odd"
    cause = Cause(
        "an edge sensor shows the wrong scale", ("sensors",), "Move a target by a gauge block in front of the sensor."
    )
    parameters = _at_points("g", unit="1", meaning="gain error", plausible=(-0.3, 0.3), scale=0.02, shop=PERCENT)
    g1: float = 0.0
    g2: float = 0.0
    g3: float = 0.0
    g4: float = 0.0

    def sensor(self, reading, case):
        gain = jnp.stack([self.g1, self.g2, self.g3, self.g4])
        return replace(reading, y=reading.y + gain[:, None] * reading.y)


@effect
@dataclass(frozen=True, kw_only=True)
class SensorOffset(Effect):
    """An edge sensor shows y + c, the same c in every run."""

    id = "sensor_offset"
    title = "Zero error common to all runs of an edge sensor"
    law = "sensor"
    reference = "physics sheet, section 7"
    parity = "even"
    tension_exponent = 0.0
    cause = Cause(
        "an edge sensor's zero is off", ("sensors",), "Set the sensor's zero on a straightedge along the machine."
    )
    parameters = _at_points("c", unit="m", meaning="offset", plausible=(-2e-2, 2e-2), scale=2e-4)
    c1: float = 0.0
    c2: float = 0.0
    c3: float = 0.0
    c4: float = 0.0

    def sensor(self, reading, case):
        offset = jnp.stack([self.c1, self.c2, self.c3, self.c4])
        return replace(reading, y=reading.y + offset[:, None])


@effect
@dataclass(frozen=True, kw_only=True)
class SensorDrift(Effect):
    """An edge sensor shows y + d t. The drift is constant in time, so per metre it falls with speed."""

    id = "sensor_drift"
    title = "Drift of the edge sensors in time"
    law = "sensor"
    reference = "physics sheet, section 7"
    parity = "even"
    tension_exponent = 0.0
    cause = Cause(
        "an edge sensor drifts with time", ("sensors",), "Read the sensor against a fixed edge before and after a run."
    )
    parameters = _at_points("d", unit="m/s", meaning="drift", plausible=(-2e-5, 2e-5), scale=1e-6, shop=(3.6e6, "mm/h"))
    d1: float = 0.0
    d2: float = 0.0
    d3: float = 0.0
    d4: float = 0.0

    def sensor(self, reading, case):
        drift = jnp.stack([self.d1, self.d2, self.d3, self.d4])
        return replace(reading, y=reading.y + drift[:, None] * reading.time)


@effect
@dataclass(frozen=True, kw_only=True)
class SensorDelay(Effect):
    """Every edge sensor shows the position ``delay`` seconds ago, that is v delay metres of travel (filters, buses).

    At one speed it is a shift of the travel's zero and changes no late rate.
    """

    id = "sensor_delay"
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
    parameters = {
        "delay": Parameter(unit="s", meaning="dead time of the edge sensors", plausible=(0.0, 5.0), scale=0.1)
    }
    delay: float = 0.0

    def seen(self, travel, case):
        return travel - self.delay * case.settings.speed


@effect
@dataclass(frozen=True, kw_only=True)
class EncoderScale(Effect):
    """The encoder shows (1 + e) times the true travel, which changes all rates and periods."""

    id = "encoder_scale"
    title = "Encoder scale: a metre on the display is not a metre of belt"
    law = "sensor"
    reference = "physics sheet, section 7"
    parity = "odd"
    tension_exponent = 0.0
    cause = Cause(
        "the travel encoder shows too much or too little",
        ("encoder",),
        "Mark the belt, run it one turn, and compare the display with the belt's length.",
    )
    parameters = {"e": Parameter(unit="1", meaning="scale error", plausible=(-0.1, 0.1), scale=0.01, shop=PERCENT)}
    e: float = 0.0

    def encoder(self, travel, case):
        return travel / (1.0 + self.e)
