"""A machine that warms up: first-order drift in time of the tail pulley's yaw or taper."""

from dataclasses import replace

import jax.numpy as jnp

from belt_sim.effects.base import Cause, Effect, effect, parameter

NO_LIMIT = 1e5  # [s]: in any record the drift is then a straight line

_SMALL, _TERMS = 0.01, 6  # below it so many terms of the series are exact to 1e-15, above it 1 - exp is to 1e-14


def _time_constant():
    meaning, grid = "time constant of warming up", (30.0, 60.0, 120.0, 300.0, 1000.0, NO_LIMIT)
    return parameter("s", meaning, plausible=(30.0, NO_LIMIT), scale=1e3, null=NO_LIMIT, modifier=True, grid=grid)


def _drift(rate, time_constant, state, case):
    """Return rate tau (1 - exp(-t/tau)) at the travel of a state, t = s/v being the time since travel 0."""
    time = state.travel / case.settings.speed
    return rate * time_constant * _one_minus_exp(time / time_constant)


def _one_minus_exp(x):
    """Return 1 - exp(-x) for x >= 0; nearly as exact as expm1, which makes a march much slower."""
    series = 1.0
    for k in range(_TERMS, 1, -1):
        series = 1.0 - (1.0 / k) * x * series
    return jnp.where(x < _SMALL, x * series, 1.0 - jnp.exp(-x))


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
    time_constant: float = _time_constant()

    def yaw(self, yaw, state, case):
        return replace(yaw, tail=yaw.tail + _drift(self.rate, self.time_constant, state, case))


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
    time_constant: float = _time_constant()

    def runup(self, runup, state, case):
        taper = _drift(self.rate, self.time_constant, state, case)
        return replace(runup, turn=runup.turn + jnp.stack([taper, 0.0 * taper]))
