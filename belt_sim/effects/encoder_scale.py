"""Encoder scale: a metre on the display is not a metre of belt."""

from dataclasses import dataclass

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class EncoderScale(Effect):
    """The encoder shows (1 + e) times the true travel: all rates and all periods change."""

    id = "encoder_scale"
    law = "sensor"
    reference = "physics sheet, section 7"
    parity = "odd"
    tension_exponent = 0.0
    parameters = {"e": Parameter(unit="1", meaning="scale error", plausible=(-0.1, 0.1), scale=0.01)}
    e: float = 0.0

    def encoder(self, travel, case):
        return travel / (1.0 + self.e)
