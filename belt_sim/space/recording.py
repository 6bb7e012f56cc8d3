"""Readings of a run (points 1-4, angles, entry moments, tilt, sag, tension), collected into curves and frames."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.case import Numbers as Array
from belt_sim.curves import Curves, Frame, Observer, SceneObserver
from belt_sim.errors import SimulationError
from belt_sim.jax_setup import in_float64, jit_float64
from belt_sim.space.belt import ActiveFeatures, BeltArrays, belt_arrays
from belt_sim.space.elastic import strains
from belt_sim.space.machine import SceneLayout
from belt_sim.space.options import AXIS_STATIONS, RUNAWAY, RUNUP_LINKS
from belt_sim.space.state import RunState
from belt_sim.space.wrap import HEAD, TAIL

#: rows of a reading
POINTS, ANGLES, MOMENTS, EDGES = slice(0, 4), slice(4, 8), slice(8, 10), slice(10, 12)
TILTS, SAGS, TENSION = slice(12, 14), slice(14, 16), 16
READING_SIZE = 17


def reading(belt: BeltArrays, nodes: Array, first: Array, last: Array, tail_x: Array, share: Array | float) -> Array:
    """y of points 1-4 [m], their angles [rad], entry moments [N m] and slack-edge stresses [Pa] at the run-ups of the
    upper and lower span, tilts [rad], sags [m], tension [Pa] at the upper run-up; shape (17,).

    nodes [m], (m, 3, n); first, last, (2,): ends of the wraps of head and tail; tail_x [m]; share: of the camber.
    """
    n, zero, sign = nodes.shape[-1], 0.0 * tail_x, belt.shape.sign
    points = ((first[TAIL], tail_x), (last[TAIL], tail_x), (first[HEAD], zero), (last[HEAD], zero))
    found = [_at_axis(belt, nodes, station, x) for station, x in points]
    runups = (first[TAIL], first[HEAD]) if sign > 0 else (last[HEAD], last[TAIL])
    begins = [s - RUNUP_LINKS - 1 if sign > 0 else s + 1 for s in runups]
    forces = [_section_forces(belt, nodes, s, share) for s in begins]
    edges = [t / belt.area - 6.0 * abs(m) / (belt.area * belt.width) for t, m in forces]
    # before the belt has gone round the numbers of the head's wrap lie below the tail's
    lower_head = first[HEAD] + n * jnp.rint((last[TAIL] - first[HEAD]) / n + 0.5).astype(int)
    middles = [((last[HEAD] + first[TAIL]) // 2) % n, ((last[TAIL] + lower_head) // 2) % n]
    across = [nodes[0, :, k] - nodes[-1, :, k] for k in middles]
    heights = [nodes[:, 2, k].mean() for k in middles]
    y, slopes = zip(*found, strict=True)
    tilts, sags = [jnp.arctan2(a[2], a[1]) for a in across], [belt.level - heights[0], -belt.level - heights[1]]
    moments, angles = [moment for _, moment in forces], [sign * slope for slope in slopes]
    return jnp.stack([*y, *angles, *moments, *edges, *tilts, *sags, forces[0][0] / belt.area])


def _at_axis(belt: BeltArrays, nodes: Array, station: Array, x: Array) -> tuple[Array, Array]:
    """y and dy/ds of the centre line (s along station numbers) where the belt passes the pulley's axis."""
    k = (station - AXIS_STATIONS + np.arange(2 * AXIS_STATIONS + 1)) % nodes.shape[-1]
    centre = nodes[:, :, k].mean(axis=0)
    ahead = centre[0] - x
    crosses = ahead[1:-2] * ahead[2:-1] <= 0.0
    i = 1 + jnp.where(crosses.any(), jnp.argmax(crosses), AXIS_STATIONS - 1)
    share = ahead[i] / (ahead[i] - ahead[i + 1])
    y = centre[1, i] + share * (centre[1, i + 1] - centre[1, i])
    return y, (centre[1, i + 2] - centre[1, i - 1]) / (3.0 * belt.chord)


def _section_forces(belt: BeltArrays, nodes: Array, first: Array, share: Array | float) -> tuple[Array, Array]:
    """Tension [N] and in-plane bending moment EI (kappa - kappa_c) [N m], mean over RUNUP_LINKS links.

    kappa = y'', kappa_c the natural curvature.
    """
    k = (first + np.arange(RUNUP_LINKS + 1)) % nodes.shape[-1]
    strain = strains(belt.ties, nodes, k, share)
    if len(nodes) == 1:
        return belt.stiffness[0] * strain[0], 0.0 * strain[0]
    weight = belt.stiffness * belt.line_y
    return belt.stiffness @ strain, -belt.bending * (weight @ strain) / (weight @ belt.line_y)


_reading = jit_float64(reading)
#: lateral slip [m] and share of sliding nodes on the head and the tail pulley, x of the tail pulley [m], steps made,
#: speed of the belt [m/s]
EXTRA = ("slip_head", "slip_tail", "sliding_head", "sliding_tail", "tail_x", "steps", "belt_speed")
#: of a frame, in the order of a reading after its angles
_SCALARS = ("entry_moment_upper", "entry_moment_lower", "edge_stress_upper", "edge_stress_lower", "tilt_upper",
            "tilt_lower", "sag_upper", "sag_lower", "tension")  # fmt: skip


