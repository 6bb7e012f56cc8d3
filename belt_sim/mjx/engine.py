"""Runs of the 3D belt on MJX: one case, or a batch of cases of one mesh at once."""

import math
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace

import jax
import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.errors import CannotRepresent, SimulationError
from belt_sim.frame import Observer
from belt_sim.jax_setup import in_float64
from belt_sim.mjx.mjx_interface import stack_cases
from belt_sim.mjx.model import (
    READING,
    Command,
    CommandPlan,
    MjxData,
    MjxModel,
    PreparedCase,
    nodes_of,
    plan_run,
    prepare,
)
from belt_sim.mjx.time_step import step
from belt_sim.mujoco3d.batch import BatchEngine, cases_per_chunk, failure_with, is_on_pulleys
from belt_sim.mujoco3d.belt import ActiveFeatures
from belt_sim.mujoco3d.options import Options, is_limp
from belt_sim.mujoco3d.recording import curves_of, frame_of
from belt_sim.pytrees import Numbers as Array
from belt_sim.scene_parts import SceneParts

SEGMENT = 50  # steps of one compiled call: at most 0.1 m of travel at 1 ms and 2 m/s


def refuse(belt: str, options: Options, parts: SceneParts) -> None:
    """Raise CannotRepresent for what engine=mjx does not do."""
    why = None
    if is_limp(belt, options):
        why = f"model = mujoco_{belt} without bending stiffness"
    elif math.isfinite(parts.friction):
        why = f"options.friction = {parts.friction:g}"
    elif options.tensioning == "koller":
        why = "model.tensioning = koller"
    if why is not None:
        raise CannotRepresent(f"{why}: engine=mjx cannot do this; use engine=native")


@dataclass(frozen=True)
class TimeCase:
    """A case that is to be run: what it takes to prepare it with others of its mesh."""

    case: Case
    belt: str
    travel: float
    options: Options
    parts: SceneParts
    features: ActiveFeatures
    stations: int
    kind: Hashable


def lay_case(
    case: Case, belt: str, travel: float, options: Options, parts: SceneParts, features: ActiveFeatures
) -> TimeCase:
    """A case to be run over ``travel`` [m]; see BatchEngine."""
    from belt_sim.mujoco3d.loop import lay_loop

    stations = len(lay_loop(replace(case, rig=replace(case.rig, gravity=parts.gravity)), options.dx).x)
    direction = math.copysign(1.0, float(case.settings.direction))
    kind = belt, stations, direction, replace(options, belt_speed=None), features, travel
    return TimeCase(case, belt, travel, options, parts, features, stations, kind)


def in_batches(
    wanted: Sequence[TimeCase], chunk: int | None, observers: Sequence[Observer] = ()
) -> Iterator[list[Curves | SimulationError]]:
    """Curves of cases of one kind, chunk by chunk; see BatchEngine."""
    size = min(chunk or cases_per_chunk(wanted[0].stations, wanted[0].options.across), len(wanted))
    for begin in range(0, len(wanted), size):
        some = wanted[begin : begin + size]
        one = some[0]
        ready = prepare(
            [w.case for w in some],
            belt=one.belt,
            options=one.options,
            parts=[w.parts for w in some],
            features=one.features,
        )
        yield run(ready, [plan_run(r.scene, one.travel) for r in ready], one.travel, observers)


@in_float64
def run(
    ready: Sequence[PreparedCase], plans: Sequence[CommandPlan], travel: float, observers: Sequence[Observer] = ()
) -> list[Curves | SimulationError]:
    """Curves of cases of one mesh by their plans; observers watch the first."""
    models, axes = stack_cases([r.model for r in ready])
    data = jax.tree.map(lambda *v: np.stack([np.asarray(x) for x in v]), *[carried_state(r.data) for r in ready])
    still = ready[0].data.mjx
    steps = SEGMENT * math.ceil(max(len(p.commands.travel) for p in plans) / SEGMENT)
    commands = Command(*(np.stack(v) for v in zip(*(_pad_commands(p.commands, steps) for p in plans), strict=True)))
    records = [CurveRecord(r, p) for r, p in zip(ready, plans, strict=True)]
    models, still, data = jax.device_put((models, still, data))
    march = compile_batch(axes)
    watched = ObserverFeed(ready[0], tuple(observers), travel)
    try:
        for begin in range(0, steps, SEGMENT):
            here = Command(*(c[:, begin : begin + SEGMENT] for c in commands))
            data, reads = march(models, still, data, here)
            table = np.asarray(reads)
            for record, rows in zip(records, table, strict=True):
                record.add(begin, rows)
            watched.look(records[0], data, table[0, -1], here.yaw[0, -1], begin + SEGMENT)
            if all(record.is_done for record in records):
                break
    finally:
        watched.finish(records[0])
    return [record.result() for record in records]


def carried_state(data: MjxData) -> MjxData:
    """Without what MJX computes anew every step: the carry of a loop of steps is small."""
    return data._replace(mjx=(data.mjx.qpos, data.mjx.qvel, data.mjx.time))


def _pad_commands(commands: Command, steps: int) -> Command:
    """Commands of ``steps`` steps, the last of which stand still."""
    more = steps - len(commands.travel)
    last = Command(*(np.repeat(c[-1:], more, 0) for c in commands))
    last = last._replace(speed=0.0 * last.speed, acceleration=0.0 * last.acceleration)
    return Command(*(np.concatenate([c, e]) for c, e in zip(commands, last, strict=True)))


