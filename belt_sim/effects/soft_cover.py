"""Soft cover, rolling-radius compliance: the belt turns under its own entry moment."""

from dataclasses import dataclass, replace

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class SoftCover(Effect):
    """The edge under more tension sinks deeper and runs on a smaller radius: extra turn c M per metre of travel."""

    id = "soft_cover"
    law = "run-up"
    reference = "physics sheet, section 7"
    parity = "odd"
    parameters = {
        "c": Parameter(unit="1/(N m2)", meaning="turn per metre and unit of moment", plausible=(0.0, 2e-4), scale=5e-6)
    }
    c: float = 0.0

    def runup(self, runup, state, case):
        return replace(runup, turn=runup.turn + self.c * state.moment)
