"""The belt on a pulley: stations land, sink onto the circle, are held and leave, through a layer that is bent.

Landing. A polygon that rolls over a circle lifts and lowers its spans with every corner (chordal action,
chord^2 / 8 R), and the waves that this sends along a slack belt swing the entry moment in time with the landings. So a
station is caught half a chord before the place where the belt meets the pulley, runs straight on until half a chord
behind it, and sinks onto the circle along the next four (fewer on a pulley of few stations); it leaves the same way.
The free span then always ends on one straight line. (Sinking faster shakes the belt along its length: by 69 um within
one chord of 25 mm, 16 um within four, 9 um on a plain circle.)

Landing and sinking keep the lengths of the chords, edge by edge: what lies on the pulley is the strain that the belt
had at the run-up, so that the landed belt turns by the run-up curvature (dtheta/ds = -kappa).

Bending layer. A fibre under the stress sigma straightens over l = sqrt(D/(sigma h)), D its plate stiffness. So its
straight part passes l^2/2R outside the circle, and has l^3/12R^2 less belt between it and the pulley than a thread
would have; where it comes at a steeper angle than the others, by psi, it is drawn in by (l^2/2R) psi less. Stations
25 mm apart do not resolve a layer of 7-16 mm. It is a condition, therefore: each line of nodes comes and goes displaced
by these two lengths, counted from their mean over the width, with sigma and psi those of its own links beside the
pulley in this instant. How much the belt tilts there follows from the rest of the model.

The forces between belt and pulleys are those that balance the belt's pull where it is (loads.pull_on_nodes), not those
of the springs: the springs also make up for what the integrator's tangent misses of links that turn within a step.
"""

import math
from dataclasses import dataclass

import numpy as np

from belt_sim.case import Case
from belt_sim.errors import RunFailed
from belt_sim.mujoco3d.friction import WrapStiffness, slide_anchors
from belt_sim.mujoco3d.loop import LaidLoop, chord_angle, chord_angle_flat, fade, lift, sinking_chords
from belt_sim.mujoco3d.mesh import Mesh
from belt_sim.mujoco3d.options import (
    CATCH_DISTANCE,
    FORGETTING,
    HYSTERESIS,
    LAYER_TIME,
    RESIDUAL_TORSION,
    RUNUP_LINKS,
    SLACKEST_FIBRE,
    SPAN_STATIONS,
    SPAN_TIME,
)
from belt_sim.mujoco3d.state import HEAD, TAIL, Pose, RunState, Wrap, cylinder_coordinates
from belt_sim.scene_parts import PulleySurface, SceneParts

FIRST, LAST = -1, 1
_TURN = 2.0 * math.pi


