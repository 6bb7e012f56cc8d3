"""An effect of one's own: an elastic lining, on which a belt that runs up is turned a little by its own moment."""

from dataclasses import dataclass

import jax

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class Lining(Effect):
    """The run-up gives way by c M, so that kappa_u = r d becomes r d/(1 + c EI r_theta), theta_u being less by c M."""

    id = "lining"
    law = "run-up"
    reference = "clamped end on a spring, any textbook"
    parity = "odd"
    parameters = {
        "c": Parameter(unit="rad/(N m)", meaning="turn per unit of moment", plausible=(0.0, 1e-4), scale=3e-6),
    }
    c: float = 0.0

    def hold(self, answer, span, case):
        give = self.c * span.bending * answer.runup
        turned = give / (1.0 + give[:, 2:3])
        return jax.tree.map(lambda row: row - row[:, 2:3] * turned, answer)
