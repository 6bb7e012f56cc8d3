"""One step of travel: pulleys, anchors, equilibrium, landing.

Inertia is left out: the belt of a 3D run goes at a 35th of its string speed, where it does not matter. So a step is a
length of travel, not of time. What a run filters over time is filtered over the travel made in that time.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from belt_sim.mjx.balance import Places, chain, corrected, factorise, forces, parted, torsion
from belt_sim.mjx.belt import Belt, Shape, Surfaces
from belt_sim.mjx.friction import Slip, pull_on_nodes, slipped
from belt_sim.mjx.guides import pressed
from belt_sim.mjx.layer import displaced, followed, threaded
from belt_sim.mjx.limp import Kinks, aside_of, led_on
from belt_sim.mjx.loads import forces_on
from belt_sim.mjx.wrap import (
    FIRST,
    HEAD,
    LAST,
    TAIL,
    Pose,
    Wrap,
    axes_of,
    depth,
    landed,
    met,
    released,
    seen,
    sunk,
    turning,
)
from belt_sim.mjx.yielding import given_way, moments
from belt_sim.pytree import Numbers as Array

_CALM = 0.02  # [s], as in wrap/contact.py


class State(NamedTuple):
    """nodes [m], (m, 3, n); wraps, pose: of head and tail; tension [N]: mean of the spans; travel [m]; correction [m]:
    by how much the step's Newton iteration moved a node at most; slip: None if it sticks; kinks: of a limp belt;
    turned [rad], (2,): yaw by which the pulleys give way, None if they do not; layer: as in mjx/layer.py, or None."""

    nodes: Array
    wraps: Wrap
    pose: Pose
    tension: Array
    travel: Array
    correction: Array
    slip: Slip | None = None
    kinks: Kinks | None = None
    turned: Array | None = None
    layer: Array | None = None


class Command(NamedTuple):
    """What the machine is told for a step: travel [m] at its end; yaw [rad], (2,): head, tail; share: of yaw offsets,
    cants and camber that acts."""

    travel: Array
    yaw: Array
    share: Array


def step(shape: Shape, belt: Belt, state: State, command: Command) -> State:
    """The state after a step."""
    moved = command.travel - state.travel
    shaped = jnp.where(command.travel >= 0.0, 1.0, 0.0)
    rolled = shape.sign * command.travel / belt.surfaces.radius
    yaw = command.yaw if state.turned is None else command.yaw + state.turned
    axes = jax.vmap(axes_of, in_axes=(0, 0, None, 0))(belt.surfaces, yaw, command.share, rolled)

    def poses(tail: Array) -> Pose:
        return Pose(jnp.zeros((2, 3)).at[TAIL, 0].set(tail[0]), axes, jnp.stack([rolled[HEAD], tail[1]]))

    spin = state.pose.spin[TAIL] + shape.sign * moved / belt.surfaces.radius[TAIL]
    tail = jnp.stack([state.pose.centre[TAIL, 0], spin])
    pose, wraps, kinks = poses(tail), state.wraps, state.kinks
    if kinks is not None:
        wraps, kinks = led_on(shape, wraps, belt.surfaces, pose, kinks)
    for end in (FIRST, LAST):
        wraps = jax.vmap(lambda w, s, p, end=end: sunk(shape, w, s, p, end, belt.chord, moved, shaped))(
            wraps, belt.surfaces, pose
        )
    places = chain(shape, wraps)
    taut = state.nodes[..., places.stations]
    anchors = _anchors(belt, wraps, pose, state.layer, places)
    nodes = _led(shape, belt.line_y, taut, jnp.where(places.free, taut, anchors), places, moved / belt.chord)
    for end in (FIRST, LAST):
        wraps = jax.vmap(lambda w, s, p, end=end: released(shape, w, s, p, end, belt.chord))(wraps, belt.surfaces, pose)
    places = parted(shape, wraps, places.stations)
    if state.layer is not None:
        anchors = _anchors(belt, wraps, pose, state.layer, places)
    aside = aside_of(shape, wraps, pose, places, taut, moved / belt.chord, kinks, belt.chord)
    nodes = jnp.where(places.free, nodes, anchors + aside)
    nodes, tail, tension, correction = _balanced(
        shape, belt, wraps, nodes, taut, tail, poses, places, state, command, aside
    )
    nodes, pose = jnp.zeros_like(nodes).at[..., places.stations].set(nodes), poses(tail)
    wraps, slip, turned = _yielded(shape, belt, wraps, pose, nodes, state, command)
    wraps, layer = _landed(shape, belt, wraps, pose, nodes, state, command)
    return State(nodes, wraps, pose, tension, command.travel, correction, slip, kinks, turned, layer)


def _landed(
    shape: Shape, belt: Belt, wraps: Wrap, pose: Pose, nodes: Array, state: State, command: Command
) -> tuple[Wrap, Array | None]:
    """The wraps after the step, with the stations that they have caught, and the bending layer beside them."""
    moved, layer = command.travel - state.travel, state.layer
    share = jnp.where(moved > 0.0, jnp.minimum(moved / (belt.pace * _CALM), 1.0), 1.0)
    shaped = jnp.where(command.travel >= 0.0, 1.0, 0.0)
    wraps = jax.vmap(lambda w, p: met(shape, w, p, nodes, share))(wraps, pose)
    for end in (FIRST, LAST):

        def lands(w: Wrap, s: Surfaces, p: Pose, old: Pose, layer: Array | None, end: int = end) -> Wrap:
            before, after = (
                seen(shape, w, s, at, threaded(belt, w, s, at, layer, places, end), end)
                for at, places in ((old, state.nodes), (p, nodes))
            )
            return landed(shape, w, s, p, before, after, end, belt.chord, moved, shaped)

        wraps = jax.vmap(lands)(wraps, belt.surfaces, pose, state.pose, layer)
    return wraps, layer if layer is None else followed(belt, layer, wraps, pose, nodes, command.share, moved)


def _yielded(
    shape: Shape, belt: Belt, wraps: Wrap, pose: Pose, nodes: Array, state: State, command: Command
) -> tuple[Wrap, Slip | None, Array | None]:
    """What gives way to the belt's pull in the new equilibrium: anchors that slide, pulleys that turn."""
    slip, turned = state.slip, state.turned
    if slip is None and turned is None:
        return wraps, None, None
    pull = pull_on_nodes(shape, belt, nodes, command.share)
    if turned is not None:
        moment = moments(shape, wraps, pose, nodes, pull)
        turned = given_way(belt, turned, moment, command.travel - state.travel)
    if slip is not None:
        shaped = jnp.where(command.travel >= 0.0, 1.0, 0.0)
        wraps, slip = slipped(shape, belt, wraps, pose, pull, slip, shaped)
    return wraps, slip, turned


