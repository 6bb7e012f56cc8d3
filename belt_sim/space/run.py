"""A run of the 3D belt around the steps of its engine: one plan of steps, one recorder, one batch wrapper.

The plan says what every step is to reach: in time (engine=native, mjx), where the belt stands still for a yaw step, or
in travel (quasi_static). The recorder makes curves and frames of readings (points 1-4, angles, entry moments, tilt,
sag, tension). The wrapper runs many cases at once on JAX.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case, Schedule, Settings
from belt_sim.case import Numbers as Array
from belt_sim.curves import Curves, Frame, Observer, SceneObserver
from belt_sim.errors import InputError, SimulationError
from belt_sim.jax_setup import in_float64, jit_float64
from belt_sim.scene_parts import SceneParts
from belt_sim.space.belt import ActiveFeatures, BeltArrays, active_features, belt_arrays
from belt_sim.space.elastic import strains
from belt_sim.space.loop import smoothstep
from belt_sim.space.machine import SceneLayout
from belt_sim.space.mujoco_interface import Motion
from belt_sim.space.options import AXIS_STATIONS, MOST_CHORDS, REST_DRAG, RUNAWAY, RUNUP_LINKS, Options, accelerate
from belt_sim.space.wrap import HEAD, TAIL, BeltOnPulley, SlipState


class Command(NamedTuple):
    """Boundary values of a step, at its end; of many steps with a leading axis of steps.

    travel [m]: of the belt; yaw [rad], (2,): commanded, head and tail; share [1]: of yaw offsets, cants, camber and
    loads that acts; speed [m/s], acceleration [m/s2]: of the belt, along its direction; drag [1/s], (2,): of the belt
    per unit of its mass, along x and across it; friction [1], inf = sticking. engine=quasi_static reads the first three
    alone, engine=mjx all but the last.
    """

    travel: Array
    yaw: Array
    share: Array
    speed: Array = None
    acceleration: Array = None
    drag: Array = None
    friction: Array = None


#: entries of a schedule: at [m], over [m], change [rad]
_Entries = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class YawPlan:
    """The yaw schedules of the head and the tail pulley, whose steps are made while the belt stands still."""

    head: _Entries
    tail: _Entries

    @staticmethod
    def from_settings(settings: Settings, step_over: float = 0.0) -> "YawPlan":
        """step_over [m]: travel over which a step is made, half of it before its place; 0 = it is made at rest."""

        def entries(schedule: Schedule) -> _Entries:
            at, over, change = (np.asarray(v, float) for v in (schedule.at, schedule.over, schedule.change))
            at, over = np.where(over > 0.0, [at, over], [at - 0.5 * step_over, np.full_like(over, step_over)])
            return tuple(zip(at.tolist(), over.tolist(), change.tolist(), strict=True))

        return YawPlan(entries(settings.yaw_head), entries(settings.yaw))

    def stops(self, until: float) -> set[float]:
        """Travels [m] of the steps within the run."""
        return {at for at, over, change in (*self.head, *self.tail) if over <= 0.0 and change and at < until}

    def angles(self, travel: Any, done: float) -> np.ndarray:
        """Yaw [rad] of both at ``travel`` [m], (...), when the steps up to travel ``done`` [m] have been made, shape
        (..., 2)."""

        def turned(entries: _Entries) -> np.ndarray:
            found = np.zeros(np.shape(travel))
            for at, over, change in entries:
                part = np.clip((travel - at) / over, 0.0, 1.0) if over > 0.0 else float(at <= done)
                found = found + change * part
            return found

        return np.stack([turned(self.head), turned(self.tail)], axis=-1)

    def angles_during_step(self, travel: float, done: float, share: Any) -> np.ndarray:
        """Yaw [rad] of both when ``share`` (0..1), (...), of the step at ``travel`` [m] has been made, (..., 2)."""
        before = self.angles(travel, done)
        return before + np.asarray(share)[..., None] * (self.angles(travel, travel) - before)


def plan_in_time(scene: SceneLayout, end: float) -> tuple[Command, int]:
    """The commands of all steps of a run over ``end`` [m] of travel, and how many of them come before the run-in.

    First the spans hang to rest and the tail pulley finds its place; in the first half of that the belt sticks. Then
    the run-in and the run; the belt stands still for a yaw step, and a while after it. At travel 0 yaw offsets, cants
    and camber set in, as a yaw step does.
    """
    options, parts, plan = scene.options, scene.parts, YawPlan.from_settings(scene.case.settings)
    resting = math.ceil(options.settle / options.step)
    rows: list[Command] = []

    def add(travel: Any, yaw: Any, share: Any, speed: Any, more: Any, drag: tuple[float, float], friction: Any) -> None:
        n = len(travel)
        columns = (travel, yaw, share, speed, more, drag, friction)
        rows.append(Command(*(np.broadcast_to(c, (n, *np.shape(c)[-1:]) if k in (1, 5) else n).astype(float)
                              for k, c in enumerate(columns))))  # fmt: skip

    sticks = np.where(2 * np.arange(resting) > resting, parts.friction, math.inf)
    add(np.full(resting, -scene.early), np.zeros(2), 0.0, 0.0, 0.0, (REST_DRAG, REST_DRAG), sticks)
    travel, speed, done, drag = -scene.early, 0.0, -math.inf, (0.0, options.damping)
    for stop in [*sorted(plan.stops(end) | ({0.0} if parts.sets_in else set())), math.inf]:
        way, speeds = drive(travel, speed, stop, end + 0.5 * options.sample, options)
        gained = np.diff(speeds, prepend=speed) / options.step
        add(way, plan.angles(way, done), float(done >= 0.0), speeds, gained, drag, parts.friction)
        if stop == math.inf or not len(way) or way[-1] != stop:
            break
        travel, speed = stop, 0.0
        passed = options.step * np.arange(1, math.ceil((options.yaw_time + 0.5 * options.settle) / options.step - 1e-9))
        part = smoothstep(passed / options.yaw_time)
        share = np.ones_like(part) if done >= 0.0 else part if stop >= 0.0 else np.zeros_like(part)
        there = np.full(len(part), stop)
        add(there, plan.angles_during_step(stop, done, part), share, 0.0, 0.0, drag, parts.friction)
        done = stop
    return Command(*(np.concatenate(column) for column in zip(*rows, strict=True))), resting


def drive(travel: float, speed: float, stop: float, end: float, options: Options) -> tuple[np.ndarray, np.ndarray]:
    """Travel [m] and speed [m/s] after every step of a belt that goes on until it stands at ``stop`` [m] (inf: nowhere)
    or has reached ``end`` [m]."""
    way, speeds, dt, top, rise = [], [], options.step, options.run_speed, options.acceleration
    braking = (top / rise * 0.5 + 3.0 * dt) * top  # [m], before the stop
    arrived = False
    while not arrived and travel < end:
        ahead = min(end, stop - braking) - travel
        if speed == top and ahead > 0.0:  # at full speed, step after step
            steps = math.ceil(ahead / (top * dt))
            places = np.add.accumulate([travel, *[top * dt] * steps])[1:]
            places = places[: int(np.searchsorted(places, travel + ahead)) + 1]
            way.append(places)
            speeds.append(np.full(len(places), top))
        else:
            travel, speed = accelerate(travel, speed, stop, top, rise, dt)
            way.append(np.array([travel]))
            speeds.append(np.array([speed]))
        travel = float(way[-1][-1])
        arrived = travel == stop
    return np.concatenate([np.empty(0), *way]), np.concatenate([np.empty(0), *speeds])


_RESTING = 4  # rows at rest in which the spans find their places
_TURNING = 4  # rows in which a yaw step is made, and two more after it


def plan_in_travel(settings: Settings, options: Options, travel: float, changes: bool) -> tuple[Command, np.ndarray]:
    """Commands of a run over ``travel`` [m] in rows of k steps, arrays of shape (rows, k, ...), and which rows stand in
    the curves, shape (rows,), with one at rest at travel 0 before the yaw; changes: something besides the yaw sets in
    at 0."""
    yaw = YawPlan.from_settings(settings)
    steps = max(options.steps, math.ceil(options.sample / (MOST_CHORDS * options.dx)))
    commands: list[Command] = []
    recorded: list[bool] = []

    def march(start: float, end: float, done: float) -> None:
        rows = max(math.ceil((end - start) / options.sample - 1e-9), 0)
        places = start + (end - start) * (np.arange(rows * steps) + 1.0) / max(rows * steps, 1)
        commands.extend(Command(s, yaw.angles(s, done), float(done >= 0.0)) for s in places.tolist())
        recorded.extend([start >= 0.0] * rows)

    def rest(at: float, rows: int, counts: bool) -> None:
        commands.extend([Command(at, yaw.angles(at, -math.inf), 0.0)] * (steps * rows))
        recorded.extend([counts] * rows)

    def turn(at: float, done: float) -> None:
        for k in range((_TURNING + 2) * steps):
            part = smoothstep((k + 1) / (_TURNING * steps))
            share = 1.0 if done >= 0.0 else part if at >= 0.0 else 0.0
            commands.append(Command(at, yaw.angles_during_step(at, done, part), share))
        recorded.extend([False] * (_TURNING + 2))

    done, here = -math.inf, -options.run_in
    rest(here, _RESTING, counts=False)
    for stop in sorted({s for s in yaw.stops(travel) if s > 0.0} | {0.0}):
        march(here, stop, done)
        if stop == 0.0:
            rest(0.0, 1, counts=True)
        if stop > 0.0 or changes or 0.0 in yaw.stops(travel):
            turn(stop, done)
            done = stop
        here = stop
    march(here, travel + 0.5 * options.sample, done)  # a row stands for its middle
    columns = (np.array(column, float) for column in zip(*(c[:3] for c in commands), strict=True))
    return Command(*(c.reshape(len(recorded), steps, *c.shape[1:]) for c in columns)), np.array(recorded)


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


@dataclass
class RunState(Motion):
    """What a recorder reads of a belt; of arrays of two the first is the head pulley's.

    joints, joint_rates: of the pulleys, in the order of machine.HEAD_YAW ...; pulleys: where they are and the stations
    on them; slip: of these; travel [m], speed [m/s]: of the belt; yaw [rad], shape (2,): commanded; share [1]: how much
    of yaw offsets, cants and camber acts; time [s].
    """

    pulleys: BeltOnPulley
    slip: SlipState
    travel: float
    yaw: np.ndarray = field(default_factory=lambda: np.zeros(2))
    share: float = 0.0
    speed: float = 0.0
    time: float = 0.0

    @property
    def tail_x(self) -> float:
        """Place of the tail pulley along the machine [m]."""
        return float(self.pulleys.pose.centre[TAIL, 0])

    def read(self, arrays: BeltArrays, nodes: np.ndarray) -> np.ndarray:
        """What ``reading`` says of it, shape (17,)."""
        wraps = self.pulleys.wrap
        return np.asarray(_reading(arrays, nodes, wraps.first, wraps.last, self.tail_x, self.share))


class FrameKeeper:
    """An observer that keeps the frames of a case of a batch, for the observers of its own run afterwards."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []

    def start(self, case: Case, travel: float) -> None:
        """A run begins."""
        self.frames.clear()

    def frame(self, frame: Frame) -> None:
        """Keep it, in half the memory."""
        left, right = (np.asarray(edge, np.float32) for edge in (frame.left, frame.right))
        self.frames.append(replace(frame, left=left, right=right))

    def finish(self, curves: Curves) -> None:
        """Nothing to close."""


