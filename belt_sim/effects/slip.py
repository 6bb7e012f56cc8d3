"""Finite friction: a change of yaw turns the belt on its pulley, once."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class Slip(Effect):
    """Right after a change of yaw the span bends, the belt on the pulley not yet: friction must take up the step M.

    Turning a wrapped belt meets at most mu F b/4R newton metres per metre, so M fades over z = 4 R M/(mu F b), and
    the run-up turns by the curvature left there, M z/2EI; M is what is left once it has turned, M = M_0 - EI k M z/2EI
    (k = dkappa/dtheta_u), a few per cent less on a long span and a third less on a short one. z ends with the wrap. A
    change over ``over`` metres lands belt bent already, and turns it by M (z - over)/2EI or not at all. Then the belt
    lands as bent as its span and sticks. Given as 1/mu, so that 0 is perfect sticking.

    Beside the 3D belt on the test rig, what slip adds to y_1 in the first 3 m is right within 10 % at 20 and 40 N/mm2
    and mu 0.15, within 25 % at 10, and up to 60 % too small at 0.3 (some 10 um). What sliding adds later, 1 to 2 % of
    y, and the turning back of a short belt are not in it.
    """

    id = "slip"
    law = "run-up"
    reference = "Coulomb friction of a wrap, checked against the 3D belt: docs/three_dimensions.md, Friction"
    parity = "odd"
    parameters = {
        "inverse_friction": Parameter(unit="1", meaning="1/mu of belt on pulley", plausible=(1.0, 20.0), scale=6.0)
    }
    inverse_friction: float = 0.0

    def slide(self, alpha, state, case):
        rig = case.rig
        radius, wrap = jnp.stack([rig.tail_radius, rig.head_radius]), jnp.stack([rig.wrap_tail, rig.wrap_head])
        per_moment = 4.0 * radius * self.inverse_friction / (case.tension_force * case.belt.width)  # z/M
        size, give = jnp.abs(state.moment), 0.5 * state.stiffness
        held = 2.0 * state.moment / (1.0 + jnp.sqrt(1.0 + 4.0 * give * per_moment * size))
        slides_all = per_moment * jnp.abs(held) > wrap
        held = jnp.where(slides_all, state.moment / (1.0 + give * wrap), held)
        zone = jnp.where(slides_all, wrap, per_moment * jnp.abs(held))
        turned = sum(self._turned(yaw, held, zone, state) for yaw in (case.settings.yaw, case.settings.yaw_head))
        return alpha - turned / (2.0 * state.bending)

    def _turned(self, schedule, held, zone, state):
        """Moment times length [N m2] over which it turns the belt, if a change of yaw has just ended."""
        end = schedule.at + schedule.over
        ended = (schedule.change != 0.0) & (end > state.since) & (end <= state.travel)
        slides = jnp.maximum(zone[:, None] - schedule.over, 0.0)
        return held * jnp.max(jnp.where(ended, slides, 0.0), axis=1)

    def scene(self, parts, case):
        return replace(parts, friction=1.0 / self.inverse_friction) if self.inverse_friction > 0 else parts