@contextmanager
def notify_observers(
    observers: Sequence[Observer], case: Case, travel: float, curves: Callable[[], Curves], *scene: Any
) -> Iterator[None]:
    """Let observers watch a run over ``travel`` [m] from its start to its end, however it ends.

    curves: those of the run so far, which a SimulationError carries on; scene: MjModel and MjData of the run.
    """
    for observer in observers:
        observer.start(case, travel)
        if scene and isinstance(observer, SceneObserver):
            observer.show(*scene)
    try:
        yield
    except SimulationError as failure:
        failure.curves = curves()
        raise
    finally:
        for observer in observers:
            observer.finish(curves())


_READINGS_PER_SAMPLE = 5  # a landing shakes the belt once per station; the curve is the mean over a sample


@dataclass
class Recorder:
    """Reads the belt every few steps; a row of the curves is the mean reading over options.sample of travel."""

    scene: SceneLayout
    observers: tuple[Observer, ...]
    rows: list[np.ndarray] = field(default_factory=list)
    window: list[np.ndarray] = field(default_factory=list)
    steps: int = 0
    next_reading: float = 0.0
    next_row: float = 0.0
    next_frame: float = -math.inf

    @cached_property
    def arrays(self) -> BeltArrays:
        features = ActiveFeatures(cambered=self.scene.parts.camber is not None)
        return in_float64(jax.device_put)(belt_arrays(self.scene, features))

    def reading(self, state: RunState) -> np.ndarray:
        """Shape (17,), as ``reading``."""
        nodes, wraps = self.scene.mesh.nodes(state.slides), state.pulleys.wrap
        return np.asarray(_reading(self.arrays, nodes, wraps.first, wraps.last, state.tail_x, state.share))

    def begin(self, state: RunState) -> None:
        """Travel 0 has been reached: y counts from here."""
        self.rows.append(self._read(state, 0.0))
        self.next_row = self.scene.options.sample
        self._frame(state, self.rows[0], self.scene.options.frame)

    def watch(self, state: RunState, every: float) -> None:
        """Called after every step of a stage before the run-in: a frame after every so many metres of travel."""
        if self.observers and state.travel >= self.next_frame:
            self._frame(state, self._read(state, state.travel), every)

    def is_due(self, travel: float) -> bool:
        """Whether ``step`` will read the belt at this travel [m], from travel 0 on."""
        return travel >= self.next_reading

    def step(self, state: RunState) -> None:
        """Called after every step of the run-in and the run."""
        self.steps += 1
        if not self.is_due(state.travel):
            return
        options = self.scene.options
        self.next_reading = state.travel + options.sample / _READINGS_PER_SAMPLE
        read = self._read(state, state.travel)
        self.window.append(read)
        if state.travel >= self.next_row:
            self.next_row += options.sample
            self.rows.append(np.mean(self.window, axis=0))
            self.window.clear()
        if state.travel >= self.next_frame:
            self._frame(state, read, options.frame)

    def _read(self, state: RunState, travel: float) -> np.ndarray:
        read = self.reading(state)
        if not np.all(np.isfinite(read)):
            raise SimulationError(f"positions are not finite at travel {travel:.2f} m: halve options.dt")
        if np.abs(read[POINTS]).max() > RUNAWAY * float(self.scene.case.belt.width):
            where = int(np.argmax(np.abs(read[POINTS]))) + 1
            raise SimulationError(
                f"y at point {where} = {read[where - 1]:.3f} m at travel {travel:.2f} m: the belt has run off its "
                "pulleys; turn the yaw back earlier or shorten travel"
            )
        slip = state.slip
        return np.concatenate([read, slip.total, slip.sliding, [state.tail_x, self.steps, state.speed, travel]])

    def _frame(self, state: RunState, read: np.ndarray, every: float) -> None:
        self.next_frame = state.travel + every
        if not self.observers:
            return
        extra = dict(zip(EXTRA, map(float, read[READING_SIZE:-1]), strict=True))
        frame = frame_of(self.scene, read, state, extra)
        for observer in self.observers:
            observer.frame(frame)

    def curves(self) -> Curves:
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


def frame_of(scene: SceneLayout, read: Array, at: Any, extra: dict[str, float]) -> Frame:
    """A frame of a belt with the reading ``read``; extra: more scalars, by name, tail_x [m] among them.

    at: has ``slides`` [m], shape (n, m, 3), of its nodes, ``travel`` [m], ``time`` [s], and ``yaw`` [rad], shape (2,).
    """
    nodes, tail_x = scene.mesh.rest + at.slides, extra["tail_x"]
    centre, half = nodes.mean(axis=1), nodes[:, 0] - nodes.mean(axis=1)
    if scene.mesh.lines > 1:  # the real belt's edges at +b/2 and -b/2, drawn out from the model's lines
        half = half * (0.5 * float(scene.case.belt.width) / scene.mesh.line_y[0])
    left, right = (np.concatenate([edge, edge[:1]]) for edge in (centre + half, centre - half))
    r_head, r_tail = scene.loop.radius_head, scene.loop.radius_tail
    places = ((tail_x, r_tail), (tail_x, -r_tail), (0.0, -r_head), (0.0, r_head))
    points = np.array([[px, y, pz] for (px, pz), y in zip(places, read[POINTS], strict=True)])
    scalars = dict(zip(_SCALARS, map(float, read[MOMENTS.start : READING_SIZE]), strict=True))
    return Frame(
        travel=at.travel, time=at.time, left=left, right=right, points=points, yaw_tail=float(at.yaw[1]),
        yaw_head=float(at.yaw[0]), tail_x=tail_x, scalars={**scalars, **extra},
    )  # fmt: skip
