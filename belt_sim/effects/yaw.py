"""Axes of the pulleys and the drive: zero errors, play, compliance, cant, wobble; tension; a machine that warms up."""

import math
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Schedule
from belt_sim.effects.base import CHECK_MODEL, PERCENT, Cause, Effect, effect, parameter
from belt_sim.line.runup import add


@effect
class YawOffsetTail(Effect):
    """The yaw of the tail pulley is beta + beta_0: the lines w(beta) of all tensions cross at -beta_0."""

    title = "Zero error of the tail pulley's yaw"
    law = "drive"
    reference = "docs/theory.md"
    parity = "even"
    tension_exponent = 0.0
    cause = Cause(
        "the zero of the tail pulley's steering is off",
        ("tail",),
        "Measure the axes' distance at both sides, and set the steering's zero.",
    )
    pulley = "tail"
    beta_0: float = parameter("rad", "yaw at command zero (+: as a positive yaw)", plausible=(-2e-3, 2e-3), scale=1e-4)

    def yaw(self, yaw, state, case):
        return add(yaw, **{self.pulley: self.beta_0})

    def scene(self, parts, case):
        return parts.add_to_pulley(self.pulley, yaw_offset=self.beta_0)


@effect
class YawOffsetHead(YawOffsetTail):
    """The yaw of the head pulley is beta_h + beta_0."""

    title = "Zero error of the head pulley's yaw"
    cause = Cause(
        "the head pulley is not square to the machine",
        ("head",),
        "Measure the axes' distance at both sides of the machine.",
    )
    pulley = "head"


@effect
class YawBacklash(Effect):
    """The tail pulley follows its command through a play of +-half; it starts in the middle of the play."""

    title = "Yaw backlash: play in the steering"
    law = "drive"
    reference = "docs/theory.md; play operator of Prandtl"
    parity = "odd"
    cause = Cause(
        "the steering of the tail pulley has play",
        ("tail",),
        "Push the steered shaft to and fro with a dial gauge on it.",
    )
    half: float = parameter("rad", "half of the play", plausible=(0.0, 5e-4), scale=5e-5)

    def settings(self, settings, case):
        yaw = settings.yaw
        stands, moved = jnp.zeros(()), []
        for wanted in jnp.cumsum(yaw.change):
            then = jnp.clip(stands, wanted - self.half, wanted + self.half)
            moved.append(then - stands)
            stands = then
        return replace(settings, yaw=Schedule(at=yaw.at, over=yaw.over, change=jnp.stack(moved)))


@effect
class YawCompliance(Effect):
    """The tail pulley stands at beta - C_m (M - F (y_1 + y_2)), M the moment of both spans on it.

    A belt off the middle pulls one side of the pulley more, and turns it further that way. M itself grows with the yaw,
    by D = 2 EI dkappa/dtheta_u, both spans alike; the equation is solved for the yaw.
    """

    title = "Yaw compliance: the belt's bending moment and its pull off the middle turn the steered pulley"
    law = "drive"
    reference = "docs/theory.md"
    parity = "odd"
    needs = frozenset({"moment"})
    cause = Cause(
        "the belt turns the steered pulley",
        ("tail",),
        "Put a dial gauge on the steered bearing while the belt is tensioned and steered.",
    )
    c_m: float = parameter("rad/(N m)", "yaw per unit of moment", plausible=(0.0, 5e-5), scale=3e-6)

    def yaw(self, yaw, state, case):
        grows = 2.0 * state.bending * state.stiffness[0]
        pull = case.tension_force * (state.y[0] + state.y_runoff[0] + 2.0 * case.settings.y0)
        at_rest = state.moment[0] + state.moment_runoff[1] - pull - grows * state.turned[0]
        return replace(yaw, tail=(yaw.tail - self.c_m * at_rest) / (1.0 + self.c_m * grows))

    def scene(self, parts, case):
        pull = 2.0 * float(case.tension_force * case.settings.y0)  # of a belt that lies off the middle from the start
        return parts.add_to_pulley("tail", yaw_compliance=self.c_m, yaw_offset=self.c_m * pull)


@effect
class UnequalTension(Effect):
    """The tail pulley is turned by what its tensioners give way unequally: yaw = commanded + yaw_per_force F.

    At one tension it is a zero error of the yaw (yaw_offset_tail); two tensions tell them apart.
    """

    title = "Unequal tension: tensioners left and right do not pull alike"
    law = "drive"
    reference = "equilibrium of an axle on two unequal springs"
    parity = "even"
    tension_exponent = 1.0
    cause = Cause(
        "the left and the right tensioner do not pull alike",
        ("tensioner",),
        "Compare both tensioners' pressures or strokes, and free a guide that sticks.",
    )
    yaw_per_force: float = parameter(
        "rad/N", "yaw of the tail per unit of belt force", plausible=(-2e-6, 2e-6), scale=1e-7
    )

    def yaw(self, yaw, state, case):
        return add(yaw, tail=self.yaw_per_force * case.tension_force)

    def scene(self, parts, case):
        return parts.add_to_pulley("tail", yaw_offset=self.yaw_per_force * float(case.tension_force))


