"""Readings of a run (points 1-4, angles, entry moments, tilt, sag, tension), collected into curves and frames."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.errors import RunFailed
from belt_sim.frame import Frame, Observer
from belt_sim.mujoco3d.machine import SceneLayout
from belt_sim.mujoco3d.mesh import Mesh
from belt_sim.mujoco3d.options import AXIS_STATIONS, RUNAWAY, RUNUP_LINKS
from belt_sim.mujoco3d.state import HEAD, TAIL, RunState

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


def reading(scene: SceneLayout, state: RunState) -> np.ndarray:
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


def _nodes_from(mesh: Mesh, slides: np.ndarray, first: int, count: int) -> np.ndarray:
    return mesh.at(slides, np.arange(first, first + count) % mesh.stations)


def _at_axis(mesh: Mesh, slides: np.ndarray, station: int, x: float) -> tuple[float, float]:
    """y and dy/ds of the centre line (s along station numbers) where the belt passes the pulley's axis."""
    centre = _nodes_from(mesh, slides, station - AXIS_STATIONS, 2 * AXIS_STATIONS + 1).mean(axis=1)
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
    nodes = _nodes_from(mesh, slides, first, RUNUP_LINKS + 1)
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


def belt_edges(scene: SceneLayout, slides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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


#: lateral slip [m] and share of sliding nodes on the head and the tail pulley, x of the tail pulley [m], steps made,
#: speed of the belt [m/s]
EXTRA = ("slip_head", "slip_tail", "sliding_head", "sliding_tail", "tail_x", "steps", "belt_speed")
#: of a frame, in the order of a reading after its angles
_SCALARS = ("entry_moment_upper", "entry_moment_lower", "edge_stress_upper", "edge_stress_lower", "tilt_upper",
            "tilt_lower", "sag_upper", "sag_lower", "tension")  # fmt: skip
_READINGS_PER_SAMPLE = 5  # a landing shakes the belt once per station; the curve is the mean over a sample


@dataclass
class Recorder:
    """Reads the belt every few steps; a row of the curves is the mean reading over options.sample of travel."""

    scene: SceneLayout
    observers: tuple[Observer, ...]
    rows: list[np.ndarray] = field(default_factory=list)
    window: list[np.ndarray] = field(default_factory=list)
    start: np.ndarray | None = None
    steps: int = 0
    next_reading: float = 0.0
    next_row: float = 0.0
    next_frame: float = -math.inf

    def begin(self, state: RunState) -> None:
        """Travel 0 has been reached: y counts from here."""
        self.start = self._read(state, 0.0)
        self.rows.append(self._row(self.start, 0.0))
        self.next_row = self.scene.options.sample
        self._frame(state, self.start, self.scene.options.frame)

    def watch(self, state: RunState, every: float) -> None:
        """Called after every step of a stage before the run-in: a frame after every so many metres of travel."""
        if self.observers and state.travel >= self.next_frame:
            self._frame(state, self._read(state, state.travel), every)

    def due(self, travel: float) -> bool:
        """Whether ``step`` will read the belt at this travel [m]."""
        return self.start is not None and travel >= self.next_reading

    def step(self, state: RunState) -> None:
        """Called after every step of the run-in and the run."""
        self.steps += 1
        if not self.due(state.travel):
            return
        options = self.scene.options
        self.next_reading = state.travel + options.sample / _READINGS_PER_SAMPLE
        read = self._read(state, state.travel)
        self.window.append(read)
        if state.travel >= self.next_row:
            self.next_row += options.sample
            mean = np.mean(self.window, axis=0)
            self.window.clear()
            self.rows.append(self._row(mean, mean[-1]))
        if state.travel >= self.next_frame:
            self._frame(state, read, options.frame)

    def _read(self, state: RunState, travel: float) -> np.ndarray:
        read, case = reading(self.scene, state), self.scene.case
        if not np.all(np.isfinite(read)):
            raise RunFailed(f"positions are not finite at travel {travel:.2f} m: halve options.dt")
        if np.abs(read[POINTS]).max() > RUNAWAY * float(case.belt.width):
            where = int(np.argmax(np.abs(read[POINTS]))) + 1
            raise RunFailed(
                f"y at point {where} = {read[where - 1]:.3f} m at travel {travel:.2f} m: the belt has run off its "
                "pulleys; turn the yaw back earlier or shorten travel"
            )
        sliding = [np.mean(wrap.sliding) for wrap in state.wraps]
        tail_x = float(state.poses[TAIL].centre[0])
        return np.concatenate([read, state.slip, sliding, [tail_x, self.steps, state.speed, travel]])

    def _row(self, mean: np.ndarray, travel: float) -> np.ndarray:
        row = mean.copy()
        row[POINTS] -= 0.0 if self.start is None else self.start[POINTS]
        row[-1] = travel
        return row

    def _frame(self, state: RunState, read: np.ndarray, every: float) -> None:
        self.next_frame = state.travel + every
        if not self.observers:
            return
        extra = dict(zip(EXTRA, map(float, read[READING_SIZE:-1]), strict=True))
        x = float(state.poses[TAIL].centre[0])
        frame = frame_of(self.scene, read, state.slides, state.travel, state.time, state.yaw, x, extra)
        for observer in self.observers:
            observer.frame(frame)

    def curves(self) -> Curves:
        """Curves of what has been run so far."""
        table = np.array(self.rows).T if self.rows else np.empty((READING_SIZE + len(EXTRA) + 1, 0))
        return curves_of(table, table[-1], dict(zip(EXTRA, table[READING_SIZE:-1], strict=True)))


def curves_of(readings: np.ndarray, travel: np.ndarray, extra: Mapping[str, np.ndarray]) -> Curves:
    """Curves from columns of readings (17 or more, k) at travels [m], (k,); y counts from the first."""
    return Curves(
        travel=travel,
        y=readings[POINTS] - readings[POINTS, :1],
        angle=readings[ANGLES],
        moment=readings[MOMENTS],
        edge_stress=readings[EDGES],
        tilt=readings[TILTS],
        sag=readings[SAGS].mean(axis=1) if len(travel) else np.zeros(2),
        extra={"tension": readings[TENSION], **extra},
    )


def frame_of(
    scene: SceneLayout,
    read: np.ndarray,
    slides: np.ndarray,
    travel: float,
    time: float,
    yaw: np.ndarray,
    tail_x: float,
    extra: Mapping[str, float],
) -> Frame:
    """A frame of a belt with its nodes at ``slides`` [m], shape (n, m, 3), and the reading ``read`` (recording.py).

    yaw [rad], shape (2,): head, tail; extra: more scalars, by name.
    """
    left, right = belt_edges(scene, slides)
    r_head, r_tail = scene.loop.radius_head, scene.loop.radius_tail
    places = ((tail_x, r_tail), (tail_x, -r_tail), (0.0, -r_head), (0.0, r_head))
    points = np.array([[px, y, pz] for (px, pz), y in zip(places, read[POINTS], strict=True)])
    scalars = dict(zip(_SCALARS, map(float, read[MOMENTS.start : READING_SIZE]), strict=True))
    return Frame(
        travel=travel, time=time, left=left, right=right, points=points, yaw_tail=float(yaw[1]),
        yaw_head=float(yaw[0]), tail_x=tail_x, scalars={**scalars, **extra},
    )  # fmt: skip