_FUNCTIONS: dict[Hashable, object] = {}


def compile_batch(axes: object):
    """``march`` for a batch whose models differ by ``axes``; made once, so that JAX compiles it once."""
    leaves, structure = jax.tree.flatten(axes, is_leaf=lambda v: v is None)
    key = tuple(leaves), structure
    if key not in _FUNCTIONS:
        _FUNCTIONS[key] = jax.jit(jax.vmap(run_steps, in_axes=(axes, None, 0, 0)), donate_argnums=2)
    return _FUNCTIONS[key]


def run_steps(model: MjxModel, still: object, data: MjxData, commands: Command) -> tuple[MjxData, Array]:
    """The data of one case after several steps, and its readings (steps, 20); its mjx is (qpos, qvel, time).

    still: MJX's data of any instant, for what a step computes anew.
    """

    def one(data: MjxData, command: Command) -> tuple[MjxData, Array]:
        qpos, qvel, time = data.mjx
        whole = data._replace(mjx=still.replace(qpos=qpos, qvel=qvel, time=time))  # type: ignore[attr-defined]
        after = step(model, whole, command)
        return carried_state(after), after.reading

    return jax.lax.scan(one, data, commands)


class CurveRecord:
    """Readings of one case as rows of curves: means over options.sample of travel."""

    def __init__(self, ready: PreparedCase, plan: CommandPlan) -> None:
        self.width, self.begin, self.steps = float(ready.case.belt.width), plan.begin, len(plan.commands.travel)
        sample, travel, speed = ready.scene.options.sample, plan.commands.travel, plan.commands.speed
        row = np.ceil(travel / sample - 1e-9).astype(int)
        moving = (np.arange(self.steps) > plan.begin) & (speed > 0.0) & (row >= 1)
        self.row = np.where(moving, row, -1)
        count = int(travel[-1] / sample + 1e-9) + 1
        self.row[self.row >= count] = -1
        self.sums, self.counts = np.zeros((count, 20)), np.zeros(count)
        self.failed, self.last = False, 0

    def add(self, begin: int, rows: np.ndarray) -> None:
        """Readings (steps, 20) of steps from number ``begin`` on."""
        if self.failed:
            return
        numbers = begin + np.arange(len(rows))
        due = numbers < self.steps
        good = is_on_pulleys(rows, self.width)
        if not good[due].all():
            self.failed = True
            due &= np.cumsum(~good) == 0
        if begin <= self.begin - 1 < begin + len(rows) and due[self.begin - 1 - begin]:
            self.sums[0], self.counts[0] = rows[self.begin - 1 - begin], 1.0
            self.sums[0, READING["travel"]] = 0.0
        k = self.row[numbers[due]]
        np.add.at(self.sums, k[k > 0], rows[due][k > 0])
        np.add.at(self.counts, k[k > 0], 1.0)
        self.last = begin + len(rows)

    @property
    def is_done(self) -> bool:
        """Nothing more is to be recorded."""
        return self.failed or self.last >= self.steps

    def curves(self) -> Curves:
        """So far."""
        full = int(np.argmin(self.counts > 0)) if not (self.counts > 0).all() else len(self.counts)
        t = (self.sums[:full] / self.counts[:full, None]).T
        return curves_of(t, t[READING["travel"]], {"tail_x": t[READING["tail_x"]], "belt_speed": t[READING["speed"]]})

    def result(self) -> Curves | SimulationError:
        """The curves, or a failure that has those so far."""
        if not self.failed:
            return self.curves()
        why = "the belt ran off its pulleys or its motion grew without bound {where}: turn the yaw back earlier, "
        return failure_with(self.curves(), why + "shorten travel, or halve options.dt")


@dataclass
class ObserverFeed:
    """Hands frames of one case to its observers, one for every segment of steps."""

    ready: PreparedCase
    observers: tuple[Observer, ...]
    travel: float

    def __post_init__(self) -> None:
        for observer in self.observers:
            observer.start(self.ready.case, self.travel)

    def look(self, record: CurveRecord, data: MjxData, read: np.ndarray, yaw: np.ndarray, steps: int) -> None:
        """After the step that has read ``read`` (20,)."""
        travel = float(read[READING["travel"]])
        if not self.observers or travel < 0.0 or record.failed or not record.counts[0] or steps > record.steps:
            return
        model = self.ready.model
        slides = np.moveaxis(np.asarray(nodes_of(model.shape, np.asarray(data.mjx[0])[0])), -1, 0)
        tail_x, _, speed = (float(v) for v in read[17:])
        scalars = {"tail_x": tail_x, "steps": float(steps), "belt_speed": speed}
        frame = frame_of(
            self.ready.scene, read[:17], slides, travel, steps * self.ready.scene.options.dt, yaw, tail_x, scalars
        )
        for observer in self.observers:
            observer.frame(frame)

    def finish(self, record: CurveRecord) -> None:
        """The run has ended."""
        for observer in self.observers:
            observer.finish(record.curves())


ENGINE = BatchEngine(refuse, lay_case, in_batches)
simulate, simulate_batch = ENGINE.simulate, ENGINE.simulate_batch
