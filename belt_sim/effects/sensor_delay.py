"""Sensors that are late."""

from dataclasses import dataclass

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class SensorDelay(Effect):
    """Filters and buses: every lateral sensor shows what was there ``delay`` seconds ago, v delay metres of travel.

    In runs of one speed it is a shift of the travel's zero; nothing late drifts in it.
    """

    id = "sensor_delay"
    law = "sensor"
    reference = "dead time, any textbook on measurement"
    parity = "odd"
    tension_exponent = 0.0
    parameters = {
        "delay": Parameter(unit="s", meaning="dead time of the edge sensors", plausible=(0.0, 5.0), scale=0.1)
    }
    delay: float = 0.0

    def seen(self, travel, case):
        return travel - self.delay * case.settings.speed
