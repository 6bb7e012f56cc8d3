"""Run-up law: how a belt that sticks climbs onto a pulley (physics sheet, section 2; paper eq. 13-15).

With alpha = theta - theta_p, the belt's angle against the pulley's surface direction where it runs up,

    dy/ds = -alpha + drift,    dalpha/ds = -(kappa + turn).

A yaw of the pulley turns the stuck belt with it: alpha does not jump. drift and turn belong to effects.

The drive law (commanded yaw against travel), the wrap law and the readings of instruments follow.
"""

from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import jax.numpy as jnp

from belt_sim.case import Case, Schedule, pytree


def add(value: Any, **more: Any) -> Any:
    """Return a dataclass with numbers added to some of its fields."""
    return replace(value, **{name: getattr(value, name) + x for name, x in more.items()})


TWO_ZEROS = partial(jnp.zeros, 2)  # of what there is at two pulleys or spans
FRICTION = 0.15  # of belt on pulley where no effect says it: steel on a smooth pulley, the least that is usual


@pytree
@dataclass(frozen=True, kw_only=True)
class RunUp:
    """Terms that effects add at the run-ups: drift [rad], turn [1/m]; shape (2,): tail, head pulley."""

    drift: jnp.ndarray
    turn: jnp.ndarray


@pytree
@dataclass(frozen=True, kw_only=True)
class Contact:
    """Position of the belt at the run-ups: y [m], alpha [rad], shape (2,): tail, head pulley."""

    y: jnp.ndarray
    alpha: jnp.ndarray


@pytree
@dataclass(frozen=True, kw_only=True)
class Yaw:
    """Pose of both pulleys.

    tail, head: actual yaw [rad]; roll_runup, roll_runoff: roll of the belt at the ends of each span [rad]; aside_runup,
    aside_runoff: sideways displacement of the pulley's surface there [m], from which y of the march counts;
    skew_runup, skew_runoff: direction of the surface where the belt lies beyond its pulley's yaw, along the travel
    [rad]. Shape (2,): span that runs up the tail pulley, span that runs up the head pulley.
    """

    tail: jnp.ndarray
    head: jnp.ndarray
    roll_runup: jnp.ndarray = field(default_factory=TWO_ZEROS)
    roll_runoff: jnp.ndarray = field(default_factory=TWO_ZEROS)
    aside_runup: jnp.ndarray = field(default_factory=TWO_ZEROS)
    aside_runoff: jnp.ndarray = field(default_factory=TWO_ZEROS)
    skew_runup: jnp.ndarray = field(default_factory=TWO_ZEROS)
    skew_runoff: jnp.ndarray = field(default_factory=TWO_ZEROS)

    @property
    def runup(self):
        """Return theta_p at the run-ups (tail, head)."""
        return jnp.stack([self.tail, -self.head]) + self.skew_runup

    @property
    def runoff(self):
        """Return theta_p at the run-offs of the same spans (head, tail)."""
        return jnp.stack([self.head, -self.tail]) + self.skew_runoff


@pytree
@dataclass(frozen=True, kw_only=True)
class State:
    """State of the belt at one travel; shape (2,): span up the tail pulley, span up the head pulley.

    travel, since: travel [m] now and one step before (below 0 at the start); y, alpha: at the run-ups, on the pulleys'
    surfaces [m, rad]; y_runoff: where the belt leaves the tail, the head pulley [m]; kappa, kappa_runoff: curvature at
    the ends [1/m]; moment, moment_runoff: EI times the elastic part of kappa [N m]; side_force: dM/dx at the run-up,
    which shears the belt that lands there [N]; added: part of kappa that the ends do not cause [1/m]; stiffness: of the
    span, d kappa / d theta_u [1/m]; bending: its EI [N m2]; turned: yaw of tail and head pulley for which this holds
    [rad]; left: rotation of the belt on the pulley before each span [rad]; sag_angle: from the top of a pulley to where
    a span meets it [rad], 0 where spans do not sag; direction of travel (+1, -1).
    """

    travel: jnp.ndarray
    since: jnp.ndarray
    y: jnp.ndarray
    alpha: jnp.ndarray
    y_runoff: jnp.ndarray
    kappa: jnp.ndarray
    kappa_runoff: jnp.ndarray
    moment: jnp.ndarray
    moment_runoff: jnp.ndarray
    side_force: jnp.ndarray
    added: jnp.ndarray
    stiffness: jnp.ndarray
    bending: jnp.ndarray
    turned: jnp.ndarray
    left: jnp.ndarray
    sag_angle: jnp.ndarray
    direction: jnp.ndarray


def sag_angle(case: Case):
    """Return psi = q L/(2 F) [rad], the angle from the top of the pulley to where the sagging span meets it
    (physics sheet, section 6)."""
    return case.weight_per_length * case.rig.span_length / (2.0 * case.tension_force)


# Wrap law: a belt that sticks leaves a pulley where it landed, a wrapped arc later (physics sheet, section 2):
# y_o(s) = y_u(s - W), alpha_o(s) = alpha_u(s - W). The history is a ring of march steps, interpolated linearly.


@pytree
@dataclass(frozen=True, kw_only=True)
class RunOff:
    """State of the belt where it leaves the pulleys, (2,): y [m], alpha [rad], moment with which it landed [N m],
    turned: rotation on the pulley before it leaves [rad], which alpha includes; tail, head pulley."""

    y: jnp.ndarray
    alpha: jnp.ndarray
    moment: jnp.ndarray
    turned: jnp.ndarray = field(default_factory=TWO_ZEROS)


def angle_at(schedule: Schedule, travel, xp=jnp):
    """Return the yaw [rad] at a scalar ``travel`` [m]; a step includes its own travel; xp: numpy or its JAX twin."""
    ramp = xp.clip((travel - schedule.at) / xp.where(schedule.over > 0, schedule.over, 1.0), 0.0, 1.0)
    share = xp.where(schedule.over > 0, ramp, (travel >= schedule.at).astype(float))
    return xp.sum(schedule.change * share)


def mean_angle(schedule: Schedule, start, end):
    """Return the mean yaw [rad] between two travels [m], which keeps the march of second order at steps of the yaw."""
    over, areas = schedule.over, []  # integrals of every entry's share up to either travel
    safe = jnp.where(over > 0, over, 1.0)
    for travel in (start, end):
        beyond = jnp.maximum(travel - schedule.at, 0.0)
        ramp = jnp.where(beyond < over, beyond**2 / (2 * safe), beyond - over / 2)
        areas.append(jnp.where(over > 0, ramp, beyond))
    return jnp.sum(schedule.change * (areas[1] - areas[0])) / (end - start)


@pytree
@dataclass(frozen=True, kw_only=True)
class Reading:
    """Readings of one run: travel [m] (n,) of the encoder; sensor_travel [m] (n,): belt travel that the lateral sensors
    show then; time [s] (n,); y [m] (4, n) at points 1-4, tilt [rad] (2, n) at mid-span, upper and lower, as indicated.
    """

    travel: jnp.ndarray
    sensor_travel: jnp.ndarray
    time: jnp.ndarray
    y: jnp.ndarray
    tilt: jnp.ndarray
