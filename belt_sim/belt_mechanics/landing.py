"""Stations that come to lie on the pulleys in a step, by either end of either wrap."""

import jax

from belt_sim.belt_mechanics.belt import Belt, Shape, Surfaces
from belt_sim.belt_mechanics.layer import threaded
from belt_sim.belt_mechanics.wrap import FIRST, LAST, Pose, Wrap, landed, seen
from belt_sim.pytree import Numbers as Array


def caught(
    shape: Shape,
    belt: Belt,
    wraps: Wrap,
    before: tuple[Pose, Array],
    after: tuple[Pose, Array],
    layer: Array | None,
    moved: Array,
    shaped: Array,
) -> Wrap:
    """The wraps of both pulleys with the stations that they have caught in a step of ``moved`` [m].

    before, after: poses and nodes [m], (m, 3, n), at both ends of the step; layer: as in layer.py, or None; shaped: 1
    where the pulleys are what they are, 0 while they are plain cylinders.
    """
    for end in (FIRST, LAST):

        def lands(w: Wrap, s: Surfaces, p: Pose, old: Pose, layer: Array | None, end: int = end) -> Wrap:
            one, other = (
                seen(shape, w, s, at, threaded(belt, w, s, at, layer, nodes, end), end)
                for at, nodes in ((old, before[1]), (p, after[1]))
            )
            return landed(shape, w, s, p, one, other, end, belt.chord, moved, shaped)

        wraps = jax.vmap(lands)(wraps, belt.surfaces, after[0], before[0], layer)
    return wraps
