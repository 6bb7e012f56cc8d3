"""The equilibrium of a step: Newton iterations on the belt, the tail pulley, and pulleys that give way."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from belt_sim.belt_mechanics.belt import Belt, Shape
from belt_sim.belt_mechanics.chain import Places, anchored, forces, pull_on_nodes, torsion, weight
from belt_sim.belt_mechanics.guides import pressed
from belt_sim.belt_mechanics.loads import forces_on
from belt_sim.belt_mechanics.pulleys import behind, moments, moves_of, pose_of
from belt_sim.belt_mechanics.wrap import TAIL, Pose, Wrap
from belt_sim.pytree import Numbers as Array
from belt_sim.quasi_static.balance import corrected, factorise
from belt_sim.quasi_static.state import Command, State
from belt_sim.quasi_static.yielding import given_way

#: After the first a node is where it should be to a tenth of a mm at most; but the entry moment of a slack belt hangs
#: on parts of a nm between its edges, which links that turn by that much have not kept.
ITERATIONS = 2
_YIELDING = 2  # more of them, in which pulleys that give way come to rest with the belt


class Found(NamedTuple):
    """nodes [m], (m, 3, n), of the chain; tail (2,): x [m] and spin [rad] of the tail pulley; tension [N]: mean of the
    spans; correction [m]: by how much the last iteration moved a node at most; turned [rad], (2,): yaw by which the
    pulleys give way, or None."""

    nodes: Array
    tail: Array
    tension: Array
    correction: Array
    turned: Array | None


def balanced(
    shape: Shape,
    belt: Belt,
    wraps: Wrap,
    nodes: Array,
    tail: Array,
    places: Places,
    state: State,
    command: Command,
    aside: Array | float,
) -> Found:
    """From where the step has led the chain, ``nodes`` [m], (m, 3, n), and the tail pulley.

    aside [m]: by how much held stations stand aside of their anchors.
    """
    taut, moved = state.nodes[..., places.stations], command.travel - state.travel

    def iteration(found: Found, more: Array) -> tuple[Found, None]:
        turned, pose = found.turned, pose_of(shape, belt, *command, found.tail, found.turned)
        nodes, tail, tension, correction = _once(
            shape, belt, wraps, found.nodes, taut, found.tail, pose, places, state, command
        )
        if turned is not None:
            there = jnp.zeros_like(nodes).at[..., places.stations].set(nodes)
            moment = moments(shape, wraps, pose, there, pull_on_nodes(shape, belt, there, command.share))
            turned = jnp.where(more, given_way(belt, state.turned, turned, moment, moved), turned)
        anchors = anchored(belt, wraps, pose_of(shape, belt, *command, tail, turned), state.layer, places) + aside
        return Found(jnp.where(places.free, nodes, anchors), tail, tension, correction, turned), None

    begin = Found(nodes, tail, state.tension, state.correction, state.turned)
    count = ITERATIONS if state.turned is None else ITERATIONS + _YIELDING
    return jax.lax.scan(iteration, begin, jnp.arange(count) < count - 1)[0]


def _once(
    shape: Shape,
    belt: Belt,
    wraps: Wrap,
    nodes: Array,
    taut: Array,
    tail: Array,
    pose: Pose,
    places: Places,
    state: State,
    command: Command,
) -> tuple[Array, Array, Array, Array]:
    """One Newton iteration: the free nodes, slide and spin of the tail pulley, tension of the spans, and how far a node
    moved at most. ``taut`` [m]: the chain in its last equilibrium."""
    twist = torsion(belt, behind(shape, wraps, belt, pose), places, state.tension)
    press = None
    if belt.guides is not None:
        shares = belt.stiffness / belt.stiffness.sum()
        press = pressed(belt.guides, belt.chord, shares, nodes, places.free)
    moves = moves_of(shape, wraps, pose)
    stiffness = factorise(shape, belt, nodes, taut, places, twist, command.share, moves, press)
    on_nodes, at_ends = forces(shape, belt, nodes, places, twist, command.share)
    on_nodes = on_nodes + weight(shape, belt)
    if press is not None:
        on_nodes = on_nodes.at[1::3].add(press.force)
    if belt.loads is not None:
        more = forces_on(belt.loads, belt.chord, belt.stiffness, belt.line_y, belt.mass, nodes)
        on_nodes = on_nodes + command.share * more.reshape(on_nodes.shape)
    on_tail = jnp.einsum("eip,ei->p", moves, at_ends[TAIL])
    arms = jnp.where(places.on_tail, nodes[:, 0] - tail[0], 0.0).sum(axis=1)
    lacking = on_tail + jnp.stack([belt.load, belt.gravity * (belt.mass @ arms)])
    change, tail_change = corrected(belt, stiffness, on_nodes, places, lacking)
    return nodes + change.reshape(nodes.shape), tail + tail_change, -0.5 * on_tail[0], jnp.abs(change).max()
