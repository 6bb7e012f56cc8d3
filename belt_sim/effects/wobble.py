"""Wobble: a pulley whose axis does not run true."""

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


@effect
@dataclass(frozen=True, kw_only=True)
class Wobble(Effect):
    """The surface direction swings once a turn: beta + beta_cos cos(s/R) + beta_sin sin(s/R), period 2 pi R.

    After fifty turns a radius that is off by a few per mille has shifted the phase by a radian, so the radii's own
    errors belong to the effect.

    So swings an axle. A pulley askew on a shaft that runs true is a taper (beta/R) sin(s/R) that turns, and moves the
    belt three times as far on a short rig: docs/how_far.md.
    """

    id = "wobble"
    law = "run-up"
    reference = "physics sheet, section 7"
    parity = "even"
    parameters = {
        "beta_cos": _part("in-phase swing of the tail pulley"),
        "beta_sin": _part("quadrature swing of the tail pulley"),
        "beta_cos_head": _part("in-phase swing of the head pulley"),
        "beta_sin_head": _part("quadrature swing of the head pulley"),
        "radius_error": _radius("tail"),
        "radius_error_head": _radius("head"),
    }
    beta_cos: float = 0.0
    beta_sin: float = 0.0
    beta_cos_head: float = 0.0
    beta_sin_head: float = 0.0
    radius_error: float = 0.0
    radius_error_head: float = 0.0

    def yaw(self, yaw, state, case):
        tail = state.travel / (case.rig.tail_radius * (1.0 + self.radius_error))
        head = state.travel / (case.rig.head_radius * (1.0 + self.radius_error_head))
        return replace(
            yaw,
            tail=yaw.tail + self.beta_cos * jnp.cos(tail) + self.beta_sin * jnp.sin(tail),
            head=yaw.head + self.beta_cos_head * jnp.cos(head) + self.beta_sin_head * jnp.sin(head),
        )

    def scene(self, parts, case):
        for pulley, cos, sin in (
            ("tail", self.beta_cos, self.beta_sin),
            ("head", self.beta_cos_head, self.beta_sin_head),
        ):
            phase = math.atan2(-sin * float(case.settings.direction), cos)
            parts = parts.with_pulley(pulley, wobble=math.hypot(cos, sin), wobble_phase=phase)
        return parts
