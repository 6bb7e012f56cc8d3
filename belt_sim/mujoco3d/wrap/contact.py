"""The belt on both pulleys during a run: landing, holding, slipping, letting go.

The forces between belt and pulleys are those that balance the belt's pull where it is (loads/pull.py), not those of the
springs: the springs also make up for what the integrator's tangent misses of links that turn within a step.
"""

import math

import numpy as np

from belt_sim.errors import RunFailed
from belt_sim.mujoco3d.constants import SPAN_STATIONS, SPAN_TIME
from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.mesh.loop import Loop
from belt_sim.mujoco3d.state import HEAD, TAIL, Pose, State, Wrap
from belt_sim.mujoco3d.wrap.friction import let_slip
from belt_sim.mujoco3d.wrap.layer import thread_places
from belt_sim.mujoco3d.wrap.tangent import Tangent
from belt_sim.mujoco3d.wrap.touchdown import FIRST, LAST, anchor, catches, land, lets_go, sink, tangent_angle
from belt_sim.scene_parts import PulleySurface, SceneParts

_NEITHER = -1
_FEWEST = 3  # links on a pulley


def laid_wraps(
    mesh: Mesh, loop: Loop, slides: np.ndarray, poses: tuple[Pose, Pose], radii: tuple[float, float]
) -> tuple[Wrap, Wrap]:
    """The stations that were laid on the pulleys, of radii [m], anchored there; they are plain cylinders so far."""
    wraps = []
    for radius, circle, laid, pose in (
        (radii[HEAD], loop.radius_head, loop.on_head, poses[HEAD]),
        (radii[TAIL], loop.radius_tail, loop.on_tail, poses[TAIL]),
    ):
        wrap = Wrap.empty(PulleySurface(radius=radius), circle - radius, mesh.stations, mesh.across, pose.spin)
        on = np.flatnonzero(laid)
        jump = np.flatnonzero(np.diff(on) > 1)
        wrap.first = int(on[jump[0] + 1]) - mesh.stations if len(jump) else int(on[0])
        wrap.last = int(on[jump[0]]) if len(jump) else int(on[-1])
        wrap.renumber()
        for k in wrap.stations:
            anchor(wrap, pose, k, mesh.at(slides, k))
        _meet(mesh, slides, wrap, pose, 1.0)
        for end in (FIRST, LAST):
            _change_end(mesh, slides, wrap, pose, end)
        wraps.append(wrap)
    return wraps[HEAD], wraps[TAIL]


def shape_pulleys(state: State, parts: SceneParts) -> None:
    """From now on stations land on the pulleys as they are."""
    for wrap, surface in zip(state.wraps, (parts.head, parts.tail), strict=True):
        wrap.surface = surface


def follow(state: State, chord: float) -> None:
    """Before a step: the anchors run along the path that the pulleys, where they will be at its end, give them."""
    for wrap, pose in zip(state.wraps, state.poses, strict=True):
        moved = abs(pose.spin - wrap.followed) * wrap.surface.radius
        wrap.followed = pose.spin
        for end in (FIRST, LAST):
            sink(wrap, pose, end, chord, moved)


def settle(mesh: Mesh, state: State, pull: np.ndarray, dt: float, friction: float, tangent: Tangent | None) -> None:
    """After a step, with held nodes on their anchors: let them slip, land and go.

    pull [N], shape (n, m, 3): of belt and weight on the nodes; dt [s]; friction [1], inf = sticking; tangent: None for
    a belt that never slips.

    When both belts slide as a whole they take turns, since each reckons with the other standing still.
    """
    if math.isinf(friction):
        tangent = None
    if tangent is not None:
        sliding = all(wrap.sliding.mean() > 0.5 for wrap in state.wraps)
        state.waits = _NEITHER if not sliding else TAIL if state.waits == HEAD else HEAD
    for which, (wrap, pose) in enumerate(zip(state.wraps, state.poses, strict=True)):
        if tangent is not None and state.waits != which:
            holding = -wrap.components(pose, pull[wrap.stations])
            holding[..., 0] -= mesh.mass * state.speed**2 / wrap.surface.radius
            state.slip[which] += let_slip(wrap, holding, friction, tangent)
        _meet(mesh, state.slides, wrap, pose, dt / SPAN_TIME)
        for end in (FIRST, LAST):
            _change_end(mesh, state.slides, wrap, pose, end)


def _meet(mesh: Mesh, slides: np.ndarray, wrap: Wrap, pose: Pose, share: float) -> None:
    """Move the places where the belt meets a pulley by ``share`` of the way to where the spans' directions say."""
    n = mesh.stations
    for i, (inner, outer) in enumerate(
        ((wrap.first - 1, wrap.first - SPAN_STATIONS), (wrap.last + 1, wrap.last + SPAN_STATIONS))
    ):
        along = (mesh.at(slides, outer % n) - mesh.at(slides, inner % n)).sum(axis=0) * (-1.0 if i == 0 else 1.0)
        ahead = tangent_angle(pose, along) - wrap.tangent[i]
        wrap.tangent[i] += share * math.remainder(ahead, 2.0 * math.pi)


def _change_end(mesh: Mesh, slides: np.ndarray, wrap: Wrap, pose: Pose, end: int) -> None:
    """Land a station or let one go."""
    outer = wrap.first if end == FIRST else wrap.last
    nodes, beside = thread_places(wrap, pose, end, mesh, slides)
    if catches(wrap, pose, end, nodes, mesh.chord):
        land(wrap, pose, end, nodes, beside, mesh.chord)
    elif lets_go(wrap, pose, end, mesh.chord):
        wrap.slip_increment[outer % mesh.stations] = 0.0
        if wrap.last - wrap.first < _FEWEST:
            raise RunFailed("the belt leaves a pulley: tension too low for its weight; raise settings.tension")
        wrap.first, wrap.last = (wrap.first + 1, wrap.last) if end == FIRST else (wrap.first, wrap.last - 1)
        wrap.renumber()
