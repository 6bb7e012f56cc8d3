"""Edge guides as arrays: mujoco3d/loads/guides.py without branches."""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from belt_sim.pytree import Numbers as Array
from belt_sim.scene_parts import EdgeGuide


class Guides(NamedTuple):
    """Rollers, every field of shape (g,): height, +1 beside the upper span, -1 beside the lower; the others as in
    belt_sim.scene_parts.EdgeGuide. One that pushes nothing has the stiffness 0."""

    height: Array
    x: Array
    gap: Array
    side: Array
    stiffness: Array

    @staticmethod
    def of(guides: Sequence[EdgeGuide], count: int) -> "Guides":
        """So many, of which these are the first."""
        rows = [(1.0 if g.span == "upper" else -1.0, g.x, g.gap, g.side, g.stiffness) for g in guides]
        return Guides(*np.array(rows + [(1.0, 0.0, 0.0, 1.0, 0.0)] * (count - len(rows))).T)


class Press(NamedTuple):
    """On the nodes of a chain: force [N] and stiffness [N/m] along y, both (m, n)."""

    force: Array
    stiffness: Array


def pressed(guides: Guides, chord: Array, shares: Array, nodes: Array, free: Array) -> Press:
    """What the rollers do to free stations within one chord of them.

    shares (m,): of the lines; nodes [m], (m, 3, n); free (n,): which stations are.
    """
    x, y, z = nodes.mean(axis=0)
    near = jnp.clip(1.0 - jnp.abs(x - guides.x[:, None]) / chord, 0.0, 1.0)
    near = jnp.where(free & (z * guides.height[:, None] > 0.0), near, 0.0)
    beyond = guides.side[:, None] * y - guides.gap[:, None]
    stiff = guides.stiffness[:, None] * near * (beyond > 0.0)
    push = -(stiff * guides.side[:, None] * beyond).sum(axis=0)
    return Press(shares[:, None] * push, shares[:, None] * stiff.sum(axis=0))
