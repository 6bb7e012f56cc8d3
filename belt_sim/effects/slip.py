"""Finite friction: the belt turns on a pulley at a change of yaw, and wherever it leaves one."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Cause, Effect, Parameter, effect

_ASIDE = 0.3  # of turn times zone: how far the end of a zone goes aside
_FAR, _NEAR = 0.067, 0.484  # of the side force in a zone: its length to 3 % up to z = 14 b


@effect
@dataclass(frozen=True, kw_only=True)
class Slip(Effect):
    """A step M of the belt's moment at the end of a wrap is taken up by friction on a zone of the wrap, which slides.

    Turning a wrapped belt meets at most mu F b/4R newton metres per metre, so that M would fade over
    z = 4 R M/(mu F b); a long zone goes aside as well, which meets mu F/R newtons per metre, and is shorter:
    z (1 + 0.067 x)/(1 + 0.484 x) with x = z/b. The end of the wrap turns by the curvature left there, M zone/2EI, and
    goes aside by 0.3 of turn times zone. M is what is left once it has turned, M_0 - EI k turn (k = dkappa/dtheta at
    that end of the span). A zone ends with the wrap. Given as 1/mu, so that 0 is perfect sticking.

    Where the belt runs up this happens once at each change of yaw: the span bends, the belt on the pulley not yet. A
    change over ``over`` metres lands belt bent already, and turns it by M (zone - over)/2EI or not at all. Then the
    belt lands as bent as its span and sticks. Where it leaves, sliding goes on for good: the belt comes as bent as it
    landed and leaves as bent as the next span wants it; M is the difference.
    """

    id = "slip"
    law = "run-up"
    reference = "Coulomb friction of a wrap; zones solved in tests/agreement/test_slip.py, 3D belt with friction"
    parity = "odd"
    cause = Cause(
        "the belt turns on its pulleys where it should stick",
        ("tail", "head"),
        "Look for grease, water or dust on the pulleys.",
    )
    parameters = {
        "inverse_friction": Parameter(unit="1", meaning="1/mu of belt on pulley", plausible=(1.0, 20.0), scale=6.0)
    }
    inverse_friction: float = 0.0

    def slide(self, contact, state, case):
        held, zone = self._zone(state.moment, state.stiffness, case)
        turned = sum(self._turned(yaw, held, zone, state) for yaw in (case.settings.yaw, case.settings.yaw_head))
        turned = turned / (2.0 * state.bending)
        return replace(contact, y=contact.y + _ASIDE * turned * zone, alpha=contact.alpha - turned)

    def wrap(self, runoff, state, case):
        stuck = (state.moment_runoff + state.bending * state.stiffness * state.left)[::-1]
        held, zone = self._zone(stuck - runoff.moment, state.stiffness[::-1], case)
        turned = held * zone / (2.0 * state.bending)
        aside = runoff.y + _ASIDE * turned * zone
        return replace(runoff, y=aside, alpha=runoff.alpha + turned, turned=runoff.turned + turned)

    def _zone(self, moment, stiffness, case):
        """What is left of a step of moment [N m] once the belt has turned, and the length [m] on which it slides; shape
        (2,), tail and head pulley."""
        rig, width = case.rig, case.belt.width
        radius, wrap = jnp.stack([rig.tail_radius, rig.head_radius]), jnp.stack([rig.wrap_tail, rig.wrap_head])
        whole = 4.0 * radius * self.inverse_friction * jnp.abs(moment) / (case.tension_force * width**2)
        gives = 0.5 * stiffness * width * whole * _share(whole)
        x = whole * (1.0 + 2.0 * gives) / (1.0 + 3.0 * gives + gives**2)  # of x (1 + gives x/whole) = whole, to 1 %
        zone = jnp.minimum(width * x * _share(x), wrap)
        return moment / (1.0 + 0.5 * stiffness * zone), zone

    def _turned(self, schedule, held, zone, state):
        """Moment times length [N m2] over which it turns the belt, if a change of yaw has just ended."""
        end = schedule.at + schedule.over
        ended = (schedule.change != 0.0) & (end > state.since) & (end <= state.travel)
        slides = jnp.maximum(zone[:, None] - schedule.over, 0.0)
        return held * jnp.max(jnp.where(ended, slides, 0.0), axis=1)

    def scene(self, parts, case):
        return replace(parts, friction=1.0 / self.inverse_friction) if self.inverse_friction > 0 else parts


def _share(x):
    """Of the zone that there would be without side force, which has x widths."""
    return (1.0 + _FAR * x) / (1.0 + _NEAR * x)
