"""Runs of the 3D belt on MJX: one case, or a batch of cases of one mesh at once."""

import math
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace

import jax
import numpy as np

from belt_sim.belt_mechanics.belt import Acting, acting_in
from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.errors import CannotRepresent, InputError, RunFailed
from belt_sim.frame import Observer
from belt_sim.jax_setup import in_float64
from belt_sim.mjx.model import READING, Command, Data, Model, Plan, Prepared, nodes_of, plan_of, prepare
from belt_sim.mjx.mujoco_mjx import stacked
from belt_sim.mjx.step import step
from belt_sim.mujoco3d.constants import RUNAWAY
from belt_sim.mujoco3d.options import Options, is_limp
from belt_sim.mujoco3d.recording import frame_of
from belt_sim.pytree import Numbers as Array
from belt_sim.scene_parts import SceneParts

SEGMENT = 50  # steps of one compiled call: at most 0.1 m of travel at 1 ms and 2 m/s
_BYTES = 900  # of a case, a station and a pair of lines: 740 measured, 0.72 GB for 256 cases of the full rig
_SMALL_GPU = 4e9  # bytes, where it does not say
_MOST = 256  # cases of a chunk on one GPU


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


def simulate(
    case: Case,
    *,
    belt: str = "flex",
    travel: float,
    options: Options | None = None,
    parts: SceneParts | None = None,
    observers: Sequence[Observer] = (),
) -> Curves:
    """Curves of ``case`` over ``travel`` [m]. y = 0 at travel 0. Raises RunFailed when it diverges."""
    several = None if parts is None else [parts]
    found = simulate_batch([case], belt=belt, travel=travel, options=options, parts=several, observers=observers)[0]
    if isinstance(found, RunFailed):
        raise found
    return found


def simulate_batch(
    cases: Sequence[Case],
    *,
    belt: str = "flex",
    travel: float,
    options: Options | None = None,
    parts: Sequence[SceneParts] | None = None,
    chunk: int | None = None,
    observers: Sequence[Observer] = (),
) -> list[Curves | RunFailed]:
    """Curves of every case, in order, run over ``travel`` [m] in chunks of at most ``chunk`` at once (None: that fit).

    Cases may differ in everything but the mesh: tension [Pa], yaw schedules [rad], effects (parts), material. A case
    that fails is a RunFailed, with the curves so far in its ``curves``, and stops no other; observers watch the first.
    Raises InputError for cases whose meshes have unlike numbers of stations.
    """
    options = options or Options()
    parts = parts or [SceneParts.undisturbed(case, options.friction) for case in cases]
    acting = acting_in(parts)
    ready = [
        prepared(c, belt=belt, travel=travel, options=options, parts=p, acting=acting)
        for c, p in zip(cases, parts, strict=True)
    ]
    if len({r.kind for r in ready}) > 1:
        raise InputError("cases", len(cases), "cases", "give cases of one mesh and direction to a batch")
    return [found for some in in_batches(ready, chunk, observers) for found in some]


@dataclass(frozen=True)
class Wanted:
    """A case that is to be run: what it takes to prepare it with others of its mesh."""

    case: Case
    belt: str
    travel: float
    options: Options
    parts: SceneParts
    acting: Acting
    kind: Hashable


def prepared(
    case: Case,
    *,
    belt: str = "flex",
    travel: float,
    options: Options | None = None,
    parts: SceneParts | None = None,
    acting: Acting | None = None,
) -> Wanted:
    """A case to be run over ``travel`` [m]; acting: in its batch, None = in this case.

    Raises CannotRepresent for what this engine cannot do.
    """
    from belt_sim.mujoco3d.loop import laid_loop

    options = options or Options()
    parts = parts or SceneParts.undisturbed(case, options.friction)
    refuse(belt, options, parts)
    acting = acting or acting_in([parts])
    stations = len(laid_loop(replace(case, rig=replace(case.rig, gravity=parts.gravity)), options.dx).x)
    direction = math.copysign(1.0, float(case.settings.direction))
    kind = belt, stations, direction, replace(options, belt_speed=None), acting, travel
    return Wanted(case, belt, travel, options, parts, acting, kind)


def in_batches(
    wanted: Sequence[Wanted], chunk: int | None, observers: Sequence[Observer] = ()
) -> Iterator[list[Curves | RunFailed]]:
    """Curves of cases of one kind, chunk by chunk; see ``simulate_batch``."""
    size = min(chunk or that_fit(wanted[0]), len(wanted))
    for begin in range(0, len(wanted), size):
        some = wanted[begin : begin + size]
        one = some[0]
        ready = prepare(
            [w.case for w in some], belt=one.belt, options=one.options, parts=[w.parts for w in some], acting=one.acting
        )
        yield run(ready, [plan_of(r.scene, one.travel) for r in ready], one.travel, observers)


def that_fit(wanted: Wanted) -> int:
    """Cases at once: on a GPU what half of its memory holds, at most _MOST; on a CPU one, as more gain nothing."""
    device = jax.devices()[0]
    if device.platform == "cpu":
        return 1
    memory = (device.memory_stats() or {}).get("bytes_limit", _SMALL_GPU)
    stations = wanted.kind[1]  # type: ignore[index]
    return max(min(int(0.5 * memory / (_BYTES * stations * wanted.options.across**2)), _MOST), 1)


