"""Pulleys that give way to the belt's moment: what Pulleys does with yaw_compliance, over travel instead of time."""

import jax.numpy as jnp

from belt_sim.belt_mechanics.belt import Belt
from belt_sim.mujoco3d.constants import COMPLIANCE_TIME
from belt_sim.pytree import Numbers as Array


def given_way(belt: Belt, before: Array, turned: Array, moment: Array, moved: Array) -> Array:
    """Yaw by compliance [rad], (2,), after a step of ``moved`` [m] which began with ``before``.

    moment [N m]: on pulleys that have given way by ``turned`` so far. Implicit: with what both spans take from it when
    a pulley turns, taken rather too large.
    """
    compliance = belt.surfaces.yaw_compliance
    slowly = jnp.where(moved > 0.0, belt.pace * COMPLIANCE_TIME / jnp.where(moved > 0.0, moved, 1.0), 0.0)
    lacking = compliance * moment - turned - slowly * (turned - before)
    return turned + lacking / (1.0 + slowly + compliance * belt.holding)
