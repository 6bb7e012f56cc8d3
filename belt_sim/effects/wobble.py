"""Wobble: a pulley that sits askew on its shaft, or a shaft that is bent."""

import math
from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Effect, Parameter, effect

_RADII = (-8e-3, -5e-3, -2.5e-3, 0.0, 2.5e-3, 5e-3, 8e-3)  # a radian of phase apart after some thirty turns


def _part(meaning):
    return Parameter(unit="rad", meaning=meaning, plausible=(-2e-3, 2e-3), scale=1e-4)


def _radius(pulley):
    meaning = f"relative error of the stated radius of the {pulley} pulley"
    return Parameter(unit="1", meaning=meaning, plausible=(-0.01, 0.01), scale=1e-3, modifier=True, grid=_RADII)


def _taper(cos, sin, travel, radius):
    """(dR/dy)/R [1/m] at the top of a pulley that turns forwards, or at the bottom of one that turns backwards."""
    turned = travel / radius
    return (cos * jnp.sin(turned) - sin * jnp.cos(turned)) / radius


@effect
@dataclass(frozen=True, kw_only=True)
class Wobble(Effect):
    """A taper that turns with the pulley: dtheta_u/ds = -(kappa_u + kappa_t), period 2 pi R; it leaves no drift.

    The axis of the surface swings about the bearings' axis, seen from above by beta_cos cos(s/R) + beta_sin sin(s/R),
    but no place of the surface ever moves sideways: what the landing belt feels is the radius beside it, which grows
    towards +y by kappa_t = (beta_cos sin(s/R) - beta_sin cos(s/R))/R where it runs up the tail pulley, and by the
    opposite on the head. Bearings that themselves move once a turn would be a yaw (docs/theory.md).

    After fifty turns a radius that is off by a few per mille has shifted the phase by a radian, so the radii's own
    errors belong to the effect.
    """

    id = "wobble"
    law = "run-up"
    reference = "geometry of a cylinder askew: docs/theory.md; physics sheet, section 7 (taper)"
    parity = "even"
    heavy = True
    parameters = {
        "beta_cos": _part("askew: yaw of the tail pulley's surface at travel 0"),
        "beta_sin": _part("the same a quarter of a turn later"),
        "beta_cos_head": _part("askew: yaw of the head pulley's surface at travel 0"),
        "beta_sin_head": _part("the same a quarter of a turn later, head pulley"),
        "radius_error": _radius("tail"),
        "radius_error_head": _radius("head"),
    }
    beta_cos: float = 0.0
    beta_sin: float = 0.0
    beta_cos_head: float = 0.0
    beta_sin_head: float = 0.0
    radius_error: float = 0.0
    radius_error_head: float = 0.0

    def runup(self, runup, state, case):
        tail = case.rig.tail_radius * (1.0 + self.radius_error)
        head = case.rig.head_radius * (1.0 + self.radius_error_head)
        return replace(
            runup,
            turn=runup.turn
            + jnp.stack(
                [
                    _taper(self.beta_cos, self.beta_sin, state.travel, tail),
                    -_taper(self.beta_cos_head, self.beta_sin_head, state.travel, head),
                ]
            ),
        )

    def scene(self, parts, case):
        for pulley, cos, sin in (
            ("tail", self.beta_cos, self.beta_sin),
            ("head", self.beta_cos_head, self.beta_sin_head),
        ):
            phase = math.atan2(-sin * float(case.settings.direction), cos)
            parts = parts.with_pulley(pulley, wobble=math.hypot(cos, sin), wobble_phase=phase)
        return parts
