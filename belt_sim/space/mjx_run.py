"""Runs of the 3D belt on MJX: one case, or a batch of cases of one mesh at once."""

import math
from collections.abc import Hashable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from types import SimpleNamespace

import jax
import numpy as np

from belt_sim.case import Case
from belt_sim.case import Numbers as Array
from belt_sim.curves import Curves, Observer
from belt_sim.errors import CannotRepresent, SimulationError
from belt_sim.jax_setup import in_float64
from belt_sim.scene_parts import SceneParts
from belt_sim.space.belt import ActiveFeatures
from belt_sim.space.loop import stations_of
from belt_sim.space.machine import SceneLayout
from belt_sim.space.mjx import READING, MjxData, MjxModel, PreparedCase, nodes_of, prepare, stack_cases, step
from belt_sim.space.options import Options, fit_options, is_limp
from belt_sim.space.run import (
    BatchEngine,
    Command,
    cases_per_chunk,
    curves_of,
    failure_with,
    frame_of,
    is_on_pulleys,
    notify_observers,
    plan_in_time,
    tell_share,
)

SEGMENT = 50  # steps of one compiled call: at most 0.1 m of travel at 1 ms and 2 m/s


def refuse(belt: str, options: Options, parts: SceneParts) -> None:
    """Raise CannotRepresent for what engine=mjx does not do."""
    why = None
    if is_limp(belt, options):
        why = f"model = mujoco_{belt} without bending stiffness"
    if why is not None:
        raise CannotRepresent(f"{why}: engine=mjx cannot do this; use engine=native")


@dataclass(frozen=True)
class TimeCase:
    """A case that is to be run over ``travel`` [m], prepared together with others of its kind."""

    case: Case
    belt: str
    travel: float
    options: Options
    parts: SceneParts
    features: ActiveFeatures

    def __post_init__(self) -> None:
        fit_options(self.options, self.case, "flex", "mjx")  # here, what it refuses stops no other case of a batch

    @property
    def stations(self) -> int:
        return stations_of(self.case, self.options.dx)

    @property
    def kind(self) -> Hashable:
        """Cases of one kind can be run at once."""
        direction = math.copysign(1.0, float(self.case.settings.direction))
        options = replace(self.options, belt_speed=None)
        return self.belt, self.stations, direction, options, self.features, self.travel


def in_batches(
    cases: Sequence[TimeCase], chunk: int | None, observers: Sequence[Sequence[Observer]] = ()
) -> Iterator[list[Curves | SimulationError]]:
    """Curves of cases of one kind, chunk by chunk; observers: of each case, or none; see BatchEngine."""
    one = cases[0]
    size = min(chunk or cases_per_chunk(one.stations, one.options.across), len(cases))
    for begin in range(0, len(cases), size):
        some = cases[begin : begin + size]
        parts = [c.parts for c in some]
        ready = prepare([c.case for c in some], belt=one.belt, options=one.options, parts=parts, features=one.features)
        yield run(ready, one.travel, observers[begin : begin + size])


@in_float64
def run(
    ready: Sequence[PreparedCase], travel: float, observers: Sequence[Sequence[Observer]] = ()
) -> list[Curves | SimulationError]:
    """Curves of cases of one mesh over ``travel`` [m]; observers: of each case, or of the first few.

    Readings are fetched while the next segment runs.
    """
    models, axes = stack_cases([r.model for r in ready])
    data = jax.tree.map(lambda *v: np.stack([np.asarray(x) for x in v]), *[carried_state(r.data) for r in ready])
    models, still, data = jax.device_put((models, ready[0].data.mjx, data))
    plans, march = [plan_of(r.scene, travel) for r in ready], compile_batch(axes)
    steps, widths = np.array([len(p.travel) for p in plans]), np.array([float(r.case.belt.width) for r in ready])
    options = [r.scene.options for r in ready[: len(observers)]]
    segment = min([SEGMENT, *(max(int(o.frame / (o.step * o.run_speed)), 1) for o in options)])  # a frame at each end
    plan, found = padded(plans, segment * math.ceil(steps.max() / segment)), [np.empty((len(ready), 0, 20))]
    watched = [(k, Watched(ready[k], tuple(own))) for k, own in enumerate(observers) if own]

    def curves(k: int) -> Curves | SimulationError:
        return curves_of_steps(ready[k], plans[k], np.concatenate([part[k] for part in found]))

    with ExitStack() as stack:
        for k, one in watched:
            so_far = partial(lambda k: unfailed(curves(k)), k)
            stack.enter_context(notify_observers(one.observers, one.ready.case, travel, so_far))
        pending = None
        for begin in range(0, len(plan.travel[0]), segment):
            now = slice(begin, begin + segment)
            data, reads = march(models, still, data, jax.tree.map(lambda c, now=now: c[:, now], plan))
            if pending is not None:
                found.append(np.asarray(pending))
                if not is_on_pulleys(found[-1][:, -1], widths).any():
                    break
            places = np.asarray(data.mjx[0]) if watched else ()
            for k, one in watched:
                tell_share(one.observers, begin / len(plan.travel[0]))
                if now.stop <= steps[k]:
                    one.show(places[k], np.asarray(reads[k, -1]), now.stop, plan.yaw[k, now.stop - 1])
            pending = reads
        found.append(np.asarray(pending))
    return [curves(k) for k in range(len(ready))]


