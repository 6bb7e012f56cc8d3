"""One step of travel: pulleys, anchors, prediction, equilibrium, landing.

Inertia is left out: the belt of a 3D run goes at a 35th of its string speed, where it does not matter. So a step is a
length of travel, not of time. What a run filters over time is filtered over the travel made in that time.
"""

import jax
import jax.numpy as jnp

from belt_sim.belt_mechanics.belt import BatchShape, BeltArrays
from belt_sim.belt_mechanics.chain import ChainLayout, anchor_positions, cut_chain, divide_chain, pull_on_nodes
from belt_sim.belt_mechanics.pulleys import pose_of
from belt_sim.belt_mechanics.wrap import (
    FIRST,
    LAST,
    TAIL,
    PoseArrays,
    WrapArrays,
    land_stations,
    relax_layer,
    release_station,
    roll_anchors,
    sink_ends,
    update_tangents,
)
from belt_sim.mujoco3d.constants import LAYER_TIME, SPAN_TIME
from belt_sim.pytree import Numbers as Array
from belt_sim.quasi_static.equilibrium import find_equilibrium
from belt_sim.quasi_static.friction import slide_wraps
from belt_sim.quasi_static.plan import TravelCommand, TravelState
from belt_sim.quasi_static.rope import end_offsets, hold_run_up_ends


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


def step(shape: BatchShape, belt: BeltArrays, state: TravelState, command: TravelCommand) -> TravelState:
    """The state after a step."""
    moved = command.travel - state.travel
    shaped = jnp.where(state.travel >= 0.0, 1.0, 0.0)
    spin = state.pose.spin[TAIL] + shape.sign * moved / belt.surfaces.radius[TAIL]
    tail = jnp.stack([state.pose.centre[TAIL, 0], spin])
    pose, wraps, kinks = pose_of(shape, belt, *command, tail, state.compliance_yaw), state.wraps, state.kinks
    if shape.canted:
        stands = (moved == 0.0) & (state.travel >= 0.0)
        rolled = jnp.where(stands, pose.axes[:, 2, 1] - state.pose.axes[:, 2, 1], 0.0)
        wraps = jax.vmap(roll_anchors)(belt.surfaces, wraps, pose, rolled)
    if kinks is not None:
        wraps, kinks = hold_run_up_ends(shape, wraps, belt.surfaces, pose, kinks)
    for end in (FIRST, LAST):
        wraps = jax.vmap(lambda w, s, p, end=end: sink_ends(shape, w, s, p, end, belt.chord, moved, shaped))(
            wraps, belt.surfaces, pose
        )
    places = cut_chain(shape, wraps)
    taut = state.nodes[..., places.stations]
    anchors = anchor_positions(belt, wraps, pose, state.layer, places)
    nodes = predict(shape, belt.line_y, taut, jnp.where(places.free, taut, anchors), places, moved / belt.chord)
    for end in (FIRST, LAST):
        wraps = jax.vmap(lambda w, s, p, end=end: release_station(shape, w, s, p, end, belt.chord))(
            wraps, belt.surfaces, pose
        )
    places = divide_chain(shape, wraps, places.stations)
    if state.layer is not None:
        anchors = anchor_positions(belt, wraps, pose, state.layer, places)
    aside = end_offsets(shape, wraps, pose, places, taut, moved / belt.chord, kinks, belt.chord)
    nodes = jnp.where(places.free, nodes, anchors + aside)
    found = find_equilibrium(shape, belt, wraps, nodes, tail, places, state, command, aside)
    nodes = jnp.zeros_like(nodes).at[..., places.stations].set(found.nodes)
    pose, slip = pose_of(shape, belt, *command, found.tail, found.compliance_yaw), state.slip
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
    command: TravelCommand,
) -> tuple[WrapArrays, Array | None]:
    """The wraps after the step, with the stations that they have caught, and the bending layer beside them."""
    moved, layer = command.travel - state.travel, state.layer

    def over(time: float) -> Array:
        return jnp.where(moved > 0.0, jnp.minimum(moved / (belt.run_speed * time), 1.0), 1.0)

    shaped = jnp.where(state.travel >= 0.0, 1.0, 0.0)
    wraps = jax.vmap(lambda w, p: update_tangents(shape, w, p, nodes, over(SPAN_TIME)))(wraps, pose)
    wraps = land_stations(shape, belt, wraps, (state.pose, state.nodes), (pose, nodes), layer, moved, shaped)
    if layer is None:
        return wraps, None
    return wraps, relax_layer(belt, layer, wraps, pose, nodes, command.share, over(LAYER_TIME))
