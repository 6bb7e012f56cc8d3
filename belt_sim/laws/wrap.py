"""Wrap law: a belt that sticks leaves a pulley where it landed, a wrapped arc later (physics sheet, section 2).

y_o(s) = y_u(s - W), alpha_o(s) = alpha_u(s - W); before the start the belt lies straight.
The history is a ring of march steps; between two steps it is interpolated linearly, which is of second order.
"""

from dataclasses import dataclass

import jax.numpy as jnp

from belt_sim.pytree import pytree


@pytree
@dataclass(frozen=True, kw_only=True)
class RunOff:
    """State of the belt where it leaves the pulleys; shape (2,): tail, head pulley.

    y [m]; alpha [rad]; moment with which it landed [N m]; turned: rotation on the pulley before it leaves [rad], which
    alpha includes.
    """

    y: jnp.ndarray
    alpha: jnp.ndarray
    moment: jnp.ndarray
    turned: jnp.ndarray

    @staticmethod
    def stuck(y, alpha, moment) -> "RunOff":
        """Return a belt that leaves as it landed."""
        return RunOff(y=y, alpha=alpha, moment=moment, turned=jnp.zeros(2))


def delayed(ring, step, arcs, spacing):
    """Return the values that ran up one wrapped arc ago.

    ring: (slots, 6), columns y, alpha, moment of the tail, then of the head, row k holding march step k modulo slots;
    step: number of the step asked for; arcs: wrapped arcs (2,) [m], tail and head; spacing [m] of the march.
    """
    slots = ring.shape[0]
    values = []
    for pulley in (0, 1):
        back = arcs[pulley] / spacing
        whole = jnp.floor(back).astype(int)
        part = back - whole
        near, far = ring[(step - whole) % slots], ring[(step - whole - 1) % slots]
        values.append(((1 - part) * near + part * far)[3 * pulley : 3 * pulley + 3])
    both = jnp.stack(values)
    return RunOff.stuck(both[:, 0], both[:, 1], both[:, 2])