_CANT: Any = {"plausible": (-5e-3, 5e-3), "scale": 2e-4}


@effect
class Cant(Effect):
    """An axis raised by gamma towards +y moves the belt along the wrap, y + gamma z = const, by 2 R gamma.

    It rolls the ends of both spans by gamma, and where they sag and meet the pulley psi before its top it also turns
    the surface's direction (-gamma sin psi on the tail, + on the head pulley). So a machine of which both axes are
    canted alike is one that leans the other way. Material that lay on the pulley at the start moves only through the
    rest of its wrap.
    """

    title = "Cant: a pulley axis that is not level"
    law = "wrap"
    reference = "Zhang 2011 (10.1115/1.4004975); docs/theory.md"
    parity = "even"
    tension_exponent = 0.0
    cause = Cause(
        "the axis of the {pulley} pulley is not level",
        ("tail", "head"),
        "Put a machinist's level on the shaft of the {pulley} pulley.",
    )
    gamma: float = parameter("rad", "cant of the tail pulley (+: higher at +y)", **_CANT)
    gamma_head: float = parameter("rad", "cant of the head pulley (+: higher at +y)", **_CANT)

    def wrap(self, runoff, state, case):
        rig = case.rig
        radius = jnp.stack([rig.tail_radius, rig.head_radius])
        turned = jnp.minimum(state.travel / radius, jnp.pi)
        gamma = jnp.stack([self.gamma, -self.gamma_head]) * state.direction
        return add(runoff, y=gamma * radius * (1.0 - jnp.cos(turned)))

    def yaw(self, yaw, state, case):
        lean, roll = jnp.sin(state.sag_angle), jnp.stack([self.gamma, self.gamma_head])
        turned = {"tail": -self.gamma * lean, "head": self.gamma_head * lean}
        return add(yaw, **turned, roll_runup=roll, roll_runoff=roll[::-1])

    def scene(self, parts, case):
        return parts.add_to_pulley("tail", cant=self.gamma).add_to_pulley("head", cant=self.gamma_head)


_RADII = (-8e-3, -5e-3, -2.5e-3, 0.0, 2.5e-3, 5e-3, 8e-3)  # half a radian of phase apart after thirty turns
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


_ASKEW: Any = {"plausible": (-2e-3, 2e-3), "scale": 1e-4}
_RADIUS: Any = {"plausible": (-0.01, 0.01), "scale": 1e-3, "modifier": True, "grid": _RADII, "shop": PERCENT}


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

    title = "Wobble: a pulley that sits askew on its shaft, or a shaft that is bent"
    law = "run-up"
    reference = "geometry of a cylinder askew: docs/theory.md"
    parity = "even"
    comes_round = True
    cause = Cause(
        "the {pulley} pulley sits askew on its shaft",
        ("tail", "head"),
        "Turn the {pulley} pulley by hand and read a dial gauge at both sides.",
    )
    beta_cos: float = parameter("rad", "askew: yaw of the tail pulley's surface at travel 0", **_ASKEW)
    beta_sin: float = parameter("rad", "the same a quarter of a turn later", **_ASKEW)
    beta_cos_head: float = parameter("rad", "askew: yaw of the head pulley's surface at travel 0", **_ASKEW)
    beta_sin_head: float = parameter("rad", "the same a quarter of a turn later, head pulley", **_ASKEW)
    radius_error: float = parameter("1", "relative error of the stated radius of the tail pulley", **_RADIUS)
    radius_error_head: float = parameter("1", "relative error of the stated radius of the head pulley", **_RADIUS)

    def waves(self, case):
        radii = {"tail_radius": float(case.rig.tail_radius), "head_radius": float(case.rig.head_radius)}
        return {f"rig.{name} with effects.{self.id}": (r, "m", 2.0 * math.pi * r) for name, r in radii.items()}

    def yaw(self, yaw, state, case):
        rig, errors = case.rig, jnp.stack([self.radius_error, self.radius_error_head])
        radius = jnp.stack([rig.tail_radius, rig.head_radius]) * (1.0 + errors)
        across, along = jnp.stack([self.beta_cos, self.beta_cos_head]), jnp.stack([self.beta_sin, self.beta_sin_head])
        cos, sin = cos_sin((state.travel + case.settings.start) / radius)
        swing, rise = across * cos + along * sin, across * sin - along * cos
        roll, aside = state.direction * rise, radius * rise * _RUNS_UP
        moved = {"roll_runup": roll, "roll_runoff": roll[::-1], "aside_runup": aside, "aside_runoff": -aside[::-1]}
        return add(yaw, tail=swing[0], head=swing[1], **moved)

    def scene(self, parts, case):
        direction, start = float(case.settings.direction), float(case.settings.start)
        for pulley, cos, sin, radius in (
            ("tail", self.beta_cos, self.beta_sin, case.rig.tail_radius),
            ("head", self.beta_cos_head, self.beta_sin_head, case.rig.head_radius),
        ):
            phase = math.atan2(-sin * direction, cos) + direction * start / float(radius)
            parts = parts.with_pulley(pulley, wobble=math.hypot(cos, sin), wobble_phase=phase)
        return parts


