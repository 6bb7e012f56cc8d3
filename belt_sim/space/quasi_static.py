"""Runs of the 3D belt on JAX: one case, or a batch of cases of one mesh at once."""

import math
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.case import Numbers as Array
from belt_sim.curves import Curves
from belt_sim.errors import CannotRepresent, SimulationError
from belt_sim.jax_setup import in_float64
from belt_sim.scene_parts import SceneParts
from belt_sim.space.belt import ActiveFeatures, BeltArrays, belt_arrays
from belt_sim.space.equilibrium_step import TravelState, step
from belt_sim.space.machine import lay_out
from belt_sim.space.options import Options, fit_options, is_limp
from belt_sim.space.pulleys import lay_pulleys
from belt_sim.space.rope import RopeKinks
from belt_sim.space.run import (
    BatchEngine,
    Command,
    cases_per_chunk,
    curves_of,
    failure_with,
    is_on_pulleys,
    plan_in_travel,
    reading,
)
from belt_sim.space.wrap import TAIL, SlipState

#: columns of a run with friction
COLUMNS = ("slip_head", "slip_tail", "sliding_head", "sliding_tail", "friction_residual")
TOLERANCE = 0.01  # of the largest limit: what friction may contradict Coulomb's law by in any step


@dataclass(frozen=True)
class TravelCase:
    """A case ready to be traced: its arrays, its state laid; commands, recorded: of ``plan_in_travel``."""

    case: Case
    belt: BeltArrays
    state: TravelState
    commands: Command
    recorded: np.ndarray

    @property
    def stations(self) -> int:
        return self.belt.shape.stations

    @property
    def kind(self) -> Hashable:
        """Cases of one kind can be run at once."""
        sizes = (np.shape(leaf) for leaf in jax.tree.leaves((self.belt, self.state)))
        return self.belt.shape, self.commands.travel.shape[1], tuple(sizes)


def lay_case(
    case: Case, belt: str, travel: float, options: Options, parts: SceneParts, features: ActiveFeatures
) -> TravelCase:
    """The belt of a case laid round its pulleys, to be run over ``travel`` [m]; see BatchEngine."""
    options = fit_options(options, case, belt)
    scene = lay_out(case, belt, options, parts)
    arrays = belt_arrays(scene, features)
    shape = arrays.shape
    pulleys = lay_pulleys(scene, arrays)
    state = TravelState(
        nodes=np.moveaxis(scene.mesh.laid, 0, -1),
        pulleys=pulleys,
        tension=np.array(float(case.tension_force)),
        travel=np.array(-scene.early),
        correction=np.array(0.0),
        slip=SlipState.none(shape.lines, shape.stations) if features.slips else None,
        kinks=RopeKinks.from_wrap(pulleys.wrap, shape.sign) if shape.limp else None,
        compliance_yaw=np.zeros(2) if features.gives_way else None,
    )
    return TravelCase(case, arrays, state, *plan_in_travel(case.settings, options, travel, parts.sets_in))


def refuse(belt: str, options: Options, parts: SceneParts) -> None:
    """Raise CannotRepresent for what only engine=native does."""
    if math.isfinite(parts.friction) and is_limp(belt, options):
        raise CannotRepresent(f"model.friction = {parts.friction:g}: a limp belt sticks here; leave it out")


def in_batches(
    ready: Sequence[TravelCase], chunk: int | None, observers: Sequence[object] = ()
) -> Iterator[list[Curves | SimulationError]]:
    """Curves of cases of one kind, chunk by chunk, which nobody can observe; see BatchEngine."""
    rows = max(len(r.recorded) for r in ready)
    devices = jax.device_count()
    fit = devices * cases_per_chunk(ready[0].stations, ready[0].belt.shape.lines)
    size = min(chunk or fit, math.ceil(len(ready) / devices) * devices)
    for begin in range(0, len(ready), size):
        some = ready[begin : begin + size]
        table = _run_chunk([*some, *[some[-1]] * (size - len(some))], rows, devices)
        yield [run_curves(r, t) for r, t in zip(some, table, strict=False)]


