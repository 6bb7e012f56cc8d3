"""Run-up law: how a belt that sticks climbs onto a pulley (physics sheet, section 2; paper eq. 13-15).

With alpha = theta - theta_p, the belt's angle against the pulley's surface direction where it runs up,

    dy/ds = -alpha + drift,    dalpha/ds = -(kappa + turn).

A yaw of the pulley turns the stuck belt with it: alpha does not jump. drift and turn belong to effects.
"""

from dataclasses import dataclass

import jax.numpy as jnp

from belt_sim.pytree import pytree


@pytree
@dataclass(frozen=True, kw_only=True)
class RunUp:
    """What effects add where the belt runs up: drift [rad], turn [1/m]; shape (2,): tail, head pulley."""

    drift: jnp.ndarray
    turn: jnp.ndarray


@pytree
@dataclass(frozen=True, kw_only=True)
class Contact:
    """How the belt lies where it runs up: y [m], alpha [rad], shape (2,): tail, head pulley."""

    y: jnp.ndarray
    alpha: jnp.ndarray


@pytree
@dataclass(frozen=True, kw_only=True)
class Yaw:
    """Yaw of the tail and the head pulley as it is [rad]; roll of the belt where each span runs up and off [rad], and
    how far aside the pulley's surface has gone there [m], from which y of the march counts; shape (2,): span that runs
    up the tail pulley, span that runs up the head pulley.
    """

    tail: jnp.ndarray
    head: jnp.ndarray
    roll_runup: jnp.ndarray
    roll_runoff: jnp.ndarray
    aside_runup: jnp.ndarray
    aside_runoff: jnp.ndarray

    @staticmethod
    def of(tail, head) -> "Yaw":
        """Pulleys that are yawed and no more."""
        none = jnp.zeros(2)
        return Yaw(tail=tail, head=head, roll_runup=none, roll_runoff=none, aside_runup=none, aside_runoff=none)

    @property
    def runup(self):
        """theta_p where the spans run up (tail, head)."""
        return jnp.stack([self.tail, -self.head])

    @property
    def runoff(self):
        """theta_p where the same two spans run off (head, tail)."""
        return jnp.stack([self.head, -self.tail])


@pytree
@dataclass(frozen=True, kw_only=True)
class State:
    """What the belt does at one travel; arrays of shape (2,): the span up the tail pulley, the span up the head.

    travel, since [m]: here, and at the instant before (below 0 at the start); y, alpha: on the pulleys' surfaces, at
    the run-ups [m, rad];
    kappa, kappa_runoff: curvature at either end [1/m];
    moment, moment_runoff [N m] = EI times the elastic part of kappa; added: the part of kappa that does not come from
    the span's ends [1/m]; stiffness: d kappa / d theta_u of the span [1/m]; bending: its EI
    [N m2]; turned: yaw of the tail and the head pulley [rad] at which all this holds; left: how far the belt has turned
    on the pulley before either span [rad];
    direction of travel (+1, -1).
    """

    travel: jnp.ndarray
    since: jnp.ndarray
    y: jnp.ndarray
    alpha: jnp.ndarray
    kappa: jnp.ndarray
    kappa_runoff: jnp.ndarray
    moment: jnp.ndarray
    moment_runoff: jnp.ndarray
    added: jnp.ndarray
    stiffness: jnp.ndarray
    bending: jnp.ndarray
    turned: jnp.ndarray
    left: jnp.ndarray
    direction: jnp.ndarray