def _balanced(
    shape: Shape,
    belt: Belt,
    wraps: Wrap,
    nodes: Array,
    taut: Array,
    tail: Array,
    poses: Callable[[Array], Pose],
    places: Places,
    state: State,
    command: Command,
    aside: Array | float,
) -> tuple[Array, Array, Array, Array]:
    """Nodes in equilibrium, slide and spin of the tail pulley, tension of the spans, and the largest correction.

    One Newton iteration: from where ``_led`` brings the belt it is exact to some 1e-9 m. A second one with the same
    factors would be none: the links' directions have changed, and the belt is stiff along them alone.
    """
    pose = poses(tail)
    twist = torsion(belt, _behind(shape, wraps, belt, pose), places, state.tension)
    press = None
    if belt.guides is not None:
        shares = belt.stiffness / belt.stiffness.sum()
        press = pressed(belt.guides, belt.chord, shares, nodes, places.free)
    moves = _moves(shape, wraps, pose)
    stiffness = factorise(shape, belt, nodes, taut, places, twist, command.share, moves, press)
    on_nodes, at_ends = forces(shape, belt, nodes, places, twist, command.share)
    if press is not None:
        on_nodes = on_nodes.at[1::3].add(press.force)
    if belt.loads is not None:
        more = forces_on(belt.loads, belt.chord, belt.stiffness, belt.line_y, belt.mass, nodes)
        on_nodes = on_nodes + command.share * more.reshape(on_nodes.shape)
    on_tail = jnp.einsum("eip,ei->p", moves, at_ends[TAIL])
    arms = jnp.where(places.on_tail, nodes[:, 0] - tail[0], 0.0).sum(axis=1)
    lacking = on_tail + jnp.stack([belt.load, belt.gravity * (belt.mass @ arms)])
    change, tail_change = corrected(belt, stiffness, on_nodes, places, lacking)
    tail = tail + tail_change
    anchors = _anchors(belt, wraps, poses(tail), state.layer, places) + aside
    nodes = jnp.where(places.free, nodes + change.reshape(nodes.shape), anchors)
    return nodes, tail, -0.5 * on_tail[0], jnp.abs(change).max()


