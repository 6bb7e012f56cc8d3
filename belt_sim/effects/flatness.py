"""Flatness: residual stress of the rolled strip changes how easily a span twists."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class Flatness(Effect):
    """The strip has the residual stress amplitude (1 - 12 y^2/b^2) across its width: a parabola without resultant.

    amplitude > 0: long edges, which are pressed; amplitude < 0: a long middle. The stress at rest works on the twist
    like tension does, T = b^3 h (sigma - 0.8 amplitude)/12 + G b h^3/3 (the integral of s y^2 over the section).
    Narrow edges under pressure do not buckle, so EI stays as it is (studies/notes/shell.md compares both with a shell).
    From amplitude = 1.25 sigma on the spans twist by themselves and no linear law holds: the share of the tension in T
    is then taken as 0.
    """

    id = "flatness"
    law = "span"
    reference = "residual stress of rolled strip: Fischer et al. 2000 (Int. J. Mech. Sci. 42); T by virtual work"
    parity = "odd"
    needs = frozenset({"sag"})
    parameters = {
        "amplitude": Parameter(
            unit="Pa", meaning="residual stress in the middle of the width", plausible=(-2e7, 2e7), scale=3e6
        )
    }
    amplitude: float = 0.0

    def span(self, span, case):
        belt = case.belt
        change = -jnp.minimum(0.8 * self.amplitude, case.settings.tension)
        return replace(span, torsion=span.torsion + belt.width**3 * belt.thickness / 12.0 * change)
