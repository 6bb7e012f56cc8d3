"""A run of the 3D belt around the steps of its engine: a plan of what every step is to reach, in time or in travel; a
recorder, which makes curves and frames of readings; one batch wrapper on JAX."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case, Settings
from belt_sim.case import Numbers as Array
from belt_sim.curves import Curves, Frame, Observer
from belt_sim.errors import InputError, SimulationError
from belt_sim.scene_parts import SceneParts
from belt_sim.space.belt import ActiveFeatures, BeltArrays, active_features
from belt_sim.space.elastic import strains
from belt_sim.space.options import AXIS_STATIONS, MOST_CHORDS, REST_DRAG, RUNAWAY, RUNUP_LINKS, Options
from belt_sim.space.scene import SceneLayout, smoothstep
from belt_sim.space.wrap import HEAD, TAIL


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


class YawPlan:
    """The yaw schedules of the head and the tail pulley, whose steps are made while the belt stands still.

    step_over [m]: travel over which a step is made instead, half of it before its place.
    """

    def __init__(self, settings: Settings, step_over: float = 0.0) -> None:
        self.pulleys: list[list[tuple[float, float, float]]] = []  # at [m], over [m], change [rad]
        for schedule in (settings.yaw_head, settings.yaw):
            at, over, change = (np.asarray(v, float) for v in (schedule.at, schedule.over, schedule.change))
            at, over = np.where(over > 0.0, [at, over], [at - 0.5 * step_over, np.full_like(over, step_over)])
            self.pulleys.append(list(zip(at.tolist(), over.tolist(), change.tolist(), strict=True)))

    def stops(self, until: float) -> set[float]:
        """Travels [m] of the steps before ``until``."""
        return {at for one in self.pulleys for at, over, change in one if over <= 0.0 and change and at < until}

    def angles(self, travel: Any, done: float) -> np.ndarray:
        """Yaw [rad] of both at ``travel`` [m], (...), with the steps up to travel ``done`` [m] made, (..., 2)."""
        found = np.zeros((*np.shape(travel), 2))
        for which, entries in enumerate(self.pulleys):
            for at, over, change in entries:
                part = np.clip((travel - at) / over, 0.0, 1.0) if over > 0.0 else float(at <= done)
                found[..., which] += change * part
        return found

    def turn(self, stop: float, done: float, part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Yaw [rad], (k, 2), while the step at ``stop`` [m] is made by ``part`` [1], (k,), after those up to ``done``;
        and the share [1], (k,), of what sets in at travel 0."""
        before = self.angles(stop, done)
        share = np.ones_like(part) if done >= 0.0 else part if stop >= 0.0 else np.zeros_like(part)
        return before + part[:, None] * (self.angles(stop, stop) - before), share


def plan_in_time(scene: SceneLayout, end: float) -> tuple[Command, int]:
    """The commands of all steps of a run over ``end`` [m] of travel, and how many of them come before the run-in.

    First the spans hang to rest and the tail pulley finds its place; in the first half of that the belt sticks. Then
    the run-in and the run; the belt stands still for a yaw step, and a while after it. At travel 0 yaw offsets, cants
    and camber set in, as a yaw step does.
    """
    options, parts, plan = scene.options, scene.parts, YawPlan(scene.case.settings)
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
        turned, share = plan.turn(stop, done, smoothstep(passed / options.yaw_time))
        add(np.full(len(share), stop), turned, share, 0.0, 0.0, drag, parts.friction)
        done = stop
    return Command(*(np.concatenate(column) for column in zip(*rows, strict=True))), resting


def drive(travel: float, speed: float, stop: float, end: float, options: Options) -> tuple[np.ndarray, np.ndarray]:
    """Travel [m] and speed [m/s] after every step of a belt that goes on until it stands at ``stop`` [m] (inf: nowhere)
    or has reached ``end`` [m]; it arrives exactly."""
    way, speeds, dt, top, rise = [np.empty(0)], [np.empty(0)], options.step, options.run_speed, options.acceleration
    braking = (top / rise * 0.5 + 3.0 * dt) * top  # [m], before the stop
    while travel < end and (travel != stop or len(way) == 1):
        ahead = min(end, stop - braking) - travel
        if speed == top and ahead > 0.0:  # at full speed, step after step
            places = np.add.accumulate([travel, *[top * dt] * math.ceil(ahead / (top * dt))])[1:]
            way.append(places[: int(np.searchsorted(places, travel + ahead)) + 1])
        else:
            allowed = min(top, math.sqrt(2.0 * rise * max(stop - travel, 0.0)) + 0.5 * rise * dt)
            speed = min(speed + rise * dt, allowed)
            arrives = stop - travel <= speed * dt
            way.append(np.array([stop if arrives else travel + speed * dt]))
            speed = 0.0 if arrives else speed
        speeds.append(np.full(len(way[-1]), speed))
        travel = float(way[-1][-1])
    return np.concatenate(way), np.concatenate(speeds)


