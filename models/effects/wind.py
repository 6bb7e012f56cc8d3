"""An effect of one's own: a steady side wind on both spans."""

from dataclasses import replace

from belt_sim.effects.base import Effect, effect, parameter


@effect
class Wind(Effect):
    """A side load w per metre bends a span: kappa at its run-up end changes by w L^2/(12 EI) (clamped beam)."""

    id = "wind"
    law = "run-up"
    reference = "clamped-clamped beam under uniform load, any textbook"
    parity = "even"
    load: float = parameter("N/m", "side load of the wind", plausible=(-5, 5), scale=0.01)

    def runup(self, runup, state, case):
        length, stiffness = case.rig.span_length, case.belt.bending_stiffness
        return replace(runup, turn=runup.turn - self.load * length**2 / (12 * stiffness))
