"""Where a step takes the belt before its equilibrium is found: held stations with their pulleys, free ones on."""

import jax.numpy as jnp

from belt_sim.belt_mechanics.belt import Shape
from belt_sim.belt_mechanics.chain import Places
from belt_sim.pytree import Numbers as Array


def predict(shape: Shape, line_y: Array, nodes: Array, held: Array, places: Places, chords: Array) -> Array:
    """The chain led on by so many chords: free stations go along their links, held ones where the pulleys take them.

    What a span's ends are taken further than along their links is shared out along the span, linearly, and unless it
    is limp, as a beam bends when they turn in its plane: a link that took it all would be slack or twice as tight.
    """
    at, link = jnp.arange(nodes.shape[-1]), jnp.roll(nodes, -1, axis=-1) - nodes
    along = nodes + chords * (link if shape.sign > 0 else jnp.roll(link, 1, axis=-1) * -1.0)
    (before_head, after_head), (entry, leaves) = places.ends
    found = held
    for start, end in ((after_head, entry), (leaves, before_head)):
        first, last = (
            held[..., k] - nodes[..., k] - shape.sign * chords * link[..., j]
            for k, j in ((start, start), (end, end - 1))
        )
        s = (at - start) / (end - start)
        if shape.limp:
            moved = along + (1.0 - s) * first[..., None] + s * last[..., None]
            found = jnp.where((at > start) & (at < end), moved, found)
            continue
        length = (held[..., end] - held[..., start])[:, 0].mean()
        turns = [(v[-1, 0] - v[0, 0]) / (line_y[0] - line_y[-1]) for v in (first, last)]
        turn = turns[0] * (1.0 - 4.0 * s + 3.0 * s**2) + turns[1] * (3.0 * s**2 - 2.0 * s)
        aside = length * (turns[0] * (s - 2.0 * s**2 + s**3) + turns[1] * (s**3 - s**2))
        first, last = (v.at[:, 0].set(v[:, 0].mean()) for v in (first, last))
        moved = along + (1.0 - s) * first[..., None] + s * last[..., None]
        moved = moved.at[:, 1].add(aside).at[:, 0].add(-line_y[:, None] * turn)
        found = jnp.where((at > start) & (at < end), moved, found)
    return found