_RESTING = 4  # rows at rest in which the spans find their places
_TURNING = 4  # rows in which a yaw step is made, and two more after it


def plan_in_travel(settings: Settings, options: Options, travel: float, changes: bool) -> tuple[Command, np.ndarray]:
    """Commands of a run over ``travel`` [m] in rows of k steps, (rows, k, ...), and which rows stand in the curves,
    with one at rest at travel 0 before the yaw; changes: whether something besides the yaw sets in at 0."""
    yaw, pieces, recorded = YawPlan(settings), [], []
    steps = max(options.steps, math.ceil(options.sample / (MOST_CHORDS * options.dx)))

    def add(places: np.ndarray, angles: np.ndarray, share: Any, counts: bool) -> None:
        pieces.append((places, angles, np.broadcast_to(share, places.shape)))
        recorded.extend([counts] * (len(places) // steps))

    done, here = -math.inf, -options.run_in
    resting = np.full(steps * _RESTING, here)
    add(resting, yaw.angles(resting, done), 0.0, False)
    for stop in [*sorted({s for s in yaw.stops(travel) if s > 0.0} | {0.0}), math.inf]:
        end = min(stop, travel + 0.5 * options.sample)  # a row stands for its middle
        count = steps * max(math.ceil((end - here) / options.sample - 1e-9), 0)
        places = here + (end - here) * (np.arange(count) + 1.0) / max(count, 1)
        add(places, yaw.angles(places, done), float(done >= 0.0), here >= 0.0)
        if stop == 0.0:
            add(np.zeros(steps), yaw.angles(np.zeros(steps), -math.inf), 0.0, True)
        if 0.0 < stop < math.inf or (stop == 0.0 and (changes or 0.0 in yaw.stops(travel))):
            part = smoothstep((np.arange((_TURNING + 2) * steps) + 1.0) / (_TURNING * steps))
            add(np.full(len(part), stop), *yaw.turn(stop, done, part), False)
            done = stop
        here = stop
    columns = (np.concatenate(column) for column in zip(*pieces, strict=True))
    return Command(*(c.reshape(len(recorded), steps, *c.shape[1:]) for c in columns)), np.array(recorded)


#: rows of a reading: y of points 1-4 [m], angles there [rad], entry moments [N m], slack-edge stresses [Pa], tilts
#: [rad], sags [m], tension [Pa], x of the tail pulley [m], travel [m], belt speed [m/s]
READING: dict[str, Any] = {
    "y": slice(0, 4), "angle": slice(4, 8), "moment": slice(8, 10), "edge_stress": slice(10, 12),
    "tilt": slice(12, 14), "sag": slice(14, 16), "tension": 16, "tail_x": 17, "travel": 18, "speed": 19,
}  # fmt: skip
POINTS, _, MOMENTS, _, _, _, TENSION_ROW, TAIL_X, TRAVEL_ROW, SPEED = READING.values()


def reading(belt: BeltArrays, nodes: Array, first: Array, last: Array, tail_x: Array, share: Array | float) -> Array:
    """y of points 1-4 [m], their angles [rad], entry moments [N m] and slack-edge stresses [Pa] at the run-ups of the
    upper and lower span, tilts [rad], sags [m], tension [Pa] at the upper run-up, tail_x; shape (18,).

    nodes [m], (m, 3, n); first, last, (2,): ends of the wraps of head and tail; tail_x [m]; share: of the camber.
    """
    n, zero, sign = nodes.shape[-1], 0.0 * tail_x, belt.shape.sign
    # y and dy/ds of the centre line (s along station numbers) where the belt passes the pulley's axis
    y, angles = list[Array](), list[Array]()
    for station, x in ((first[TAIL], tail_x), (last[TAIL], tail_x), (first[HEAD], zero), (last[HEAD], zero)):
        k = (station - AXIS_STATIONS + np.arange(2 * AXIS_STATIONS + 1)) % n
        centre = nodes[:, :, k].mean(axis=0)
        ahead = centre[0] - x
        crosses = ahead[1:-2] * ahead[2:-1] <= 0.0
        i = 1 + jnp.where(crosses.any(), jnp.argmax(crosses), AXIS_STATIONS - 1)
        y.append(centre[1, i] + ahead[i] / (ahead[i] - ahead[i + 1]) * (centre[1, i + 1] - centre[1, i]))
        angles.append(sign * ((centre[1, i + 2] - centre[1, i - 1]) / (3.0 * belt.chord)))

    # tension [N] and in-plane bending moment EI (kappa - kappa_c) [N m], kappa = y'', mean over RUNUP_LINKS
    tensions, moments = list[Array](), list[Array]()
    for station in (first[TAIL], first[HEAD]) if sign > 0 else (last[HEAD], last[TAIL]):
        begin = station - RUNUP_LINKS - 1 if sign > 0 else station + 1
        strain = strains(belt.ties, nodes, (begin + np.arange(RUNUP_LINKS + 1)) % n, share)
        if len(nodes) == 1:
            tensions.append(belt.stiffness[0] * strain[0])
            moments.append(0.0 * strain[0])
            continue
        weight = belt.stiffness * belt.line_y
        tensions.append(belt.stiffness @ strain)
        moments.append(-belt.bending * (weight @ strain) / (weight @ belt.line_y))
    stressed = zip(tensions, moments, strict=True)
    edges = [t / belt.area - 6.0 * abs(m) / (belt.area * belt.width) for t, m in stressed]

    # before the belt has gone round the numbers of the head's wrap lie below the tail's
    lower_head = first[HEAD] + n * jnp.rint((last[TAIL] - first[HEAD]) / n + 0.5).astype(int)
    middles = [((last[HEAD] + first[TAIL]) // 2) % n, ((last[TAIL] + lower_head) // 2) % n]
    across = [nodes[0, :, k] - nodes[-1, :, k] for k in middles]
    heights = [nodes[:, 2, k].mean() for k in middles]
    tilts, sags = [jnp.arctan2(a[2], a[1]) for a in across], [belt.level - heights[0], -belt.level - heights[1]]
    return jnp.stack([*y, *angles, *moments, *edges, *tilts, *sags, tensions[0] / belt.area, tail_x])


#: of a frame, in the order of a reading after its angles
_SCALARS = ("entry_moment_upper", "entry_moment_lower", "edge_stress_upper", "edge_stress_lower", "tilt_upper",
            "tilt_lower", "sag_upper", "sag_lower", "tension")  # fmt: skip


@contextmanager
def notify_observers(
    observers: Sequence[Observer], case: Case, travel: float, curves: Callable[[], Curves], *scene: Any
) -> Iterator[None]:
    """Let observers watch a run over ``travel`` [m] from its start to its end, however it ends; curves: so far, which a
    SimulationError carries on; scene: MjModel and MjData of the run."""
    for observer in observers:
        observer.start(case, travel)
        if scene and (show := getattr(observer, "show", None)):  # the MjModel and the MjData of the run
            show(*scene)
    try:
        yield
    except SimulationError as failure:
        failure.curves = curves()
        raise
    finally:
        for observer in observers:
            observer.finish(curves())


@dataclass
class Computed(Observer):
    """What a batch has found for a case: its curves, or why it failed, and the frames of one that was watched, of which
    it is the observer there; for the observers of the case's own run afterwards."""

    curves: Any = None
    frames: list[Frame] = field(default_factory=list)

    def frame(self, frame: Frame) -> None:
        """Keep it, in half the memory."""
        left, right = (np.asarray(edge, np.float32) for edge in (frame.left, frame.right))
        self.frames.append(replace(frame, left=left, right=right))

    def replay(self, observers: Sequence[Observer], case: Case, travel: float) -> Curves:
        """The curves, once the observers have seen the frames; raises the failure."""
        watching = [o for o in observers if self.frames and not getattr(o, "live_only", False)]
        failure = self.curves if isinstance(self.curves, SimulationError) else None
        curves: Curves = self.curves if failure is None else failure.curves
        with notify_observers(watching, case, travel, lambda: curves):
            for frame in self.frames:
                for observer in watching:
                    observer.frame(frame)
            if failure is not None:
                raise failure
        return curves


TOLD_EVERY = 200  # steps
_READINGS_PER_SAMPLE = 5  # a landing shakes the belt once per station; the curve is the mean over a sample


@dataclass
class Recorder:
    """The readings of a run in time, of which its curves are made, and the frames that its observers get.

    extra: further columns of the curves, by their place in a reading (20 or more,); next_reading [m]: travel from which
    the next one is wanted; a belt that stands for a yaw step has none.
    """

    scene: SceneLayout
    observers: Sequence[Observer]
    extra: Mapping[str, int]
    table: list[np.ndarray] = field(default_factory=list)
    next_reading: float = 0.0
    next_frame: float = 0.0
    last_frame: float = -math.inf

    def add(self, read: np.ndarray, *at: Any) -> None:
        """One more reading, the first at travel 0, from where y counts; raises SimulationError for a lost belt."""
        travel, y = float(read[TRAVEL_ROW]), np.abs(read[POINTS])
        if not np.isfinite(read).all():
            raise SimulationError(f"positions are not finite at travel {travel:.2f} m: halve model.dt")
        if y.max() > RUNAWAY * float(self.scene.case.belt.width):
            where = int(np.argmax(y))
            raise SimulationError(
                f"y at point {where + 1} = {read[where]:.3f} m at travel {travel:.2f} m: the belt has run off its "
                "pulleys; turn the yaw back earlier or shorten travel"
            )
        if self.table:
            self.next_reading = travel + self.scene.options.sample / _READINGS_PER_SAMPLE
        self.table.append(read)
        self.show(read, *at)

    def show(self, read: np.ndarray, slides: np.ndarray, time: float, yaw: np.ndarray, last: bool = False) -> None:
        """Hand observers a frame, if one is due; slides [m], (n, m, 3), of the nodes; time [s]; yaw [rad], (2,)."""
        travel, every = float(read[TRAVEL_ROW]), self.scene.options.frame
        if not self.observers or not (travel >= self.next_frame or (last and travel > self.last_frame)):
            return
        self.last_frame, self.next_frame = travel, travel + every
        scene, tail_x, nodes = self.scene, float(read[TAIL_X]), self.scene.mesh.rest + slides
        centre, half = nodes.mean(axis=1), nodes[:, 0] - nodes.mean(axis=1)
        if scene.mesh.lines > 1:  # the real belt's edges at +b/2 and -b/2, drawn out from the model's lines
            half = half * (0.5 * float(scene.case.belt.width) / scene.mesh.line_y[0])
        left, right = (np.concatenate([edge, edge[:1]]) for edge in (centre + half, centre - half))
        head, tail = scene.loop.radius_head, scene.loop.radius_tail
        points = np.column_stack([[tail_x, tail_x, 0.0, 0.0], read[POINTS], [tail, -tail, -head, head]])
        scalars = dict(zip(_SCALARS, map(float, read[MOMENTS.start : TAIL_X]), strict=True))
        scalars |= {name: float(read[k]) for name, k in self.extra.items()}
        frame = Frame(
            travel=travel, time=time, left=left, right=right, points=points, yaw_head=float(yaw[0]),
            yaw_tail=float(yaw[1]), tail_x=tail_x, scalars=scalars,
        )  # fmt: skip
        for observer in self.observers:
            observer.frame(frame)

    def curves(self) -> Curves:
        """Of the readings so far."""
        return curves_in_time(self.scene, np.array(self.table), self.extra)


def curves_in_time(scene: SceneLayout, table: np.ndarray, extra: Mapping[str, int]) -> Curves:
    """Curves of readings (k, 20 or more) from travel 0 on: means over options.sample of travel, each of which ends with
    the first reading beyond it."""
    if not len(table):
        return curves_of(np.empty((max([SPEED, *extra.values()]) + 1, 0)), extra)
    travel, sample = table[:, TRAVEL_ROW], scene.options.sample
    ends = np.add.accumulate(np.full(int(travel[-1] / sample) + 2, sample))
    row = np.searchsorted(ends, travel[:-1], side="right")
    starts = np.flatnonzero(np.diff(row, prepend=-1))
    means = np.add.reduceat(table[1:], starts) / np.diff(starts, append=len(row))[:, None]
    if len(row) and travel[-1] < ends[row[-1]]:
        means = means[:-1]
    return curves_of(np.concatenate([table[:1], means]).T, extra)


def curves_of(columns: np.ndarray, extra: Mapping[str, int]) -> Curves:
    """Curves from columns of readings (20 or more, k); y counts from the first; extra: more columns, by their place."""
    found = {name: columns[READING[name]] for name in ("travel", "y", "angle", "moment", "edge_stress", "tilt", "sag")}
    found |= {"y": found["y"] - found["y"][:, :1]}
    found |= {"sag": found["sag"].mean(axis=1) if columns.shape[1] else np.zeros(2)}
    return Curves(**found, extra={name: columns[k] for name, k in {"tension": TENSION_ROW, **extra}.items()})


_BYTES = 900  # of a case, a station and a pair of lines: 0.72-0.85 GB measured for 256 cases of the full rig
_MOST = 256  # cases of a chunk on one GPU: more are no faster, and more is lost when it is stopped


@dataclass(frozen=True)
class BatchEngine:
    """The entries of an engine on JAX: lay_case gives a case that it can run, with its ``kind`` and the ``stations`` of
    its mesh, or raises CannotRepresent; in_batches gives curves of cases of one kind, run at once, chunk by chunk."""

    lay_case: Callable[[Case, str, float, Options, SceneParts, ActiveFeatures], Any]
    in_batches: Callable[..., Iterator[list[Curves | SimulationError]]]

    def prepare_case(
        self, case: Case, *, belt: str = "flex", travel: float, options: Options | None = None,
        parts: SceneParts | None = None, features: ActiveFeatures | None = None,
    ) -> Any:  # fmt: skip
        """A case that is to be run over ``travel`` [m]; features: in its batch, None = in this case."""
        options = options or Options()
        parts = parts or SceneParts.from_case(case, options.friction)
        return self.lay_case(case, belt, travel, options, parts, features or active_features([parts]))

    def simulate_batch(
        self, cases: Sequence[Case], *, belt: str = "flex", travel: float, options: Options | None = None,
        parts: Sequence[SceneParts] | None = None, chunk: int | None = None,
        observers: Sequence[Sequence[Observer]] = (),
    ) -> list[Curves | SimulationError]:  # fmt: skip
        """Curves of all cases, in order, over ``travel`` [m], at most ``chunk`` of them at once (None: as many as fit).

        Cases may differ in everything but the mesh. One that fails is a SimulationError, with the curves so far in its
        ``curves``, and stops no other. observers: of each case, or of the first few (engine=mjx). Raises InputError for
        meshes with unlike numbers of stations.
        """
        options = options or Options()
        parts = parts or [SceneParts.from_case(case, options.friction) for case in cases]
        alike: dict[str, Any] = {"belt": belt, "travel": travel, "options": options, "features": active_features(parts)}
        ready = [self.prepare_case(case, parts=own, **alike) for case, own in zip(cases, parts, strict=True)]
        if len({r.kind for r in ready}) > 1:
            counts = sorted({r.stations for r in ready})
            raise InputError("cases", f"{counts} stations", "", "give cases of one mesh and direction to a batch")
        return [found for some in self.in_batches(ready, chunk, observers) for found in some]

    def simulate(
        self, case: Case, *, parts: SceneParts | None = None, observers: Sequence[Observer] = (), **run: Any
    ) -> Curves:
        """Curves of one case, y = 0 at travel 0; run: as of ``simulate_batch``. Raises SimulationError."""
        several = None if parts is None else [parts]
        found = self.simulate_batch([case], parts=several, observers=[observers] if observers else (), **run)[0]
        if isinstance(found, SimulationError):
            raise found
        return found


def cases_per_chunk(stations: int, lines: int) -> int:
    """Cases at once: on a GPU what half of its memory holds, but at most _MOST; on a CPU one, as more gain nothing."""
    device = jax.devices()[0]
    if device.platform == "cpu":
        return 1
    memory = (device.memory_stats() or {}).get("bytes_limit", 4e9)  # of a small GPU, where it does not say
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
