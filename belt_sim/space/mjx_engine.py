"""Runs of the 3D belt on MJX: one case, or a batch of cases of one mesh at once."""

import math
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
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
from belt_sim.space.loop import lay_loop
from belt_sim.space.machine import SceneLayout
from belt_sim.space.mjx_interface import stack_cases
from belt_sim.space.mjx_model import READING, MjxData, MjxModel, PreparedCase, nodes_of, prepare
from belt_sim.space.mjx_step import step
from belt_sim.space.options import Options, is_limp
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
)

SEGMENT = 50  # steps of one compiled call: at most 0.1 m of travel at 1 ms and 2 m/s


def refuse(belt: str, options: Options, parts: SceneParts) -> None:
    """Raise CannotRepresent for what engine=mjx does not do."""
    why = None
    if is_limp(belt, options):
        why = f"model = mujoco_{belt} without bending stiffness"
    elif math.isfinite(parts.friction):
        why = f"model.friction = {parts.friction:g}"
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

    @cached_property
    def stations(self) -> int:
        rig = replace(self.case.rig, gravity=self.parts.gravity)
        return len(lay_loop(replace(self.case, rig=rig), self.options.dx).x)

    @property
    def kind(self) -> Hashable:
        """Cases of one kind can be run at once."""
        direction = math.copysign(1.0, float(self.case.settings.direction))
        options = replace(self.options, belt_speed=None)
        return self.belt, self.stations, direction, options, self.features, self.travel


def in_batches(
    cases: Sequence[TimeCase], chunk: int | None, observers: Sequence[Observer] = ()
) -> Iterator[list[Curves | SimulationError]]:
    """Curves of cases of one kind, chunk by chunk; see BatchEngine."""
    one = cases[0]
    size = min(chunk or cases_per_chunk(one.stations, one.options.across), len(cases))
    for begin in range(0, len(cases), size):
        some = cases[begin : begin + size]
        parts = [c.parts for c in some]
        ready = prepare([c.case for c in some], belt=one.belt, options=one.options, parts=parts, features=one.features)
        yield run(ready, one.travel, observers)


@in_float64
def run(
    ready: Sequence[PreparedCase], travel: float, observers: Sequence[Observer] = ()
) -> list[Curves | SimulationError]:
    """Curves of cases of one mesh over ``travel`` [m]; observers watch the first, a frame for every SEGMENT steps."""
    models, axes = stack_cases([r.model for r in ready])
    data = jax.tree.map(lambda *v: np.stack([np.asarray(x) for x in v]), *[carried_state(r.data) for r in ready])
    models, still, data = jax.device_put((models, ready[0].data.mjx, data))
    plans, march = [plan_of(r.scene, travel) for r in ready], compile_batch(axes)
    readings: list[list[np.ndarray]] = [[] for _ in ready]
    widths = [float(r.case.belt.width) for r in ready]

    def first_curves() -> Curves:
        found = curves_of_steps(ready[0], plans[0], readings[0])
        return found.curves if isinstance(found, SimulationError) else found

    with notify_observers(observers, ready[0].case, travel, first_curves):
        for begin in range(0, max(len(p.travel) for p in plans), SEGMENT):
            commands = segment_of(plans, begin)
            data, reads = march(models, still, data, commands)
            for rows, new in zip(readings, np.asarray(reads), strict=True):
                rows.append(new)
            if begin + SEGMENT <= len(plans[0].travel):
                show_frame(observers, ready[0], data, readings[0], commands.yaw[0, -1])
            if all(not is_on_pulleys(r[-1], w).all() for r, w in zip(readings, widths, strict=True)):
                break
    return [curves_of_steps(*of) for of in zip(ready, plans, readings, strict=True)]


def plan_of(scene: SceneLayout, travel: float) -> Command:
    """The commands that ``step`` reads, of all steps of a run over ``travel`` [m], leading axis (steps,)."""
    return plan_in_time(scene, travel)[0]._replace(friction=None)


def segment_of(plans: Sequence[Command], begin: int) -> Command:
    """Commands of SEGMENT steps of all cases from step ``begin`` on; a run that has ended keeps its last command."""
    steps = np.arange(begin, begin + SEGMENT)
    return jax.tree.map(lambda *of: np.stack([c[np.minimum(steps, len(c) - 1)] for c in of]), *plans)


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


def curves_of_steps(ready: PreparedCase, plan: Command, readings: Sequence[np.ndarray]) -> Curves | SimulationError:
    """Curves of the steps made so far, means over options.sample of travel, or a failure that has those before it.

    plan: commands of all steps; readings, (steps, 20) each: one segment after another.
    """
    table = np.concatenate([np.empty((0, len(ready.data.reading))), *readings])[: len(plan.travel)]
    good = is_on_pulleys(table, float(ready.case.belt.width))
    steps = len(table) if good.all() else int(np.argmin(good))
    begin, sample = int(np.argmax(plan.travel >= 0.0)), ready.scene.options.sample
    count = int(plan.travel[-1] / sample + 1e-9) + 1
    row = np.ceil(plan.travel / sample - 1e-9).astype(int)[:steps]
    used = (np.arange(steps) > begin) & (plan.speed[:steps] > 0.0) & (row >= 1) & (row < count)
    sums, counts = np.zeros((count, table.shape[1])), np.zeros(count)
    if steps >= begin:
        sums[0], counts[0] = table[begin - 1], 1.0
        sums[0, READING["travel"]] = 0.0
    np.add.at(sums, row[used], table[:steps][used])
    np.add.at(counts, row[used], 1.0)
    full = count if counts.all() else int(np.argmin(counts > 0.0))
    t = (sums[:full] / counts[:full, None]).T
    curves = curves_of(t, t[READING["travel"]], {"tail_x": t[READING["tail_x"]], "belt_speed": t[READING["speed"]]})
    if steps == len(table):
        return curves
    why = "the belt ran off its pulleys or its motion grew without bound {where}: turn the yaw back earlier, "
    return failure_with(curves, why + "shorten travel, or halve model.dt")


def show_frame(
    observers: Sequence[Observer], ready: PreparedCase, data: MjxData, readings: Sequence[np.ndarray], yaw: np.ndarray
) -> None:
    """Hand the belt after its last step to the observers, from travel 0 on; data: of a batch whose first case it is."""
    read, steps, scene = readings[-1][-1], len(readings) * SEGMENT, ready.scene
    tail_x, travel, speed = (float(v) for v in read[17:])
    if not observers or travel < 0.0 or not is_on_pulleys(read[None], float(ready.case.belt.width))[0]:
        return
    slides = np.moveaxis(np.asarray(nodes_of(ready.model.belt.shape, np.asarray(data.mjx[0])[0])), -1, 0)
    scalars = {"tail_x": tail_x, "steps": float(steps), "belt_speed": speed}
    now = SimpleNamespace(slides=slides, travel=travel, time=steps * scene.options.dt, yaw=yaw)
    frame = frame_of(scene, read[:17], now, scalars)
    for observer in observers:
        observer.frame(frame)


ENGINE = BatchEngine(refuse, TimeCase, in_batches)
simulate, simulate_batch = ENGINE.simulate, ENGINE.simulate_batch