class Computed(NamedTuple):
    """What a batch has found for a case: its curves, or why it failed, and frames if it was watched."""

    curves: Curves | SimulationError
    frames: Sequence[Frame] = ()

    def replay(self, observers: Sequence[Observer], case: Case, travel: float) -> Curves:
        """The curves, once the observers have seen the frames; raises the failure."""
        watching = [o for o in observers if self.frames and not getattr(o, "live_only", False)]
        failed = isinstance(self.curves, SimulationError)
        curves: Any = self.curves.curves if isinstance(self.curves, SimulationError) else self.curves
        with notify_observers(watching, case, travel, lambda: curves):
            for frame in self.frames:
                for observer in watching:
                    observer.frame(frame)
            if failed:
                raise self.curves  # type: ignore[misc]
        return curves  # type: ignore[no-any-return]


TOLD_EVERY = 200  # steps


def tell_share(observers: Sequence[Observer], share: float) -> None:
    """Tell observers who want to know (``advance``) which share of a run's steps has been made."""
    for observer in observers:
        if advance := getattr(observer, "advance", None):
            advance(share)


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
        return state.read(self.arrays, self.scene.mesh.nodes(state.slides))

    def begin(self, state: RunState) -> None:
        """Travel 0 has been reached: y counts from here."""
        self.rows.append(self._read(state, 0.0))
        self.next_row = self.scene.options.sample
        self._frame(state, self.rows[0])

    def is_due(self, travel: float) -> bool:
        """Whether ``step`` will read the belt at this travel [m], from travel 0 on."""
        return travel >= self.next_reading

    def step(self, state: RunState) -> None:
        """Called after every step of the run-in and the run; a belt that stands for a yaw step is in no row."""
        self.steps += 1
        if not self.is_due(state.travel) or (self.rows and state.speed == 0.0):
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
            self._frame(state, read)

    def end(self, state: RunState) -> None:
        """Hand observers the last instant of a run."""
        if self.observers and self.rows and state.travel > self.next_frame - self.scene.options.frame:
            self._frame(state, self._read(state, state.travel))

    def _read(self, state: RunState, travel: float) -> np.ndarray:
        read = self.reading(state)
        if not np.all(np.isfinite(read)):
            raise SimulationError(f"positions are not finite at travel {travel:.2f} m: halve model.dt")
        if np.abs(read[POINTS]).max() > RUNAWAY * float(self.scene.case.belt.width):
            where = int(np.argmax(np.abs(read[POINTS]))) + 1
            raise SimulationError(
                f"y at point {where} = {read[where - 1]:.3f} m at travel {travel:.2f} m: the belt has run off its "
                "pulleys; turn the yaw back earlier or shorten travel"
            )
        slip = state.slip
        return np.concatenate([read, slip.total, slip.sliding, [state.tail_x, self.steps, state.speed, travel]])

    def _frame(self, state: RunState, read: np.ndarray) -> None:
        self.next_frame = state.travel + self.scene.options.frame
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


