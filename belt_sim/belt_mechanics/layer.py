"""The bending layer beside the pulleys as arrays: mujoco3d/wrap/layer.py without branches.

Every function here is of one pulley. layer [m], (2, m, 2): how far the lines are displaced outwards and into the
pulley, at ``first`` and at ``last``; the anchors of a wrap are those without it.
"""

import math

import jax
import jax.numpy as jnp

from belt_sim.belt_mechanics.belt import Belt, Surfaces
from belt_sim.belt_mechanics.elastic import strains
from belt_sim.belt_mechanics.wrap import FIRST, LAST, OUTWARDS, Pose, Wrap, cylinder_coordinates, depth
from belt_sim.mujoco3d.constants import RUNUP_LINKS, SLACKEST_FIBRE
from belt_sim.pytree import Numbers as Array

_AHEAD = 2.0  # chords before the tangent point: what lies further is on the other side of the pulley


def followed(belt: Belt, layers: Array, wraps: Wrap, pose: Pose, nodes: Array, share: Array, rate: Array) -> Array:
    """Displacements of both pulleys' ends (2, 2, m, 2) moved by ``rate`` of the way to what the fibres beside them say.

    nodes [m], (m, 3, n); share: of the layer and of the camber.
    """

    def one(wrap: Wrap, surface: Surfaces, pose: Pose) -> Array:
        return jnp.stack([displacements(belt, share, nodes, wrap, surface.radius, pose, end) for end in (FIRST, LAST)])

    wanted = share * jax.vmap(one)(wraps, belt.surfaces, pose)
    return layers + rate * (wanted - layers)


def displacements(belt: Belt, share: Array, nodes: Array, wrap: Wrap, radius: Array, pose: Pose, end: int) -> Array:
    """How far the lines are outside the circle, and drawn into the pulley, beyond their mean [m], (m, 2).

    nodes [m], (m, 3, n); share: of the camber; radius [m].
    """
    fibres, outward, n = belt.fibres, OUTWARDS[end], nodes.shape[-1]
    assert fibres is not None
    begin = wrap.first - 1 - RUNUP_LINKS if end == FIRST else wrap.last + 1
    k = (begin + jnp.arange(RUNUP_LINKS + 1)) % n
    strain = strains(belt.ties, nodes, k, share)
    stress = fibres.modulus * jnp.maximum(strain, SLACKEST_FIBRE * jnp.maximum(strain.mean(), 1e-12))
    local = (nodes[:, :, k[-1]] - nodes[:, :, k[0]]) @ pose.axes
    ahead = jnp.arctan2(-local[:, 2], local[:, 0]) - wrap.tangent[end]
    steeper = outward * (ahead - math.tau * jnp.rint(ahead / math.tau))
    layer = jnp.sqrt(fibres.plate / (stress * fibres.thickness))
    out = layer**2 / (2.0 * radius)
    drawn = layer**3 / (12.0 * radius**2) - out.mean() * (steeper - steeper.mean())
    both = jnp.stack([out, drawn], axis=1)
    return fibres.own * (both - both.mean(axis=0))


def displacement(belt: Belt, wrap: Wrap, surface: Surfaces, pose: Pose, layer: Array, inside: Array, end: int) -> Array:
    """By how much the layer at ``end`` displaces stations ``inside`` [m] behind the tangent point, (k,): (m, 3, k).

    Sections that are drawn in unequally turn, and with them the line that they stand on.
    """
    line_y, chord = belt.line_y, belt.chord
    outward, (out, drawn), at = OUTWARDS[end], layer[end].T, wrap.tangent[end]
    turned = (drawn @ line_y) / (line_y @ line_y)
    t = jnp.clip((inside / chord - 0.5) / surface.sinking, 0.0, 1.0)
    fading = jnp.where(inside > -_AHEAD * chord, (1.0 - t) ** 2 * (1.0 + 2.0 * t), 0.0)
    level = [out * jnp.sin(at) - outward * drawn * jnp.cos(at), out * jnp.cos(at) + outward * drawn * jnp.sin(at)]
    ones = jnp.ones_like(inside)
    aside = jnp.broadcast_to(-turned * inside, (len(line_y), *inside.shape))
    local = jnp.stack([level[0][:, None] * ones, aside, level[1][:, None] * ones], axis=1)
    return jnp.einsum("mjk,ij->mik", fading * local, pose.axes)


def displaced(belt: Belt, wrap: Wrap, surface: Surfaces, pose: Pose, layer: Array) -> Array:
    """By how much the layer displaces every station's anchors [m], (m, 3, n); those inside the wrap not at all."""
    angle = wrap.angle.mean(axis=0)
    ends = [
        displacement(belt, wrap, surface, pose, layer, depth(wrap, surface, pose, angle, end), end)
        for end in (FIRST, LAST)
    ]
    return ends[FIRST] + ends[LAST]


def threaded(
    belt: Belt, wrap: Wrap, surface: Surfaces, pose: Pose, layer: Array | None, nodes: Array, end: int
) -> Array:
    """Nodes [m], (m, 3, n), with the station next to ``end`` and the outermost held one where a thread would be."""
    if layer is None:
        return nodes
    k = ((wrap.first, wrap.last)[end] + OUTWARDS[end] * jnp.array([1, 0])) % nodes.shape[-1]
    angle = cylinder_coordinates(nodes[:, :, k], pose)[2].mean(axis=0)
    inside = depth(wrap, surface, pose, angle, end)
    moved = displacement(belt, wrap, surface, pose, layer, inside, end)
    return nodes.at[:, :, k].add(-moved)
