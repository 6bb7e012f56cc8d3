"""One step of travel: pulleys, anchors, prediction, equilibrium, landing.

Inertia is left out: the belt of a 3D run goes at a 35th of its string speed, where it does not matter. So a step is a
length of travel, not of time. What a run filters over time is filtered over the travel made in that time.

The equilibrium: Newton iterations on the belt, the tail pulley, and pulleys that give way. The tail pulley is free on
its slide and its axis. An iteration is one factorisation of the block-tridiagonal stiffness of the whole loop, cut in
the middle of the head's wrap; rows of held stations are unit blocks, which part the spans.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp

from belt_sim.mujoco3d.belt import BatchShape, BeltArrays
from belt_sim.mujoco3d.block_tridiagonal import Level, factorise, solve_chain
from belt_sim.mujoco3d.chain import (
    ChainLayout,
    anchor_positions,
    chain_forces,
    chain_stiffness,
    cut_chain,
    divide_chain,
    pull_on_nodes,
    spans_blocks,
    station_weight,
)
from belt_sim.mujoco3d.loads import GuideForce, guide_forces, load_forces
from belt_sim.mujoco3d.options import COMPLIANCE_TIME, KINK_STATIONS, LAYER_TIME, SPAN_TIME
from belt_sim.mujoco3d.pulleys import depth_at_ends, pose_of, tail_derivatives, yaw_moments
from belt_sim.mujoco3d.rope import RopeKinks, hold_run_up_end, run_off_end, run_off_line, run_up_end
from belt_sim.mujoco3d.run_stages import Command
from belt_sim.mujoco3d.wrap import (
    HEAD,
    TAIL,
    PoseArrays,
    WrapArrays,
    land_stations,
    relax_layers,
    release_stations,
    roll_anchors,
    sink_wraps,
    update_tangents,
)
from belt_sim.pytrees import Numbers as Array
from belt_sim.quasi_static.friction import slide_wraps
from belt_sim.quasi_static.plan import TravelState


class FactorisedStiffness(NamedTuple):
    """A factorised equilibrium.

    levels: of the chain; entry, exit (6 m, 6 m): stiffness of the cells at the tail's ends; pulls (3 m, 2, n): forces
    on the free nodes by the tail pulley's slide and spin; moves (2, 3 m, 2): how its outermost stations move with them.
    """

    levels: list[Level]
    entry: Array
    exit: Array
    pulls: Array
    moves: Array


def factorise_equilibrium(
    shape: BatchShape,
    belt: BeltArrays,
    nodes: Array,
    taut: Array,
    places: ChainLayout,
    twist: Array,
    share: Array,
    moves: Array,
    press: GuideForce | None,
) -> FactorisedStiffness:
    """Of the chain at ``nodes`` [m], (m, 3, n), whose ``taut`` places are those of its last equilibrium.

    moves (2, 3 m, 2): how the tail's outermost stations move with its slide and its spin; press: of guides.
    """
    size = 3 * shape.lines
    cell, whole = chain_stiffness(shape, belt, nodes, taut, places, twist, share)
    entry, leave = cell[:, :, places.entry - 1], cell[:, :, places.exit]
    more = None
    if press is not None:
        more = jnp.zeros((shape.lines, 3, shape.stations)).at[:, 1].set(press.stiffness).reshape(size, -1)
    levels = factorise(*spans_blocks(shape, whole, places, more))
    pulls = jnp.zeros((size, 2, shape.stations))
    pulls = pulls.at[:, :, places.entry - 1].add(-entry[:size, size:] @ moves[0])
    pulls = pulls.at[:, :, places.exit + 1].add(-leave[size:, :size] @ moves[1])
    return FactorisedStiffness(levels, entry, leave, pulls, moves)


def newton_step(
    belt: BeltArrays, stiffness: FactorisedStiffness, on_nodes: Array, places: ChainLayout, lacking: Array
) -> tuple[Array, Array]:
    """Moves of the free nodes (3 m, n) [m] and of the tail pulley (2,) [m, rad] towards equilibrium.

    lacking (2,): force [N] and moment [N m] on the tail pulley, which are to become 0.
    """
    size, moves = on_nodes.shape[0], stiffness.moves
    wanted = jnp.where(places.free, on_nodes, 0.0)[:, None]
    found = solve_chain(stiffness.levels, jnp.concatenate([wanted, stiffness.pulls], axis=1))
    entry = stiffness.entry[size:, :size] @ found[..., places.entry - 1]
    leave = stiffness.exit[:size, size:] @ found[..., places.exit + 1]
    felt = -jnp.stack([entry, leave])  # by the tail's outermost stations: alone, with its slide, with its spin
    own = -jnp.stack([stiffness.entry[size:, size:] @ moves[0], stiffness.exit[:size, :size] @ moves[1]])
    lacking = lacking + jnp.einsum("eip,ei->p", moves, felt[..., 0])
    (a, b), (c, d) = jnp.einsum("eip,eiq->pq", moves, felt[..., 1:] + own)
    fixed = belt.length
    a, b, first = jnp.where(fixed > 0, 1.0, a), jnp.where(fixed > 0, 0.0, b), jnp.where(fixed > 0, 0.0, lacking[0])
    tail = -jnp.stack([d * first - b * lacking[1], a * lacking[1] - c * first]) / (a * d - b * c)
    return found[:, 0] + jnp.einsum("ipn,p->in", found[:, 1:], tail), tail


def compliance_step(belt: BeltArrays, before: Array, turned: Array, moment: Array, moved: Array) -> Array:
    """Yaw by compliance [rad], (2,), after a step of ``moved`` [m] which began with ``before``.

    moment [N m]: on pulleys that have given way by ``turned`` so far. Implicit: with what both spans take from it when
    a pulley turns, taken rather too large.
    """
    compliance = belt.surfaces.yaw_compliance
    slowly = jnp.where(moved > 0.0, belt.run_speed * COMPLIANCE_TIME / jnp.where(moved > 0.0, moved, 1.0), 0.0)
    lacking = compliance * moment - turned - slowly * (turned - before)
    return turned + lacking / (1.0 + slowly + compliance * belt.holding)


#: After the first a node is where it should be to a tenth of a mm at most; but the entry moment of a slack belt hangs
#: on parts of a nm between its edges, which links that turn by that much have not kept.
ITERATIONS = 2
_YIELDING = 2  # more of them, in which pulleys that give way come to rest with the belt


class Equilibrium(NamedTuple):
    """nodes [m], (m, 3, n), of the chain; tail (2,): x [m] and spin [rad] of the tail pulley; tension [N]: mean of the
    spans; correction [m]: by how much the last iteration moved a node at most; turned [rad], (2,): yaw by which the
    pulleys give way, or None."""

    nodes: Array
    tail: Array
    tension: Array
    correction: Array
    compliance_yaw: Array | None


def find_equilibrium(
    shape: BatchShape,
    belt: BeltArrays,
    wraps: WrapArrays,
    nodes: Array,
    tail: Array,
    places: ChainLayout,
    state: TravelState,
    command: Command,
    aside: Array | float,
) -> Equilibrium:
    """From where the step has led the chain, ``nodes`` [m], (m, 3, n), and the tail pulley.

    aside [m]: by how much held stations stand aside of their anchors.
    """
    taut, moved = state.nodes[..., places.stations], command.travel - state.travel

    def iteration(found: Equilibrium, more: Array) -> tuple[Equilibrium, None]:
        turned, pose = found.compliance_yaw, pose_of(shape, belt, command, found.tail, found.compliance_yaw)
        nodes, tail, tension, correction = _newton_iteration(
            shape, belt, wraps, found.nodes, taut, found.tail, pose, places, state, command
        )
        if turned is not None:
            there = jnp.zeros_like(nodes).at[..., places.stations].set(nodes)
            moment = yaw_moments(shape, wraps, pose, there, pull_on_nodes(shape, belt, there, command.share))
            turned = jnp.where(more, compliance_step(belt, state.compliance_yaw, turned, moment, moved), turned)
        anchors = (
            anchor_positions(belt, wraps, pose_of(shape, belt, command, tail, turned), state.layer, places) + aside
        )
        return Equilibrium(jnp.where(places.free, nodes, anchors), tail, tension, correction, turned), None

    begin = Equilibrium(nodes, tail, state.tension, state.correction, state.compliance_yaw)
    count = ITERATIONS if state.compliance_yaw is None else ITERATIONS + _YIELDING
    return jax.lax.scan(iteration, begin, jnp.arange(count) < count - 1)[0]


def _newton_iteration(
    shape: BatchShape,
    belt: BeltArrays,
    wraps: WrapArrays,
    nodes: Array,
    taut: Array,
    tail: Array,
    pose: PoseArrays,
    places: ChainLayout,
    state: TravelState,
    command: Command,
) -> tuple[Array, Array, Array, Array]:
    """One Newton iteration: the free nodes, slide and spin of the tail pulley, tension of the spans, and how far a node
    moved at most. ``taut`` [m]: the chain in its last equilibrium."""
    behind = depth_at_ends(wraps, belt, pose)
    twist = belt.twist.of_cells(belt.chord, places.ends, behind, state.tension, shape.stations)
    press = None
    if belt.guides is not None:
        shares = belt.stiffness / belt.stiffness.sum()
        press = guide_forces(belt.guides, belt.chord, shares, nodes, places.free)
    moves = tail_derivatives(shape, wraps, pose)
    stiffness = factorise_equilibrium(shape, belt, nodes, taut, places, twist, command.share, moves, press)
    on_nodes, at_ends = chain_forces(shape, belt, nodes, places, twist, command.share)
    on_nodes = on_nodes + station_weight(shape, belt)
    if press is not None:
        on_nodes = on_nodes.at[1::3].add(press.force)
    if belt.loads is not None:
        more = load_forces(belt.loads, belt.chord, belt.stiffness, belt.line_y, belt.mass, nodes)
        on_nodes = on_nodes + command.share * more.reshape(on_nodes.shape)
    on_tail = jnp.einsum("eip,ei->p", moves, at_ends[TAIL])
    arms = jnp.where(places.on_tail, nodes[:, 0] - tail[0], 0.0).sum(axis=1)
    lacking = on_tail + jnp.stack([belt.load, belt.gravity * (belt.mass @ arms)])
    change, tail_change = newton_step(belt, stiffness, on_nodes, places, lacking)
    return nodes + change.reshape(nodes.shape), tail + tail_change, -0.5 * on_tail[0], jnp.abs(change).max()


def predict(shape: BatchShape, line_y: Array, nodes: Array, held: Array, places: ChainLayout, chords: Array) -> Array:
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


def step(shape: BatchShape, belt: BeltArrays, state: TravelState, command: Command) -> TravelState:
    """The state after a step."""
    moved = command.travel - state.travel
    shaped = jnp.where(state.travel >= 0.0, 1.0, 0.0)
    spin = state.pose.spin[TAIL] + shape.sign * moved / belt.surfaces.radius[TAIL]
    tail = jnp.stack([state.pose.centre[TAIL, 0], spin])
    pose, wraps, kinks = pose_of(shape, belt, command, tail, state.compliance_yaw), state.wraps, state.kinks
    if shape.canted:
        stands = (moved == 0.0) & (state.travel >= 0.0)
        rolled = jnp.where(stands, pose.axes[:, 2, 1] - state.pose.axes[:, 2, 1], 0.0)
        wraps = jax.vmap(roll_anchors)(belt.surfaces, wraps, pose, rolled)
    if kinks is not None:
        wraps, kinks = jax.vmap(partial(hold_run_up_end, sign=shape.sign))(wraps, belt.surfaces, pose, kinks)
    wraps = sink_wraps(shape, belt, wraps, pose, moved, shaped)
    places = cut_chain(shape, wraps)
    taut = state.nodes[..., places.stations]
    anchors = anchor_positions(belt, wraps, pose, state.layer, places)
    nodes = predict(shape, belt.line_y, taut, jnp.where(places.free, taut, anchors), places, moved / belt.chord)
    wraps = release_stations(belt, wraps, pose)
    places = divide_chain(shape, wraps, places.stations)
    if state.layer is not None:
        anchors = anchor_positions(belt, wraps, pose, state.layer, places)
    chords, aside = moved / belt.chord, 0.0
    if kinks is not None:
        aside = end_offsets(shape, wraps, pose, places, taut, chords, kinks, belt.chord)
    nodes = jnp.where(places.free, nodes, anchors + aside)
    found = find_equilibrium(shape, belt, wraps, nodes, tail, places, state, command, aside)
    nodes = jnp.zeros_like(nodes).at[..., places.stations].set(found.nodes)
    pose, slip = pose_of(shape, belt, command, found.tail, found.compliance_yaw), state.slip
    if slip is not None:
        pull = pull_on_nodes(shape, belt, nodes, command.share)
        wraps, slip = slide_wraps(shape, belt, wraps, pose, pull, slip, shaped)
    wraps, layer = _land_step(shape, belt, wraps, pose, nodes, state, command)
    after = found.tension, command.travel, found.correction, slip, kinks, found.compliance_yaw, layer
    return TravelState(nodes, wraps, pose, *after)


def _land_step(
    shape: BatchShape,
    belt: BeltArrays,
    wraps: WrapArrays,
    pose: PoseArrays,
    nodes: Array,
    state: TravelState,
    command: Command,
) -> tuple[WrapArrays, Array | None]:
    """The wraps after the step, with the stations that they have caught, and the bending layer beside them."""
    moved, layer = command.travel - state.travel, state.layer

    def filter_share(time: float) -> Array:
        return jnp.where(moved > 0.0, jnp.minimum(moved / (belt.run_speed * time), 1.0), 1.0)

    shaped = jnp.where(state.travel >= 0.0, 1.0, 0.0)
    wraps = jax.vmap(lambda w, p: update_tangents(w, p, nodes, filter_share(SPAN_TIME)))(wraps, pose)
    wraps = land_stations(belt, wraps, (state.pose, state.nodes), (pose, nodes), layer, moved, shaped)
    if layer is None:
        return wraps, None
    return wraps, relax_layers(belt, layer, wraps, pose, nodes, command.share, filter_share(LAYER_TIME))


def end_offsets(
    shape: BatchShape,
    wraps: WrapArrays,
    poses: PoseArrays,
    places: ChainLayout,
    taut: Array,
    moved: Array,
    kinks: RopeKinks,
    chord: Array,
) -> Array:
    """By how much held stations of the chain of a limp belt stand aside of their anchors [m], shape (m, 3, n).

    taut [m], (m, 3, n): the chain in its last equilibrium; moved [1]: chords that it has been led on since.
    """
    sign, found = shape.sign, jnp.zeros_like(taut)
    for pulley in (HEAD, TAIL):
        wrap, pose, kink = (jax.tree.map(lambda v, p=pulley: v[p], tree) for tree in (wraps, poses, kinks))
        last, first = places.ends[pulley, run_off_end(sign)], places.ends[pulley, run_up_end(sign)]
        free, next_free, far = (taut[..., last + i * sign] for i in (1, 2, KINK_STATIONS))
        move, _ = run_off_line(wrap, pose, sign, free + moved * (next_free - free), far, chord)
        found = found.at[..., last].add(move[:, None] * pose.axes[:, 1])
        found = found.at[..., first].add(-kink.offset * pose.axes[:, 1])
    return found