_BYTES = 900  # of a case, a station and a pair of lines: 0.72-0.85 GB measured for 256 cases of the full rig
_SMALL_GPU = 4e9  # bytes, where it does not say
_MOST = 256  # cases of a chunk on one GPU: more are no faster, and more is lost when it is stopped


@dataclass(frozen=True)
class BatchEngine:
    """The entries of an engine on JAX.

    refuse(belt, options, parts): raises CannotRepresent for what the engine cannot do. lay_case(case, belt, travel,
    options, parts, features): a case that the engine can run, with its ``kind`` and the ``stations`` of its mesh.
    in_batches(cases, chunk, ...): curves of cases of one kind, which are run at once, chunk by chunk.
    """

    refuse: Callable[[str, Options, SceneParts], None]
    lay_case: Callable[[Case, str, float, Options, SceneParts, ActiveFeatures], Any]
    in_batches: Callable[..., Iterator[list[Curves | SimulationError]]]

    def prepare_case(
        self,
        case: Case,
        *,
        belt: str = "flex",
        travel: float,
        options: Options | None = None,
        parts: SceneParts | None = None,
        features: ActiveFeatures | None = None,
    ) -> Any:
        """A case that is to be run over ``travel`` [m]; features: in its batch, None = in this case.

        Raises CannotRepresent for what the engine cannot do.
        """
        options = options or Options()
        parts = parts or SceneParts.from_case(case, options.friction)
        self.refuse(belt, options, parts)
        return self.lay_case(case, belt, travel, options, parts, features or active_features([parts]))

    def simulate_batch(
        self,
        cases: Sequence[Case],
        *,
        belt: str = "flex",
        travel: float,
        options: Options | None = None,
        parts: Sequence[SceneParts] | None = None,
        chunk: int | None = None,
        observers: Sequence[Sequence[Observer]] = (),
    ) -> list[Curves | SimulationError]:
        """Curves of all cases, in order, over ``travel`` [m], at most ``chunk`` of them at once (None: as many as fit).

        Cases may differ in everything but the mesh: tension [Pa], yaw schedules [rad], effects (parts), material. A
        case that fails is a SimulationError, with the curves so far in its ``curves``, and stops no other. observers:
        of each case, or of the first few (engine=mjx). Raises InputError for meshes with unlike numbers of stations.
        """
        options = options or Options()
        parts = parts or [SceneParts.from_case(case, options.friction) for case in cases]
        features = active_features(parts)
        ready = [
            self.prepare_case(c, belt=belt, travel=travel, options=options, parts=p, features=features)
            for c, p in zip(cases, parts, strict=True)
        ]
        if len({r.kind for r in ready}) > 1:
            counts = sorted({r.stations for r in ready})
            raise InputError("cases", f"{counts} stations", "", "give cases of one mesh and direction to a batch")
        return [found for some in self.in_batches(ready, chunk, observers) for found in some]

    def simulate(
        self, case: Case, *, parts: SceneParts | None = None, observers: Sequence[Observer] = (), **run: Any
    ) -> Curves:
        """Curves of one case; run: as of ``simulate_batch``. y = 0 at travel 0.

        Raises SimulationError when it diverges.
        """
        several = None if parts is None else [parts]
        found = self.simulate_batch([case], parts=several, observers=[observers] if observers else (), **run)[0]
        if isinstance(found, SimulationError):
            raise found
        return found


def cases_per_chunk(stations: int, lines: int) -> int:
    """Cases at once on one device: on a GPU what half of its memory holds, but at most _MOST; on a CPU one, as more
    gain nothing there."""
    device = jax.devices()[0]
    if device.platform == "cpu":
        return 1
    memory = (device.memory_stats() or {}).get("bytes_limit", _SMALL_GPU)
    return max(min(int(0.5 * memory / (_BYTES * stations * lines**2)), _MOST), 1)


def is_on_pulleys(rows: np.ndarray, width: float | np.ndarray) -> np.ndarray:
    """Which rows of readings (k, 17 or more) are finite and of a belt of ``width`` [m] that is still on its pulleys."""
    return np.isfinite(rows).all(axis=1) & (np.abs(rows[:, POINTS]).max(axis=1) < RUNAWAY * width)


def failure_with(curves: Curves, why: str) -> SimulationError:
    """A SimulationError that carries the curves so far; ``why`` may name {where}, the last travel in them."""
    where = f"after {curves.travel[-1] if len(curves.travel) else 0.0:.2f} m"
    failure = SimulationError(why.format(where=where))
    failure.curves = curves
    return failure
