"""Edge guides, forces and couples on the spans as arrays: belt_sim.mujoco3d.loads without branches."""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from belt_sim.jax_setup import Numbers as Array
from belt_sim.scene_parts import GuideRoller, SceneParts


class GuideArrays(NamedTuple):
    """Rollers, every field of shape (g,): height, +1 beside the upper span, -1 beside the lower; the others as in
    belt_sim.scene_parts.EdgeGuide. One that pushes nothing has the stiffness 0."""

    height: Array
    x: Array
    gap: Array
    side: Array
    stiffness: Array

    @staticmethod
    def of(guides: Sequence[GuideRoller], count: int) -> "GuideArrays":
        """So many, of which these are the first."""
        rows = [(1.0 if g.span == "upper" else -1.0, g.x, g.gap, g.side, g.stiffness) for g in guides]
        return GuideArrays(*np.array(rows + [(1.0, 0.0, 0.0, 1.0, 0.0)] * (count - len(rows))).T)


class GuideForce(NamedTuple):
    """On the nodes of a chain: force [N] and stiffness [N/m] along y, both (m, n)."""

    force: Array
    stiffness: Array


def guide_forces(guides: GuideArrays, chord: Array, shares: Array, nodes: Array, free: Array) -> GuideForce:
    """What the rollers do to free stations within one chord of them.

    shares (m,): of the lines; nodes [m], (m, 3, n); free (n,): which stations are.
    """
    x, y, z = nodes.mean(axis=0)
    near = jnp.clip(1.0 - jnp.abs(x - guides.x[:, None]) / chord, 0.0, 1.0)
    near = jnp.where(free & (z * guides.height[:, None] > 0.0), near, 0.0)
    beyond = guides.side[:, None] * y - guides.gap[:, None]
    stiff = guides.stiffness[:, None] * near * (beyond > 0.0)
    push = -(stiff * guides.side[:, None] * beyond).sum(axis=0)
    return GuideForce(shares[:, None] * push, shares[:, None] * stiff.sum(axis=0))


class LoadArrays(NamedTuple):
    """At places of the spans, every field of shape (p,): height, +1 on the upper span, -1 on the lower; x [m], along,
    across [N], couple [N m] as in belt_sim.scene_parts.Push, 0 of one that does nothing. All along: lean [m/s2], pull
    of the weight towards +y; roll [N], couple per metre about +x on what is above the axes."""

    height: Array
    x: Array
    along: Array
    across: Array
    couple: Array
    lean: Array
    roll: Array

    @staticmethod
    def of(parts: SceneParts, count: int) -> "LoadArrays":
        """Of a scene, with so many pushes, of which its own are the first."""
        rows = [(1.0 if p.span == "upper" else -1.0, p.x, p.along, p.across, p.couple) for p in parts.pushes]
        rows += [(1.0, 0.0, 0.0, 0.0, 0.0)] * (count - len(rows))
        height, x, along, across, couple = np.array(rows).reshape(count, 5).T
        return LoadArrays(height, x, along, across, couple, np.array(parts.lean * parts.gravity), np.array(parts.roll))


def load_forces(loads: LoadArrays, chord: Array, stiffness: Array, line_y: Array, mass: Array, nodes: Array) -> Array:
    """Forces [N], (m, 3, n), on ``nodes`` [m], (m, 3, n), a loop in the order of the belt.

    stiffness [N], line_y [m], mass [kg], shape (m,): of the lines, which take a push as they are stiff, a couple as
    forces along the belt that grow with y, a rolling couple as vertical forces on the outer two.
    """
    middle, line = nodes.mean(axis=0), stiffness / stiffness.sum()
    upper = middle[2] > 0.0
    near = jnp.clip(1.0 - jnp.abs(middle[0] - loads.x[:, None]) / chord, 0.0, 1.0)
    near = jnp.where(upper == (loads.height[:, None] > 0.0), near, 0.0)
    whole = near.sum(axis=1, keepdims=True)
    near = near / jnp.where(whole > 0.0, whole, 1.0)
    ahead = jnp.roll(middle, -1, axis=1) - jnp.roll(middle, 1, axis=1)
    ahead = ahead * jnp.sign(ahead[0]) / jnp.sqrt((ahead * ahead).sum(axis=0))
    across, along, couple = (v @ near for v in (loads.across, loads.along, loads.couple))
    arm = line * line_y / jnp.maximum(line @ line_y**2, 1e-12)
    forces = (along * line[:, None] - couple * arm[:, None])[:, None] * ahead
    forces = forces.at[:, 1].add(across * line[:, None] + (loads.lean * mass)[:, None])
    if len(line_y) == 1:
        return forces
    lift = jnp.where(upper, loads.roll * chord / (line_y[0] - line_y[-1]), 0.0)
    return forces.at[0, 2].add(lift).at[-1, 2].add(-lift)