def padded(plans: Sequence[Command], steps: int) -> Command:
    """The commands of all cases in so many steps, (cases, steps, ...); a run that has ended keeps its last command."""

    def fill(*columns: np.ndarray) -> np.ndarray:
        found = np.empty((len(columns), steps, *columns[0].shape[1:]))
        for row, column in zip(found, columns, strict=True):
            row[: len(column)], row[len(column) :] = column, column[-1]
        return found

    return jax.tree.map(fill, *plans)


def plan_of(scene: SceneLayout, travel: float) -> Command:
    """The commands of all steps of a run over ``travel`` [m], leading axis (steps,)."""
    return plan_in_time(scene, travel)[0]


@dataclass
class Watched:
    """A case whose observers get a frame after every ``options.frame`` of travel, from travel 0 on, where a segment
    ends."""

    ready: PreparedCase
    observers: tuple[Observer, ...]
    next_frame: float = 0.0

    def show(self, qpos: np.ndarray, read: np.ndarray, steps: int, yaw: np.ndarray) -> None:
        """Hand on the belt after ``steps`` steps; read, (20,): of the last."""
        scene, (tail_x, travel, speed) = self.ready.scene, (float(v) for v in read[17:])
        if travel < self.next_frame or not is_on_pulleys(read[None], float(self.ready.case.belt.width))[0]:
            return
        self.next_frame += scene.options.frame * math.ceil((travel - self.next_frame + 1e-12) / scene.options.frame)
        slides = np.moveaxis(np.asarray(nodes_of(self.ready.model.belt.shape, qpos)), -1, 0)
        scalars = {"tail_x": tail_x, "steps": float(steps), "belt_speed": speed}
        now = SimpleNamespace(slides=slides, travel=travel, time=steps * scene.options.step, yaw=yaw)
        frame = frame_of(scene, read[:17], now, scalars)
        for observer in self.observers:
            observer.frame(frame)


def unfailed(found: Curves | SimulationError) -> Curves:
    """The curves of a run, those so far of a failed one."""
    return found.curves if isinstance(found, SimulationError) else found  # type: ignore[return-value]


def carried_state(data: MjxData) -> MjxData:
    """Without what MJX computes anew every step: the carry of a loop of steps is small."""
    return data._replace(mjx=(data.mjx.qpos, data.mjx.qvel, data.mjx.time))


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


def curves_of_steps(ready: PreparedCase, plan: Command, table: np.ndarray) -> Curves | SimulationError:
    """Curves of the steps made so far, means over options.sample of travel, or a failure that has those before it.

    plan: commands of all steps; table, (steps, 20): readings of those that were made, and perhaps more.
    """
    table = table[: len(plan.travel)]
    good = is_on_pulleys(table, float(ready.case.belt.width))
    steps = len(table) if good.all() else int(np.argmin(good))
    begin, sample = int(np.argmax(plan.travel >= 0.0)), ready.scene.options.sample
    count = int(plan.travel[-1] / sample + 1e-9) + 1
    row = np.ceil(plan.travel / sample - 1e-9).astype(int)[:steps]
    used = np.flatnonzero((np.arange(steps) > begin) & (plan.speed[:steps] > 0.0) & (row >= 1) & (row < count))
    rows = row[used]  # they do not fall, so that each row's steps lie together
    starts = np.flatnonzero(np.diff(rows, prepend=0))
    whole = (
        [table[begin - 1] * np.where(np.arange(table.shape[1]) == READING["travel"], 0.0, 1.0)]
        if steps >= begin
        else []
    )
    if len(used):
        means = np.add.reduceat(table[used], starts) / np.diff(starts, append=len(used))[:, None]
        present = rows[starts]
        whole += list(means[: int(np.argmin(np.append(present == np.arange(1, len(present) + 1), False)))])
    t = np.array(whole).reshape(-1, table.shape[1]).T
    curves = curves_of(t, t[READING["travel"]], {"tail_x": t[READING["tail_x"]], "belt_speed": t[READING["speed"]]})
    if steps == len(table):
        return curves
    why = "the belt ran off its pulleys or its motion grew without bound {where}: turn the yaw back earlier, "
    return failure_with(curves, why + "shorten travel, or halve model.dt")


ENGINE = BatchEngine(refuse, TimeCase, in_batches)
simulate, simulate_batch = ENGINE.simulate, ENGINE.simulate_batch
