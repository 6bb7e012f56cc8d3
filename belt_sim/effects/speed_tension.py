"""Centrifugal tension: a fast belt pulls on itself, not on the pulleys."""

from dataclasses import dataclass, replace

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class SpeedTension(Effect):
    """The tension that counts in the spans is sigma - share rho v^2."""

    id = "speed_tension"
    law = "drive"
    reference = "physics sheet, sections 7 and 9"
    parity = "odd"
    parameters = {"share": Parameter(unit="1", meaning="share of rho v^2 that counts", plausible=(0.5, 1.5), scale=1.0)}
    share: float = 1.0

    def settings(self, settings, case):
        return replace(settings, tension=settings.tension - self.share * case.belt.density * settings.speed**2)
