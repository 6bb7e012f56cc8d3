"""What a run shows at one instant: points 1-4, angles, entry moments, tilt, sag, tension."""

import numpy as np

from belt_sim.case import Case
from belt_sim.mujoco3d.constants import AXIS_STATIONS, RUNUP_LINKS
from belt_sim.mujoco3d.machine.scene import Scene
from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.state import HEAD, TAIL, State

#: rows of a reading
POINTS, ANGLES, MOMENTS, EDGES, TILTS, SAGS, TENSION = (
    slice(0, 4),
    slice(4, 8),
    slice(8, 10),
    slice(10, 12),
    slice(12, 14),
    slice(14, 16),
    16,
)
READING_SIZE = 17


def reading(scene: Scene, state: State) -> np.ndarray:
    """y of points 1-4 [m], their angles [rad], entry moments [N m] and slack-edge stress [Pa] at the run-ups of the
    upper and lower span, tilts [rad], sags [m], tension [N] at the upper run-up; shape (17,)."""
    case, mesh, slides = scene.case, scene.mesh, state.slides
    head, tail = state.wraps[HEAD], state.wraps[TAIL]
    sign, tail_x, n = float(case.settings.direction), float(state.poses[TAIL].centre[0]), mesh.stations
    out = np.empty(READING_SIZE)
    for k, (station, x) in enumerate(((tail.first, tail_x), (tail.last, tail_x), (head.first, 0.0), (head.last, 0.0))):
        out[k], slope = _at_axis(mesh, slides, station, x)
        out[4 + k] = sign * slope
    runups = (tail.first, head.first) if sign > 0 else (head.last, tail.last)
    for k, station in enumerate(runups):
        first = station - RUNUP_LINKS - 1 if sign > 0 else station + 1
        tension, out[8 + k] = _section_forces(mesh, slides, first, float(case.belt.bending_stiffness))
        out[10 + k] = _slack_edge(case, tension, out[8 + k])
        if k == 0:
            out[TENSION] = tension
    # before the belt has gone round the numbers of the head's wrap lie below the tail's
    head_lower = head.first + n * round((tail.last - head.first) / n + 0.5)
    upper, lower = ((head.last + tail.first) // 2) % n, ((tail.last + head_lower) // 2) % n
    out[TILTS] = [_tilt(mesh.at(slides, upper)), _tilt(mesh.at(slides, lower))]
    level = scene.loop.radius_head
    out[SAGS] = [level - mesh.at(slides, upper)[:, 2].mean(), -level - mesh.at(slides, lower)[:, 2].mean()]
    return out


def _around(mesh: Mesh, slides: np.ndarray, first: int, count: int) -> np.ndarray:
    return mesh.at(slides, np.arange(first, first + count) % mesh.stations)


def _at_axis(mesh: Mesh, slides: np.ndarray, station: int, x: float) -> tuple[float, float]:
    """y and dy/ds of the centre line (s along station numbers) where the belt passes the pulley's axis."""
    centre = _around(mesh, slides, station - AXIS_STATIONS, 2 * AXIS_STATIONS + 1).mean(axis=1)
    ahead = centre[:, 0] - x
    crossing = np.flatnonzero(ahead[1:-2] * ahead[2:-1] <= 0.0)
    i = 1 + (int(crossing[0]) if len(crossing) else AXIS_STATIONS - 1)
    share = ahead[i] / (ahead[i] - ahead[i + 1])
    y = centre[i, 1] + share * (centre[i + 1, 1] - centre[i, 1])
    slope = (centre[i + 2, 1] - centre[i - 1, 1]) / (3.0 * mesh.chord)
    return float(y), float(slope)


def _section_forces(mesh: Mesh, slides: np.ndarray, first: int, bending_stiffness: float) -> tuple[float, float]:
    """Tension [N] and in-plane bending moment EI (kappa - kappa_c) [N m], mean over RUNUP_LINKS links.

    kappa = y'', kappa_c the natural curvature.
    """
    nodes = _around(mesh, slides, first, RUNUP_LINKS + 1)
    free = mesh.lengths[np.arange(first, first + RUNUP_LINKS) % mesh.stations]
    strain = (np.linalg.norm(np.diff(nodes, axis=0), axis=2) / free - 1.0).mean(axis=0)
    tension = float(mesh.line_stiffness @ strain)
    if mesh.across == 1:
        return tension, 0.0
    weight = mesh.line_stiffness * mesh.line_y
    return tension, -bending_stiffness * float(weight @ strain) / float(weight @ mesh.line_y)


def _slack_edge(case: Case, tension: float, moment: float) -> float:
    """Stress of the slacker edge of the real strip [Pa]: N / (b h) - 6 |M| / (b^2 h)."""
    area, width = float(case.belt.area), float(case.belt.width)
    return tension / area - 6.0 * abs(moment) / (area * width)


def _tilt(nodes: np.ndarray) -> float:
    if len(nodes) == 1:
        return 0.0
    across = nodes[0] - nodes[-1]
    return float(np.arctan2(across[2], across[1]))


def edges(scene: Scene, slides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The real belt's edges at +b/2 and -b/2 [m], closed loops, shape (n + 1, 3), drawn out from the model's lines.

    slides [m], shape (n, m, 3): of the nodes.
    """
    mesh = scene.mesh
    nodes = mesh.rest + slides
    centre, left = nodes.mean(axis=1), nodes[:, 0] - nodes.mean(axis=1)
    if mesh.across > 1:
        left = left * (0.5 * float(scene.case.belt.width) / mesh.line_y[0])
    loops = [np.concatenate([e, e[:1]]) for e in (centre + left, centre - left)]
    return loops[0], loops[1]
