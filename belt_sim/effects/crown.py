"""Crown: pulleys that are thicker in the middle."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class Crown(Effect):
    """R(y) = R (1 - c y^2/2): a taper kappa_t = -c y that centres the belt."""

    id = "crown"
    law = "run-up"
    reference = "physics sheet, section 7"
    parity = "odd"
    parameters = {
        "c": Parameter(unit="1/m2", meaning="crown of the tail pulley", plausible=(-0.5, 0.5), scale=5e-3),
        "c_head": Parameter(unit="1/m2", meaning="crown of the head pulley", plausible=(-0.5, 0.5), scale=5e-3),
    }
    c: float = 0.0
    c_head: float = 0.0

    def runup(self, runup, state, case):
        return replace(runup, turn=runup.turn - jnp.stack([self.c, self.c_head]) * state.y)

    def scene(self, parts, case):
        tail, head = parts.tail.crown + self.c, parts.head.crown + self.c_head
        return parts.with_pulley("tail", crown=tail).with_pulley("head", crown=head)