@in_float64
def run(
    ready: Sequence[Prepared], plans: Sequence[Plan], travel: float, observers: Sequence[Observer] = ()
) -> list[Curves | RunFailed]:
    """Curves of cases of one mesh by their plans; observers watch the first."""
    models, axes = stacked([r.model for r in ready])
    data = jax.tree.map(lambda *v: np.stack([np.asarray(x) for x in v]), *[moving(r.data) for r in ready])
    still = ready[0].data.mjx
    steps = SEGMENT * math.ceil(max(len(p.commands.travel) for p in plans) / SEGMENT)
    commands = Command(*(np.stack(v) for v in zip(*(_padded(p.commands, steps) for p in plans), strict=True)))
    records = [Record(r, p) for r, p in zip(ready, plans, strict=True)]
    models, still, data = jax.device_put((models, still, data))
    march = batch_march(axes)
    watched = Watched(ready[0], tuple(observers), travel)
    try:
        for begin in range(0, steps, SEGMENT):
            here = Command(*(c[:, begin : begin + SEGMENT] for c in commands))
            data, reads = march(models, still, data, here)
            table = np.asarray(reads)
            for record, rows in zip(records, table, strict=True):
                record.add(begin, rows)
            watched.look(records[0], data, table[0, -1], here.yaw[0, -1], begin + SEGMENT)
            if all(record.done for record in records):
                break
    finally:
        watched.finish(records[0])
    return [record.found() for record in records]


def moving(data: Data) -> Data:
    """Without what MJX computes anew every step: the carry of a loop of steps is small."""
    return data._replace(mjx=(data.mjx.qpos, data.mjx.qvel, data.mjx.time))


def _padded(commands: Command, steps: int) -> Command:
    """Commands of ``steps`` steps, the last of which stand still."""
    more = steps - len(commands.travel)
    last = Command(*(np.repeat(c[-1:], more, 0) for c in commands))
    last = last._replace(speed=0.0 * last.speed, acceleration=0.0 * last.acceleration)
    return Command(*(np.concatenate([c, e]) for c, e in zip(commands, last, strict=True)))


_FUNCTIONS: dict[Hashable, object] = {}


def batch_march(axes: object):
    """``march`` for a batch whose models differ by ``axes``; made once, so that JAX compiles it once."""
    leaves, structure = jax.tree.flatten(axes, is_leaf=lambda v: v is None)
    key = tuple(leaves), structure
    if key not in _FUNCTIONS:
        _FUNCTIONS[key] = jax.jit(jax.vmap(march, in_axes=(axes, None, 0, 0)), donate_argnums=2)
    return _FUNCTIONS[key]


def march(model: Model, still: object, data: Data, commands: Command) -> tuple[Data, Array]:
    """The data of one case after several steps, and its readings (steps, 20); its mjx is (qpos, qvel, time).

    still: MJX's data of any instant, for what a step computes anew.
    """

    def one(data: Data, command: Command) -> tuple[Data, Array]:
        qpos, qvel, time = data.mjx
        whole = data._replace(mjx=still.replace(qpos=qpos, qvel=qvel, time=time))  # type: ignore[attr-defined]
        after = step(model, whole, command)
        return moving(after), after.reading

    return jax.lax.scan(one, data, commands)


class Record:
    """Readings of one case as rows of curves: means over options.sample of travel."""

    def __init__(self, ready: Prepared, plan: Plan) -> None:
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
        good = np.isfinite(rows).all(axis=1) & (np.abs(rows[:, :4]).max(axis=1) < RUNAWAY * self.width)
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
    def done(self) -> bool:
        """Nothing more is to be recorded."""
        return self.failed or self.last >= self.steps

    def curves(self) -> Curves:
        """So far."""
        full = int(np.argmin(self.counts > 0)) if not (self.counts > 0).all() else len(self.counts)
        t = (self.sums[:full] / self.counts[:full, None]).T
        fields = {name: t[READING[name]] for name in ("y", "angle", "moment", "edge_stress", "tilt")}
        fields["y"] = fields["y"] - fields["y"][:, :1]
        return Curves(
            travel=t[READING["travel"]],
            sag=t[READING["sag"]].mean(axis=1) if full else np.zeros(2),
            extra={
                "tension": t[READING["tension"]],
                "tail_x": t[READING["tail_x"]],
                "belt_speed": t[READING["speed"]],
            },
            **fields,
        )

    def found(self) -> Curves | RunFailed:
        """The curves, or a failure that has those so far."""
        curves = self.curves()
        if not self.failed:
            return curves
        where = f"{curves.travel[-1] if len(curves.travel) else 0.0:.2f} m"
        failure = RunFailed(
            f"the belt ran off its pulleys or its motion grew without bound after {where}: turn the yaw back earlier, "
            "shorten travel, or halve options.dt"
        )
        failure.curves = curves
        return failure


@dataclass
class Watched:
    """Hands frames of one case to its observers, one for every segment of steps."""

    ready: Prepared
    observers: tuple[Observer, ...]
    travel: float

    def __post_init__(self) -> None:
        for observer in self.observers:
            observer.start(self.ready.case, self.travel)

    def look(self, record: Record, data: Data, read: np.ndarray, yaw: np.ndarray, steps: int) -> None:
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

    def finish(self, record: Record) -> None:
        """The run has ended."""
        for observer in self.observers:
            observer.finish(record.curves())
