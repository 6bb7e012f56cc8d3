"""The belt on its pulleys in the engine in time: which stations lie there, and how they slide."""

import math

import numpy as np

from belt_sim.errors import SimulationError
from belt_sim.jax_setup import jit_float64
from belt_sim.mujoco3d.belt import BeltArrays
from belt_sim.mujoco3d.friction import slip_increments, wrap_chain
from belt_sim.mujoco3d.machine import SceneLayout
from belt_sim.mujoco3d.options import SPAN_TIME
from belt_sim.mujoco3d.state import RunState
from belt_sim.mujoco3d.wrap import (
    FIRST,
    HEAD,
    LAST,
    OUTWARDS,
    TAIL,
    BeltOnPulley,
    PoseArrays,
    WrapArrays,
    approach_of,
    cylinder_coordinates,
    is_released,
    land_station,
    radius_at,
    slide_anchors,
    surface_components,
    update_tangents,
)

_NEITHER = -1
_FEWEST = 3  # links on a pulley
_SIZES = 8  # stations of a wrap are filled up to a multiple of it, so that few sizes are compiled


def lay_wraps(scene: SceneLayout, belt: BeltArrays, poses: list[PoseArrays]) -> list[WrapArrays]:
    """The stations laid on the pulleys, anchored where their nodes are, at their mean height.

    The pulleys are plain cylinders so far.
    """
    mesh, wraps = scene.mesh, []
    nodes = np.moveaxis(mesh.laid, 0, -1)
    for laid, surface, pose in zip((scene.loop.on_head, scene.loop.on_tail), belt.each_surface, poses, strict=True):
        on = np.flatnonzero(laid)
        jump = np.flatnonzero(np.diff(on) > 1)
        first = int(on[jump[0] + 1]) - mesh.stations if len(jump) else int(on[0])
        last = int(on[jump[0]]) if len(jump) else int(on[-1])
        k = np.arange(first, last + 1) % mesh.stations
        r, y, angle = np.zeros((3, mesh.lines, mesh.stations))
        wrap = WrapArrays(first, last, r, y, angle, np.zeros(mesh.stations), np.zeros(2))
        r[:, k], y[:, k], angle[:, k] = cylinder_coordinates(nodes[:, :, k], pose)
        circle = radius_at(surface, 0.0, y[:, k])
        r[:, k] = circle + (r[:, k] - circle).mean(axis=0)
        wrap = update_tangents(wrap, pose, nodes, 1.0)
        for end in (FIRST, LAST):
            wrap = change_end(belt, BeltOnPulley(wrap, surface, pose), nodes, end, 0.0)
        wraps.append(wrap)
    return wraps


def change_end(belt: BeltArrays, pulley: BeltOnPulley, nodes: np.ndarray, end: int, shaped: float) -> WrapArrays:
    """The wrap after a station has landed at ``end``, or one has been let go, where they have come far enough."""
    approach, wrap = approach_of(belt, pulley, nodes, end), pulley.wrap
    if approach.is_caught(belt.chord):
        wrap = land_station(pulley, approach, approach, end, belt.chord, 0.0, shaped)
        return wrap._replace(first=int(wrap.first), last=int(wrap.last))
    if not is_released(pulley, end, belt.chord):
        return wrap
    if wrap.last - wrap.first < _FEWEST:
        raise SimulationError("the belt leaves a pulley: tension too low for its weight; raise settings.tension")
    return wrap.with_outer(end, wrap.outer(end) - OUTWARDS[end])


def update_contact(
    belt: BeltArrays, state: RunState, nodes: np.ndarray, pull: np.ndarray, dt: float, friction: float
) -> None:
    """After a step, with held nodes on their anchors: let them slip, land and go.

    nodes [m], pull [N], shape (m, 3, n): of belt and weight on the nodes; dt [s]; friction [1], inf = sticking.

    When both belts slide as a whole they take turns, since each reckons with the other standing still.

    The forces between belt and pulleys are those that balance the belt's pull where it is, not those of the springs:
    the springs also make up for what the integrator's tangent misses of links that turn within a step.
    """
    slips = math.isfinite(friction) and belt.sliding_stiffness is not None
    if slips:
        sliding = all(state.sliding_share(pulley) > 0.5 for pulley in (HEAD, TAIL))
        state.waiting_pulley = _NEITHER if not sliding else TAIL if state.waiting_pulley == HEAD else HEAD
    for which, (pose, surface) in enumerate(zip(state.poses, belt.each_surface, strict=True)):
        if slips and state.waiting_pulley != which:
            state.slip[which] += slide_wrap(belt, state, which, pull, friction)
        wrap = update_tangents(state.wraps[which], pose, nodes, dt / SPAN_TIME)
        layer = state.layers[which] if state.layers[which].any() else None
        for end in (FIRST, LAST):
            wrap = change_end(belt, BeltOnPulley(wrap, surface, pose, layer), nodes, end, state.shaped)
        state.wraps[which] = wrap


def slide_wrap(belt: BeltArrays, state: RunState, which: int, pull: np.ndarray, friction: float) -> float:
    """Move the anchors of nodes whose tangential force exceeds friction [1] x pressure; mean lateral slip [m].

    A return mapping on the holding forces of a wrap, as one system, without inertia. pull [N], (m, 3, n).
    """
    k, increments = state.held_stations(which), state.slip_increments[which]
    surface = belt.each_surface[which]
    pulley = BeltOnPulley(state.wraps[which], surface, state.poses[which])
    outwards, across, along = (-v for v in surface_components(pulley, k, pull[:, :, k]))
    limit = friction * np.maximum(outwards - belt.mass[:, None] * state.speed**2 / surface.radius, 0.0)
    state.slip_increments[which] = np.zeros_like(increments)
    if np.all(np.hypot(across, along) <= limit):
        return 0.0
    more = -len(k) % _SIZES
    force = np.pad(np.stack([across, along], axis=1), ((0, 0), (0, 0), (0, more)))  # of the pulley on the nodes
    guess = np.pad(increments[..., k], ((0, 0), (0, 0), (0, more)))
    limit = np.pad(limit, ((0, 0), (0, more)), constant_values=np.inf)
    chain = _wrap_chain(belt.sliding_stiffness, pulley.wrap.first % 2, len(k), len(k) + more)
    moved = np.asarray(_slip_increments(force, limit, chain, guess)[0])[..., : len(k)]
    state.slip_increments[which][..., k] = moved
    state.wraps[which] = slide_anchors(pulley, state.shaped, k, moved)
    return float(moved[:, 0].mean())


_wrap_chain = jit_float64(wrap_chain, static_argnums=3)
_slip_increments = jit_float64(slip_increments)