def _behind(shape: Shape, wraps: Wrap, belt: Belt, pose: Pose) -> Array:
    """How far the outermost stations lie behind the tangent points [m], by pulley and end (2, 2)."""

    def one(wrap: Wrap, surface: Surfaces, pose: Pose) -> Array:
        ends = [k % shape.stations for k in (wrap.first, wrap.last)]
        middle = [0.5 * (wrap.angle[0, k] + wrap.angle[-1, k]) for k in ends]
        return jnp.stack([depth(wrap, surface, pose, a, end) for end, a in enumerate(middle)])

    return jax.vmap(one)(wraps, belt.surfaces, pose)


def _anchors(belt: Belt, wraps: Wrap, pose: Pose, layer: Array | None, places: Places) -> Array:
    """Where the chain's stations are held by the pulley that holds them [m], (m, 3, n); of free ones it says nothing.

    The same as wrap.placed, reckoned once a station and not for both pulleys: sines are what a step is slow at.
    """

    def of(values: Array) -> Array:
        return jnp.where(places.on_tail, values[TAIL], values[HEAD])

    r, y, angle = (of(v[..., places.stations]) for v in (wraps.r, wraps.y, wraps.angle))
    turned = angle + of(pose.spin[:, None])
    local, axes = (r * jnp.sin(turned), y, r * jnp.cos(turned)), of(pose.axes[..., None])
    turned_back = [sum(axes[i, j] * local[j] for j in range(3)) for i in range(3)]
    found = jnp.stack(turned_back, axis=1) + of(pose.centre[..., None])
    if layer is None:
        return found
    moved = jax.vmap(lambda *one: displaced(belt, *one))(wraps, belt.surfaces, pose, layer)
    return found + of(moved[..., places.stations])


def _led(shape: Shape, line_y: Array, nodes: Array, held: Array, places: Places, chords: Array) -> Array:
    """The chain led on by so many chords: free stations go along their links, held ones where the pulleys take them.

    What a span's ends are taken further than along their links is shared out along the span, linearly, and unless it
    is limp, as a beam bends when they turn in its plane: a link that took it all would be slack or twice as tight.
    """
    at, link = jnp.arange(nodes.shape[-1]), jnp.roll(nodes, -1, axis=-1) - nodes
    along = nodes + chords * (link if shape.sign > 0 else jnp.roll(link, 1, axis=-1) * -1.0)
    (before_head, after_head), (entry, leaves) = places.ends
    led = held
    for start, end in ((after_head, entry), (leaves, before_head)):
        first, last = (
            held[..., k] - nodes[..., k] - shape.sign * chords * link[..., j]
            for k, j in ((start, start), (end, end - 1))
        )
        s = (at - start) / (end - start)
        if shape.limp:
            moved = along + (1.0 - s) * first[..., None] + s * last[..., None]
            led = jnp.where((at > start) & (at < end), moved, led)
            continue
        length = (held[..., end] - held[..., start])[:, 0].mean()
        turns = [(v[-1, 0] - v[0, 0]) / (line_y[0] - line_y[-1]) for v in (first, last)]
        turn = turns[0] * (1.0 - 4.0 * s + 3.0 * s**2) + turns[1] * (3.0 * s**2 - 2.0 * s)
        aside = length * (turns[0] * (s - 2.0 * s**2 + s**3) + turns[1] * (s**3 - s**2))
        first, last = (v.at[:, 0].set(v[:, 0].mean()) for v in (first, last))
        moved = along + (1.0 - s) * first[..., None] + s * last[..., None]
        moved = moved.at[:, 1].add(aside).at[:, 0].add(-line_y[:, None] * turn)
        led = jnp.where((at > start) & (at < end), moved, led)
    return led


def _moves(shape: Shape, wraps: Wrap, pose: Pose) -> Array:
    """How the tail's outermost stations move with its slide and its spin, (2, 3 m, 2)."""
    wrap, at = (jax.tree.map(lambda v: v[TAIL], tree) for tree in (wraps, pose))
    along = jnp.tile(jnp.array([1.0, 0.0, 0.0]), shape.lines)
    ends = [turning(wrap, at, k % shape.stations).ravel() for k in (wrap.first, wrap.last)]
    return jnp.stack([jnp.stack([along, turned], axis=1) for turned in ends])
