"""Forces on the nodes beside the belt's own: edge guides, loads at a place or all along."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from belt_sim.mujoco3d.arrays import library_of
from belt_sim.pytrees import Numbers as Array
from belt_sim.scene_parts import GuideRoller, SceneParts

if TYPE_CHECKING:
    from belt_sim.mujoco3d.belt import BeltArrays


class GuideArrays(NamedTuple):
    """Rollers, every field of shape (g,): height, +1 beside the upper span, -1 beside the lower; the others as in
    belt_sim.scene_parts.GuideRoller. One that pushes nothing has the stiffness 0."""

    height: Array
    x: Array
    gap: Array
    side: Array
    stiffness: Array

    @staticmethod
    def from_rollers(guides: Sequence[GuideRoller], count: int) -> "GuideArrays":
        """So many, of which these are the first."""
        rows = [(1.0 if g.span == "upper" else -1.0, g.x, g.gap, g.side, g.stiffness) for g in guides]
        return GuideArrays(*np.array(rows + [(1.0, 0.0, 0.0, 1.0, 0.0)] * (count - len(rows))).T)


def guide_forces(belt: "BeltArrays", nodes: Array, free: Array) -> tuple[Array, Array]:
    """Force [N] and stiffness [N/m] along y of the rollers on the nodes, both (m, n).

    They act on free stations within one chord of them, by a share that falls linearly with the distance, so that
    stations come and go without a jolt. nodes [m], (m, 3, n); free (n,): which stations are.
    """
    xp, guides, shares = library_of(nodes), belt.guides, belt.stiffness / belt.stiffness.sum()
    assert guides is not None
    x, y, z = nodes.mean(axis=0)
    near = xp.clip(1.0 - xp.abs(x - guides.x[:, None]) / belt.chord, 0.0, 1.0)
    near = xp.where(free & (z * guides.height[:, None] > 0.0), near, 0.0)
    beyond = guides.side[:, None] * y - guides.gap[:, None]
    stiff = guides.stiffness[:, None] * near * (beyond > 0.0)
    push = -(stiff * guides.side[:, None] * beyond).sum(axis=0)
    return shares[:, None] * push, shares[:, None] * stiff.sum(axis=0)


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
    def from_parts(parts: SceneParts, count: int) -> "LoadArrays":
        """Of a scene, with so many pushes, of which its own are the first."""
        rows = [(1.0 if p.span == "upper" else -1.0, p.x, p.along, p.across, p.couple) for p in parts.pushes]
        rows += [(1.0, 0.0, 0.0, 0.0, 0.0)] * (count - len(rows))
        height, x, along, across, couple = np.array(rows).reshape(count, 5).T
        return LoadArrays(height, x, along, across, couple, np.array(parts.lean * parts.gravity), np.array(parts.roll))


def load_forces(belt: "BeltArrays", nodes: Array) -> Array:
    """Forces [N], (m, 3, n), on ``nodes`` [m], (m, 3, n), a loop in the order of the belt.

    Stations within one chord of a place take its load, by a share that falls linearly with the distance. The lines take
    a push as they are stiff, a couple as forces along the belt that grow with y, a rolling couple as vertical forces on
    the outer two.
    """
    xp, loads, chord, line_y = library_of(nodes), belt.loads, belt.chord, belt.line_y
    assert loads is not None
    middle, line = nodes.mean(axis=0), belt.stiffness / belt.stiffness.sum()
    upper = middle[2] > 0.0
    near = xp.clip(1.0 - xp.abs(middle[0] - loads.x[:, None]) / chord, 0.0, 1.0)
    near = xp.where(upper == (loads.height[:, None] > 0.0), near, 0.0)
    whole = near.sum(axis=1, keepdims=True)
    near = near / xp.where(whole > 0.0, whole, 1.0)
    ahead = xp.roll(middle, -1, axis=1) - xp.roll(middle, 1, axis=1)
    ahead = ahead * xp.sign(ahead[0]) / xp.sqrt((ahead * ahead).sum(axis=0))
    across, along, couple = (v @ near for v in (loads.across, loads.along, loads.couple))
    arm = line * line_y / xp.maximum(line @ line_y**2, 1e-12)
    forces = (along * line[:, None] - couple * arm[:, None])[:, None] * ahead
    aside = across * line[:, None] + (loads.lean * belt.mass)[:, None]
    lift = xp.zeros_like(aside)
    if len(line_y) > 1:
        outer = np.zeros((len(line_y), 1))
        outer[[0, -1]] = [[1.0], [-1.0]]
        lift = outer * xp.where(upper, loads.roll * chord / (line_y[0] - line_y[-1]), 0.0)
    return forces + xp.stack([xp.zeros_like(aside), aside, lift], axis=1)
