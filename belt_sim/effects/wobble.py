"""Wobble: a pulley that sits askew on its shaft, or a shaft that is bent."""

import math
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.effects.base import PERCENT, Cause, Effect, effect, parameter

_RADII = (-8e-3, -5e-3, -2.5e-3, 0.0, 2.5e-3, 5e-3, 8e-3)  # a radian of phase apart after some thirty turns
_RUNS_UP = np.array([-1.0, 1.0])  # forwards on top of the tail and below the head, backwards the other way
_QUARTER = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21)  # a quarter of a turn, in three parts
_TERMS = 8  # of the series, within pi/4


def cos_sin(angle):
    """Return cosine and sine of ``angle`` [rad], exact to 3e-16 up to 1e5 rad.

    XLA calls the library's sine number by number; this series vectorises over many runs at once. The barrier keeps XLA
    from evaluating it again for each use.
    """
    quarters = jnp.round(angle * (1.0 / (_QUARTER[0] + _QUARTER[1])))
    rest = ((angle - quarters * _QUARTER[0]) - quarters * _QUARTER[1]) - quarters * _QUARTER[2]
    square = rest * rest
    cos = sin = 1.0
    for k in range(_TERMS, 0, -1):
        cos = 1.0 - square * cos * (1.0 / ((2 * k - 1) * (2 * k)))
        sin = 1.0 - square * sin * (1.0 / (2 * k * (2 * k + 1)))
    sin = rest * sin
    place = quarters - 4.0 * jnp.floor(0.25 * quarters)  # 0..3
    odd, back = (place == 1.0) | (place == 3.0), place >= 2.0
    over = (place == 1.0) | (place == 2.0)
    first, second = jnp.where(odd, sin, cos), jnp.where(odd, cos, sin)
    return jax.lax.optimization_barrier((jnp.where(over, -first, first), jnp.where(back, -second, second)))


def _part(meaning):
    return parameter("rad", meaning, plausible=(-2e-3, 2e-3), scale=1e-4)


def _radius(pulley):
    meaning = f"relative error of the stated radius of the {pulley} pulley"
    return parameter("1", meaning, plausible=(-0.01, 0.01), scale=1e-3, modifier=True, grid=_RADII, shop=PERCENT)


@effect
class Wobble(Effect):
    """The surface swings as one piece about the bearings' line, period 2 pi R; it leaves no drift.

    Its direction is beta_cos cos(s/R) + beta_sin sin(s/R), as of an axle that is yawed; but the axis also rises by
    gamma = beta_cos sin(s/R) - beta_sin cos(s/R) towards +y where it runs up (falls on reversed travel), which takes
    the surface aside by R gamma where the belt lies. Both together never carry the belt sideways: dy/ds = -theta, and
    the belt feels a taper gamma/R that turns (docs/theory.md). At the start it lies straight on the surface.

    After fifty turns a radius that is off by a few per mille has shifted the phase by a radian, so the radii's own
    errors belong to the effect.
    """

    id = "wobble"
    law = "run-up"
    reference = "geometry of a cylinder askew: docs/theory.md"
    parity = "even"
    comes_round = True
    cause = Cause(
        "the {pulley} pulley sits askew on its shaft",
        ("tail", "head"),
        "Turn the {pulley} pulley by hand and read a dial gauge at both sides.",
    )
    beta_cos: float = _part("askew: yaw of the tail pulley's surface at travel 0")
    beta_sin: float = _part("the same a quarter of a turn later")
    beta_cos_head: float = _part("askew: yaw of the head pulley's surface at travel 0")
    beta_sin_head: float = _part("the same a quarter of a turn later, head pulley")
    radius_error: float = _radius("tail")
    radius_error_head: float = _radius("head")

    def yaw(self, yaw, state, case):
        rig, errors = case.rig, jnp.stack([self.radius_error, self.radius_error_head])
        radius = jnp.stack([rig.tail_radius, rig.head_radius]) * (1.0 + errors)
        across, along = jnp.stack([self.beta_cos, self.beta_cos_head]), jnp.stack([self.beta_sin, self.beta_sin_head])
        cos, sin = cos_sin((state.travel + case.settings.start) / radius)
        swing, rise = across * cos + along * sin, across * sin - along * cos
        aside = radius * rise * _RUNS_UP
        return replace(
            yaw,
            tail=yaw.tail + swing[0],
            head=yaw.head + swing[1],
            roll_runup=yaw.roll_runup + state.direction * rise,
            roll_runoff=yaw.roll_runoff + state.direction * rise[::-1],
            aside_runup=yaw.aside_runup + aside,
            aside_runoff=yaw.aside_runoff - aside[::-1],
        )

    def scene(self, parts, case):
        for pulley, cos, sin in (
            ("tail", self.beta_cos, self.beta_sin),
            ("head", self.beta_cos_head, self.beta_sin_head),
        ):
            phase = math.atan2(-sin * float(case.settings.direction), cos)
            parts = parts.with_pulley(pulley, wobble=math.hypot(cos, sin), wobble_phase=phase)
        return parts
