"""Pulleys that give way to the belt's moment: what Pulleys does with yaw_compliance, over travel instead of time."""

import jax
import jax.numpy as jnp

from belt_sim.pytree import Numbers as Array
from belt_sim.quasi_static.belt import Belt, Shape
from belt_sim.quasi_static.wrap import Pose, Wrap

_LAG = 0.02  # [s], as in machine/pulleys.py


def moments(shape: Shape, wraps: Wrap, pose: Pose, nodes: Array, pull: Array) -> Array:
    """Moments about z [N m] that the belt does to head and tail, (2,); nodes [m], pull [N], (m, 3, n)."""

    def one(wrap: Wrap, pose: Pose) -> Array:
        count = (wrap.last - wrap.first) % shape.stations
        held = (jnp.arange(shape.stations) - wrap.first) % shape.stations <= count
        arms = nodes - pose.centre[:, None]
        return jnp.where(held, arms[:, 0] * pull[:, 1] - arms[:, 1] * pull[:, 0], 0.0).sum()

    return jax.vmap(one)(wraps, pose)


def given_way(belt: Belt, before: Array, turned: Array, moment: Array, moved: Array) -> Array:
    """Yaw by compliance [rad], (2,), after a step of ``moved`` [m] which began with ``before``.

    moment [N m]: on pulleys that have given way by ``turned`` so far. Implicit: with what both spans take from it when
    a pulley turns, taken rather too large.
    """
    compliance = belt.surfaces.yaw_compliance
    slowly = jnp.where(moved > 0.0, belt.pace * _LAG / jnp.where(moved > 0.0, moved, 1.0), 0.0)
    lacking = compliance * moment - turned - slowly * (turned - before)
    return turned + lacking / (1.0 + slowly + compliance * belt.holding)
