"""Warming up turns the steered pulley."""

from dataclasses import dataclass, replace

from belt_sim.effects._warming import FOREVER, TIME_CONSTANT, warmed
from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class YawDrift(Effect):
    """The tail pulley stands at beta + rate tau (1 - exp(-t/tau)): frame or bearings grow as the machine warms up.

    It counts in time, not in travel, so per metre it falls with speed; it stays when the yaw changes sign.
    """

    id = "yaw_drift"
    law = "drive"
    reference = "first-order warming of a machine frame, any textbook on thermal drift of machine tools"
    parity = "even"
    tension_exponent = 0.0
    parameters = {
        "rate": Parameter(
            unit="rad/s", meaning="drift of the tail's yaw at first", plausible=(-1e-5, 1e-5), scale=1e-6
        ),
        "time_constant": TIME_CONSTANT,
    }
    rate: float = 0.0
    time_constant: float = FOREVER

    def yaw(self, yaw, state, case):
        return replace(yaw, tail=yaw.tail + warmed(self.rate, self.time_constant, state, case))
