"""The bending layer, in which the belt takes on the curvature of a pulley: where the lines of nodes come and go.

A fibre under the stress sigma straightens over l = sqrt(D/(sigma h)), D its plate stiffness. So its straight part
passes l^2/2R outside the circle, and has l^3/12R^2 less belt between it and the pulley than a thread would have; where
it comes at a steeper angle than the others, by psi, it is drawn in by (l^2/2R) psi less. Stations 25 mm apart do not
resolve a layer of 7-16 mm. It is a condition, therefore: each line of nodes comes and goes displaced by these two
lengths, counted from their mean over the width, with sigma and psi those of its own links beside the pulley in this
instant. How much the belt tilts there follows from the rest of the model. The anchors of a wrap are those without it.
"""

import jax
import numpy as np

from belt_sim.mujoco3d.arrays import library_of
from belt_sim.mujoco3d.belt import BeltArrays
from belt_sim.mujoco3d.elastic import strains
from belt_sim.mujoco3d.loop import fade
from belt_sim.mujoco3d.options import RUNUP_LINKS, SLACKEST_FIBRE
from belt_sim.mujoco3d.wrap import (
    FIRST,
    LAST,
    OUTWARDS,
    BeltOnPulley,
    cylinder_coordinates,
    depth,
    wrapped_angle,
)
from belt_sim.pytrees import Numbers as Array

_AHEAD = 2.0  # chords before the tangent point: what lies further is on the other side of the pulley


def layer_of_fibres(belt: BeltArrays, pulley: BeltOnPulley, share: Array | float, nodes: Array) -> Array:
    """Displacements (2, m, 2) [m] that the fibres beside a pulley lead to; share: of the layer and of the camber."""
    ends = [line_displacements(belt, pulley, share, nodes, end) for end in (FIRST, LAST)]
    return share * library_of(nodes).stack(ends)


def line_displacements(belt: BeltArrays, pulley: BeltOnPulley, share: Array | float, nodes: Array, end: int) -> Array:
    """How far the lines are outside the circle, and drawn into the pulley, beyond their mean [m], (m, 2).

    nodes [m], (m, 3, n); share: of the camber.
    """
    wrap, surface, pose, _ = pulley
    xp, fibres, radius = library_of(nodes), belt.fibres, surface.radius
    assert fibres is not None
    begin = wrap.first - 1 - RUNUP_LINKS if end == FIRST else wrap.last + 1
    k = (begin + np.arange(RUNUP_LINKS + 1)) % nodes.shape[-1]
    strain = strains(belt.ties, nodes, k, share) - fibres.residual
    stress = fibres.modulus * xp.maximum(strain, SLACKEST_FIBRE * xp.maximum(strain.mean(), 1e-12))
    local = (nodes[:, :, k[-1]] - nodes[:, :, k[0]]) @ pose.axes
    steeper = OUTWARDS[end] * wrapped_angle(xp.arctan2(-local[:, 2], local[:, 0]) - wrap.tangent[end])
    layer = xp.sqrt(fibres.plate / (stress * fibres.thickness))
    out = layer**2 / (2.0 * radius)
    drawn = layer**3 / (12.0 * radius**2) - out.mean() * (steeper - steeper.mean())
    both = xp.stack([out, drawn], axis=1)
    return fibres.tension_share * (both - both.mean(axis=0))


def station_displacement(belt: BeltArrays, pulley: BeltOnPulley, inside: Array, end: int) -> Array:
    """By how much the layer at ``end`` displaces stations ``inside`` [m] behind the tangent point, (k,): (m, 3, k) [m].

    Sections that are drawn in unequally turn, and with them the line that they stand on; wholly on the straight part
    of the path, less along the stations that sink onto the circle.
    """
    assert pulley.layer is not None
    line_y, chord, xp = belt.line_y, belt.chord, library_of(inside)
    outward, (out, drawn), at = OUTWARDS[end], pulley.layer[end].T, pulley.wrap.tangent[end]
    turned = (drawn @ line_y) / (line_y @ line_y)
    fading = xp.where(inside > -_AHEAD * chord, fade(inside, chord, pulley.surface.sink_chords), 0.0)
    ones = xp.ones_like(inside)
    x = out * xp.sin(at) - outward * drawn * xp.cos(at)
    z = out * xp.cos(at) + outward * drawn * xp.sin(at)
    aside = xp.broadcast_to(-turned * inside, (len(line_y), *inside.shape))
    local = xp.stack([x[:, None] * ones, aside, z[:, None] * ones], axis=1)
    return xp.einsum("mjk,ij->mik", fading * local, pulley.pose.axes)


def layer_displacements(belt: BeltArrays, pulley: BeltOnPulley, k: Array) -> Array:
    """By how much the layer displaces the anchors of stations k [m], (m, 3, k); those inside the wrap not at all."""
    angle = pulley.wrap.angle[:, k].mean(axis=0)
    first, last = (station_displacement(belt, pulley, depth(pulley, angle, end), end) for end in (FIRST, LAST))
    return first + last


def thread_places(belt: BeltArrays, pulley: BeltOnPulley, nodes: Array, end: int) -> Array:
    """Where the station next to ``end`` and the outermost held one would be without the layer [m], (m, 3, 2)."""
    k = (pulley.wrap.outer(end) + OUTWARDS[end] * np.array([1, 0])) % nodes.shape[-1]
    pair = nodes[:, :, k]
    if pulley.layer is None:
        return pair
    angle = cylinder_coordinates(pair, pulley.pose)[2].mean(axis=0)
    return pair - station_displacement(belt, pulley, depth(pulley, angle, end), end)


def relax_layers(belt: BeltArrays, pulleys: BeltOnPulley, nodes: Array, share: Array, rate: Array) -> BeltOnPulley:
    """With the layers, if any, moved by ``rate`` of the way to what the fibres beside the pulleys say."""
    if pulleys.layer is None:
        return pulleys
    wanted = jax.vmap(lambda pulley: layer_of_fibres(belt, pulley, share, nodes))(pulleys)
    return pulleys._replace(layer=pulleys.layer + rate * (wanted - pulleys.layer))
