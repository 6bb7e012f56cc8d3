"""Tension: load-cell errors and centrifugal tension."""

from dataclasses import replace

from belt_sim.effects.base import CHECK_MODEL, PERCENT, Cause, Effect, effect, parameter


@effect
class TensionBias(Effect):
    """sigma_true = sigma (1 + gain) + bias."""

    title = "Load-cell gain or bias: the tension is not what the display says"
    law = "drive"
    reference = "docs/theory.md"
    parity = "odd"
    cause = Cause("the tension is not the one displayed", ("tensioner",), "Check the load cell with a known weight.")
    gain: float = parameter("1", "gain error of the load cell", plausible=(-0.3, 0.3), scale=0.05, shop=PERCENT)
    bias: float = parameter("Pa", "zero error of the load cell", plausible=(-3e6, 3e6), scale=3e5)

    def settings(self, settings, case):
        return replace(settings, tension=settings.tension * (1.0 + self.gain) + self.bias)


@effect
class SpeedTension(Effect):
    """The tension that counts in the spans is sigma - share rho v^2: share is 1 where sigma is what the belt itself
    carries, and there is no such effect where it was read off the force on an axle, which lacks rho v^2 already."""

    title = "Centrifugal tension: a fast belt pulls on itself, not on the pulleys"
    law = "drive"
    reference = "docs/theory.md"
    parity = "odd"
    stage = 1  # of the tension that the load cell should have shown
    cause = Cause("speed takes tension off the spans", ("upper", "lower"), CHECK_MODEL, of_model=True)
    share: float = parameter("1", "share of rho v^2 that counts", plausible=(0.5, 1.5), scale=1.0, default=1.0)

    def settings(self, settings, case):
        return replace(settings, tension=settings.tension - self.share * case.belt.density * settings.speed**2)