def depth(wrap: Wrap, pose: Pose, angle: np.ndarray, end: int) -> np.ndarray:
    """How far behind the belt's tangent at ``end`` stations of material angle ``angle`` [rad], shape (...), lie [m]."""
    ahead = angle + pose.spin - wrap.tangent[(end + 1) // 2]
    return -end * (ahead - _TURN * np.rint(ahead / _TURN)) * wrap.surface.radius


def sink_ends(wrap: Wrap, pose: Pose, end: int, chord: float, moved: float) -> None:
    """Put the outermost stations at ``end`` on their path for the pulley's present place.

    chord [m] at rest; moved [m]: how far the pulley has turned since the last time.
    """
    outer = wrap.first if end == FIRST else wrap.last
    zone = sinking_chords(chord, wrap.surface.radius) + 2  # stations that may be off the circle; the next one never is
    k = (outer - end * np.arange(zone + 1)) % len(wrap.landing_lift)
    off, r, angle = k[:-1], wrap.r[k], wrap.angle[k]
    flat = (r[1:] - r[:-1]) ** 2 + 4.0 * r[1:] * r[:-1] * np.sin(0.5 * (angle[1:] - angle[:-1])) ** 2
    wrap.landing_lift[off] *= math.exp(-moved / (FORGETTING * chord))
    inside = depth(wrap, pose, 0.5 * (angle[:-1, 0] + angle[:-1, -1]), end)
    high = lift(inside, chord, wrap.surface.radius) + wrap.landing_lift[off]
    r[:-1] = wrap.radius_at(wrap.y[off]) + high[:, None]
    turned = chord_angle_flat(flat, r[:-1], r[1:])
    wrap.r[off] = r[:-1]
    wrap.angle[off] = angle[-1] + end * turned[::-1].cumsum(axis=0)[::-1]


def is_caught(wrap: Wrap, pose: Pose, end: int, nodes: np.ndarray, chord: float) -> bool:
    """Whether a free station with nodes at [m], shape (m, 3), has come close enough to be held."""
    _, _, angle = cylinder_coordinates(nodes, pose)
    return float(depth(wrap, pose, 0.5 * (angle[0] + angle[-1]), end)) > -CATCH_DISTANCE * chord


def is_released(wrap: Wrap, pose: Pose, end: int, chord: float) -> bool:
    """Whether the outermost station at ``end`` has come far enough to be free."""
    outer = (wrap.first if end == FIRST else wrap.last) % len(wrap.landing_lift)
    return (
        float(depth(wrap, pose, 0.5 * (wrap.angle[outer, 0] + wrap.angle[outer, -1]), end))
        < -(CATCH_DISTANCE + HYSTERESIS) * chord
    )


def land_station(wrap: Wrap, pose: Pose, end: int, nodes: np.ndarray, beside: np.ndarray, chord: float) -> int:
    """Anchor the station next to ``end`` at its mean height and at its distance from the one landed before.

    nodes, beside: positions of the nodes of both [m], shape (m, 3). Returns the station's number.
    """
    outer = wrap.first if end == FIRST else wrap.last
    station, neighbour = ((outer + i * end) % len(wrap.landing_lift) for i in (1, 0))
    r, y, angle = cylinder_coordinates(nodes, pose)
    circle = wrap.radius_at(y)
    high = float(np.mean(r - circle))
    wrap.landing_lift[station] = high - lift(depth(wrap, pose, angle.mean(), end), chord, wrap.surface.radius)
    wrap.y[station], wrap.r[station] = y, circle + high
    length = np.linalg.norm(nodes - beside, axis=1)
    turned = chord_angle(length, y - wrap.y[neighbour], wrap.r[station], wrap.r[neighbour])
    wrap.angle[station] = wrap.angle[neighbour] + end * turned
    wrap.first, wrap.last = (wrap.first - 1, wrap.last) if end == FIRST else (wrap.first, wrap.last + 1)
    wrap.renumber()
    return int(station)


def anchor_station(wrap: Wrap, pose: Pose, station: int, nodes: np.ndarray) -> None:
    """Anchor a station where its nodes are, at their mean height (used before the run)."""
    r, y, angle = cylinder_coordinates(nodes, pose)
    circle = wrap.radius_at(y)
    wrap.y[station], wrap.angle[station], wrap.r[station] = y, angle, circle + np.mean(r - circle)


def tangent_angle(pose: Pose, along: np.ndarray) -> float:
    """Angle [rad] from the top towards +x of the place where a belt that runs along a vector, shape (3,), meets it."""
    local = along @ pose.axes
    return float(np.arctan2(-local[2], local[0]))


def fibre_share(case: Case, residual: float) -> float:
    """Share [1] of the torsional stiffness that is the fibres' tension; residual [1]: as of a Mesh."""
    belt, force = case.belt, float(case.tension_force)
    tense = force * float(belt.width) ** 2 / 12.0
    still = float(belt.shear_modulus) * float(belt.width) * float(belt.thickness) ** 3 / 3.0
    locked = RESIDUAL_TORSION * residual * float(belt.youngs_modulus) * float(belt.area) * float(belt.width) ** 2 / 12.0
    return tense / (tense + still - locked)


@dataclass(frozen=True)
class BendingLayer:
    """The layer of one belt.

    plate [N m]: D of a fibre, per width; thickness [m]; modulus [Pa]; own [1]: share of the torsional stiffness that
    is the fibres' tension, the rest resists that they lift off apart; dt [s]: of a step.
    """

    mesh: Mesh
    plate: float
    thickness: float
    modulus: float
    own: float
    dt: float

    @staticmethod
    def of(case: Case, mesh: Mesh, strength: float, dt: float) -> "BendingLayer":
        """Of a belt of two or more lines; strength [1] multiplies l^2 and l^3."""
        belt = case.belt
        return BendingLayer(
            mesh=mesh,
            plate=float(belt.plate_stiffness),
            thickness=float(belt.thickness),
            modulus=float(belt.youngs_modulus),
            own=strength * fibre_share(case, mesh.residual),
            dt=dt,
        )

    def follow(self, state: RunState) -> None:
        """After a step: move the displacements of both pulleys' ends on to what the fibres beside them say."""
        for wrap, pose in zip(state.wraps, state.poses, strict=True):
            for i, end in enumerate((FIRST, LAST)):
                wanted = state.share * self.displacements(state.slides, wrap, pose, end)
                wrap.layer[i] += (wanted - wrap.layer[i]) * min(self.dt / LAYER_TIME, 1.0)

    def displacements(self, slides: np.ndarray, wrap: Wrap, pose: Pose, end: int) -> np.ndarray:
        """How far the lines are outside the circle, and drawn into the pulley, beyond their mean [m], shape (m, 2)."""
        mesh, radius = self.mesh, wrap.surface.radius
        begin = wrap.first - 1 - RUNUP_LINKS if end == FIRST else wrap.last + 1
        stations = np.arange(begin, begin + RUNUP_LINKS + 1) % mesh.stations
        links = np.diff(mesh.at(slides, stations), axis=0)
        strain = (np.linalg.norm(links, axis=2) / mesh.lengths[stations[:-1]]).mean(axis=0) - 1.0
        stress = self.modulus * np.maximum(strain, SLACKEST_FIBRE * max(strain.mean(), 1e-12))
        along = links.sum(axis=0)
        meets = wrap.tangent[(end + 1) // 2]
        steeper = np.array([end * math.remainder(tangent_angle(pose, line) - meets, math.tau) for line in along])
        layer = np.sqrt(self.plate / (stress * self.thickness))
        out = layer**2 / (2.0 * radius)
        drawn = layer**3 / (12.0 * radius**2) - out.mean() * (steeper - steeper.mean())
        both = np.stack([out, drawn], axis=1)
        return self.own * (both - both.mean(axis=0))


def held_displacements(wrap: Wrap, pose: Pose, mesh: Mesh) -> np.ndarray:
    """By how much the layer displaces the held nodes [m], shape (held, m, 3)."""
    moved = np.zeros((len(wrap.stations), mesh.across, 3))
    zone = min(sinking_chords(mesh.chord, wrap.surface.radius) + 2, len(moved))
    for end in (FIRST, LAST):
        k = np.arange(zone) if end == FIRST else len(moved) - 1 - np.arange(zone)
        moved[k] += station_displacement(
            wrap, pose, end, depth(wrap, pose, wrap.angle[wrap.stations[k]].mean(axis=1), end), mesh
        )
    return moved


def station_displacement(wrap: Wrap, pose: Pose, end: int, inside: np.ndarray, mesh: Mesh) -> np.ndarray:
    """By how much the layer at ``end`` displaces stations ``inside`` [m] behind the tangent point, shape (k,), there.

    [m], shape (k, m, 3). Sections that are drawn in unequally turn, and with them the line that they stand on; wholly
    on the straight part of the path, less along the stations that sink onto the circle.
    """
    out, drawn = wrap.layer[(end + 1) // 2].T
    turned = float(drawn @ mesh.line_y) / float(mesh.line_y @ mesh.line_y)
    at = wrap.tangent[(end + 1) // 2]
    local = np.empty((len(inside), len(out), 3))
    local[..., 0] = out * np.sin(at) - end * drawn * np.cos(at)
    local[..., 1] = -turned * inside[:, None]
    local[..., 2] = out * np.cos(at) + end * drawn * np.sin(at)
    return (fade(inside, mesh.chord, wrap.surface.radius)[:, None, None] * local) @ pose.axes.T


def thread_places(wrap: Wrap, pose: Pose, end: int, mesh: Mesh, slides: np.ndarray) -> np.ndarray:
    """Where the station next to ``end`` and the outermost held one would be without the layer [m], shape (2, m, 3)."""
    outer = wrap.first if end == FIRST else wrap.last
    nodes = mesh.at(slides, np.array([outer + end, outer]) % mesh.stations)
    if not wrap.layer.any():
        return nodes
    angle = cylinder_coordinates(nodes, pose)[2].mean(axis=1)
    return nodes - station_displacement(wrap, pose, end, depth(wrap, pose, angle, end), mesh)


_NEITHER = -1
_FEWEST = 3  # links on a pulley


def lay_wraps(
    mesh: Mesh, loop: LaidLoop, slides: np.ndarray, poses: tuple[Pose, Pose], radii: tuple[float, float]
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
            anchor_station(wrap, pose, k, mesh.at(slides, k))
        _update_tangents(mesh, slides, wrap, pose, 1.0)
        for end in (FIRST, LAST):
            _change_end(mesh, slides, wrap, pose, end)
        wraps.append(wrap)
    return wraps[HEAD], wraps[TAIL]


def shape_pulleys(state: RunState, parts: SceneParts) -> None:
    """From now on stations land on the pulleys as they are."""
    for wrap, surface in zip(state.wraps, (parts.head, parts.tail), strict=True):
        wrap.surface = surface


def move_anchors(state: RunState, chord: float) -> None:
    """Before a step: the anchors run along the path that the pulleys, where they will be at its end, give them."""
    for wrap, pose in zip(state.wraps, state.poses, strict=True):
        moved = abs(pose.spin - wrap.anchored_spin) * wrap.surface.radius
        wrap.anchored_spin = pose.spin
        for end in (FIRST, LAST):
            sink_ends(wrap, pose, end, chord, moved)


def update_contact(
    mesh: Mesh, state: RunState, pull: np.ndarray, dt: float, friction: float, tangent: WrapStiffness | None
) -> None:
    """After a step, with held nodes on their anchors: let them slip, land and go.

    pull [N], shape (n, m, 3): of belt and weight on the nodes; dt [s]; friction [1], inf = sticking; tangent: None for
    a belt that never slips.

    When both belts slide as a whole they take turns, since each reckons with the other standing still.
    """
    if math.isinf(friction):
        tangent = None
    if tangent is not None:
        sliding = all(wrap.sliding.mean() > 0.5 for wrap in state.wraps)
        state.waiting_pulley = _NEITHER if not sliding else TAIL if state.waiting_pulley == HEAD else HEAD
    for which, (wrap, pose) in enumerate(zip(state.wraps, state.poses, strict=True)):
        if tangent is not None and state.waiting_pulley != which:
            holding = -wrap.components(pose, pull[wrap.stations])
            holding[..., 0] -= mesh.mass * state.speed**2 / wrap.surface.radius
            state.slip[which] += slide_anchors(wrap, holding, friction, tangent)
        _update_tangents(mesh, state.slides, wrap, pose, dt / SPAN_TIME)
        for end in (FIRST, LAST):
            _change_end(mesh, state.slides, wrap, pose, end)


def _update_tangents(mesh: Mesh, slides: np.ndarray, wrap: Wrap, pose: Pose, share: float) -> None:
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
    if is_caught(wrap, pose, end, nodes, mesh.chord):
        land_station(wrap, pose, end, nodes, beside, mesh.chord)
    elif is_released(wrap, pose, end, mesh.chord):
        wrap.slip_increment[outer % mesh.stations] = 0.0
        if wrap.last - wrap.first < _FEWEST:
            raise RunFailed("the belt leaves a pulley: tension too low for its weight; raise settings.tension")
        wrap.first, wrap.last = (wrap.first + 1, wrap.last) if end == FIRST else (wrap.first, wrap.last - 1)
        wrap.renumber()
