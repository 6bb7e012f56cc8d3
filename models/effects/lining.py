"""An effect of one's own: an elastic lining, on which a belt that runs up is turned a little by its own moment."""

import jax

from belt_sim.effects.base import Effect, effect, parameter


@effect
class Lining(Effect):
    """The run-up gives way by c M, so that kappa_u = r d becomes r d/(1 + c EI r_theta), theta_u being less by c M."""

    id = "lining"
    law = "run-up"
    reference = "clamped end on a spring, any textbook"
    parity = "odd"
    c: float = parameter("rad/(N m)", "turn per unit of moment", plausible=(0.0, 1e-4), scale=3e-6)

    def hold(self, answer, span, case):
        give = self.c * span.bending * answer.runup
        turned = give / (1.0 + give[:, 2:3])
        return jax.tree.map(lambda row: row - row[:, 2:3] * turned, answer)