@in_float64
def _run_chunk(filled: Sequence[TravelCase], rows: int, devices: int) -> np.ndarray:
    def stand_still(commands: Array) -> Array:
        """Up to as many rows as the longest run has."""
        more = np.broadcast_to(commands[-1:, -1:], (rows - len(commands), *commands.shape[1:]))
        return np.concatenate([commands, more])

    trees = [(r.belt, r.state, jax.tree.map(stand_still, r.commands)) for r in filled]
    arrays = jax.tree.map(lambda *v: np.stack(v), *trees)
    if devices > 1 and len(filled) % devices == 0:
        over = jax.sharding.NamedSharding(jax.make_mesh((devices,), ("cases",)), jax.sharding.PartitionSpec("cases"))
        arrays = jax.device_put(arrays, over)
    return np.asarray(run_batch(*arrays))


def run_curves(run: TravelCase, table: np.ndarray) -> Curves | SimulationError:
    """Curves from the rows (rows, 20 or more) of ``run_batch``."""
    recorded, begin = run.recorded, int(np.argmax(run.recorded))
    rows = table[: len(recorded)][recorded]
    worst = table[begin : len(recorded), 24:].max(axis=1, initial=0.0)  # yaw steps included
    residual = np.maximum.accumulate(worst)[recorded[begin:]]
    good = is_on_pulleys(rows, float(run.case.belt.width)) & ~(residual > TOLERANCE)
    end = len(rows) if good.all() else int(np.argmin(good))
    t = rows[:end].T
    extra = {"tail_x": t[17], "correction": t[19], **dict(zip(COLUMNS, t[20:], strict=False))}
    curves = curves_of(t, t[18], extra)
    if end == len(rows):
        return curves
    why = "the belt ran off its pulleys or its equilibrium was lost {where}: turn the yaw back earlier, shorten travel"
    if residual[end] > TOLERANCE:
        why = (
            f"friction = {float(run.belt.friction):g}: how far nodes slide was not found {{where}}, to "
            f"{residual[end]:.2g} of the largest limit ({TOLERANCE:g} is allowed): raise model.steps"
        )
    return failure_with(curves, f"{why}, or use engine=native")


@jax.jit
def run_batch(belt: BeltArrays, state: TravelState, commands: Command) -> Array:
    """Rows of mean readings of a batch, shape (cases, rows, 20); see ``run_case``."""
    return jax.vmap(run_case)(belt, state, commands)


def run_case(belt: BeltArrays, state: TravelState, commands: Command) -> Array:
    """Rows of mean readings of one case, shape (rows, 20): readings (recording.py), x of the tail pulley [m], travel
    [m], and by how much a node was corrected at most [m]; with friction COLUMNS, the last of which is the largest,
    too. commands: arrays of shape (rows, steps, ...)."""

    def one(state: TravelState, command: Command) -> tuple[TravelState, Array]:
        state = step(belt, state, command)
        wraps, tail_x = state.pulleys.wrap, state.pulleys.pose.centre[TAIL, 0]
        read = reading(belt, state.nodes, wraps.first, wraps.last, tail_x, command.share)
        columns = [read, jnp.stack([tail_x, state.travel, state.correction])]
        if (slip := state.slip) is not None:
            columns += [slip.total, slip.sliding, slip.residual.max(keepdims=True)]
        return state, jnp.concatenate(columns)

    def row(state: TravelState, commands: Command) -> tuple[TravelState, Array]:
        state, reads = jax.lax.scan(one, state, commands)
        mean, most = reads.mean(axis=0), reads.max(axis=0)
        return state, mean.at[19].set(most[19]).at[24:].set(most[24:])

    return jax.lax.scan(row, state, commands)[1]


ENGINE = BatchEngine(refuse, lay_case, in_batches)
prepare_case, simulate, simulate_batch = ENGINE.prepare_case, ENGINE.simulate, ENGINE.simulate_batch
