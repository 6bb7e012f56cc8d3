"""Wrap law: a belt that sticks leaves a pulley where it landed, a wrapped arc later (physics sheet, section 2).

y_o(s) = y_u(s - W), alpha_o(s) = alpha_u(s - W); before the start the belt lies straight.
The history is a ring of march steps; between two steps it is interpolated by a cubic through the four around, since a
pulley that wobbles moves the belt by a wave of few steps; by straight lines where the belt begins to turn at the start.
"""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from belt_sim.pytree import pytree

_AROUND = np.arange(-1, 3)  # steps further back than the last whole one


@pytree
@dataclass(frozen=True, kw_only=True)
class RunOff:
    """Where the belt leaves the two pulleys: y [m], alpha [rad], shape (2,): tail pulley, head pulley."""

    y: jnp.ndarray
    alpha: jnp.ndarray


def delayed(ring, step, arcs, spacing):
    """Values that ran up one wrapped arc ago.

    ring: (slots, 4), columns y tail, alpha tail, y head, alpha head, row k holding march step k modulo slots;
    step: number of the step asked for; arcs: wrapped arcs (2,) [m], tail and head; spacing [m] of the march.
    """
    slots = ring.shape[0]
    values = []
    for pulley in (0, 1):
        back = arcs[pulley] / spacing
        whole = jnp.maximum(jnp.floor(back).astype(int), 2)  # the step that is being made is not there yet
        rows = ring[(step - whole - _AROUND) % slots, 2 * pulley : 2 * pulley + 2]
        values.append(jnp.where(step - whole > 1, _cubic(back - whole), _straight(back - whole)) @ rows)
    both = jnp.stack(values)
    return RunOff(y=both[:, 0], alpha=both[:, 1])


def _cubic(u):
    """Weights of the values at -1, 0, 1, 2 for that at u, shape (4,)."""
    return jnp.stack(
        [
            -u * (u - 1.0) * (u - 2.0) / 6.0,
            (u + 1.0) * (u - 1.0) * (u - 2.0) / 2.0,
            -u * (u + 1.0) * (u - 2.0) / 2.0,
            u * (u + 1.0) * (u - 1.0) / 6.0,
        ]
    )


def _straight(u):
    """The same of a straight line between the two beside, which belt that lay still before the start never overshoots."""
    u, none = jnp.maximum(u, 0.0), 0.0 * u
    return jnp.stack([none, 1.0 - u, u, none])