# Tension.


@effect
class TensionBias(Effect):
    """sigma_true = sigma (1 + gain) + bias."""

    title = "Load-cell gain or bias: the tension is not what the display says"
    law = "drive"
    reference = "docs/theory.md"
    parity = "odd"
    cause = Cause("the tension is not the one displayed", ("tensioner",), "Check the load cell with a known weight.")
    gain: float = parameter("1", "gain error of the load cell", plausible=(-0.3, 0.3), scale=0.05, shop=PERCENT)
    bias: float = parameter("Pa", "zero error of the load cell", plausible=(-3e6, 3e6), scale=3e5)

    def settings(self, settings, case):
        return replace(settings, tension=settings.tension * (1.0 + self.gain) + self.bias)


@effect
class SpeedTension(Effect):
    """The tension that counts in the spans is sigma - share rho v^2: share is 1 where sigma is what the belt itself
    carries, and there is no such effect where it was read off the force on an axle, which lacks rho v^2 already."""

    title = "Centrifugal tension: a fast belt pulls on itself, not on the pulleys"
    law = "drive"
    reference = "docs/theory.md"
    parity = "odd"
    stage = 1  # of the tension that the load cell should have shown
    cause = Cause("speed takes tension off the spans", ("upper", "lower"), CHECK_MODEL, of_model=True)
    share: float = parameter("1", "share of rho v^2 that counts", plausible=(0.5, 1.5), scale=1.0, default=1.0)

    def settings(self, settings, case):
        return replace(settings, tension=settings.tension - self.share * case.belt.density * settings.speed**2)


# A machine that warms up: first-order drift in time of the tail pulley's yaw or taper.


NO_LIMIT = 1e5  # [s]: in any record the drift is then a straight line

_SMALL, _SERIES = 0.01, 6  # below it so many terms of the series are exact to 1e-15, above it 1 - exp is to 1e-14


_TIME_CONSTANT: Any = parameter(
    "s",
    "time constant of warming up",
    plausible=(30.0, NO_LIMIT),
    scale=1e3,
    null=NO_LIMIT,
    modifier=True,
    grid=(30.0, 60.0, 120.0, 300.0, 1000.0, NO_LIMIT),
)


def _drift(rate, time_constant, state, case):
    """Return rate tau (1 - exp(-t/tau)) at the travel of a state, t = s/v being the time since travel 0."""
    x, series = state.travel / case.settings.speed / time_constant, 1.0
    for k in range(_SERIES, 1, -1):  # nearly as exact as expm1, which makes a march much slower
        series = 1.0 - (1.0 / k) * x * series
    return rate * time_constant * jnp.where(x < _SMALL, x * series, 1.0 - jnp.exp(-x))


@effect
class YawDrift(Effect):
    """The yaw of the tail pulley is beta + rate tau (1 - exp(-t/tau)): frame or bearings expand with heat.

    It grows with time, so per metre it falls with speed. It keeps its sign when the yaw changes sign.
    """

    title = "Warming up turns the steered pulley"
    law = "drive"
    reference = "first-order warming of a machine frame, any textbook on thermal drift of machine tools"
    parity = "even"
    tension_exponent = 0.0
    cause = Cause(
        "the steered pulley turns as the machine warms up",
        ("tail",),
        "Measure the axes' distance at both sides, cold and warm.",
    )
    rate: float = parameter("rad/s", "drift of the tail's yaw at first", plausible=(-1e-5, 1e-5), scale=1e-6)
    time_constant: float = _TIME_CONSTANT

    def yaw(self, yaw, state, case):
        return add(yaw, tail=_drift(self.rate, self.time_constant, state, case))


@effect
class TaperDrift(Effect):
    """kappa_t = rate tau (1 - exp(-t/tau)) on the tail pulley: it grows thicker at its warmer end.

    One kelvin between the ends of a steel pulley of 0.2 m is a taper of 6e-5 1/m. By the strip it drives the test rig's
    belt 2.8 times as fast as the paper's yaw at 7 N/mm2, and 0.6 times at 20.
    """

    title = "Warming up makes the steered pulley a cone"
    law = "run-up"
    reference = "docs/theory.md (taper); expansion of steel 1.2e-5 1/K"
    parity = "even"
    cause = Cause(
        "the tail pulley becomes conical as it warms up",
        ("tail",),
        "Measure the temperature at both sides of the pulley.",
    )
    rate: float = parameter(
        "1/(m s)",
        "growth of the tail's taper at first",
        plausible=(-5e-6, 5e-6),
        scale=2e-7,
        shop=(3.6e9, "ppm of the radius per m of width, per hour"),
    )
    time_constant: float = _TIME_CONSTANT

    def runup(self, runup, state, case):
        taper = _drift(self.rate, self.time_constant, state, case)
        return add(runup, turn=jnp.stack([taper, 0.0 * taper]))
