"""Runs of the 3D belt on JAX: one case, or a batch of cases of one mesh at once."""

import math
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.belt_mechanics.belt import Acting, Belt, Shape, acting_in, belt_of
from belt_sim.belt_mechanics.pulleys import laid, reading
from belt_sim.belt_mechanics.wrap import TAIL
from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.errors import CannotRepresent, InputError, RunFailed
from belt_sim.jax_setup import in_float64
from belt_sim.mujoco3d.constants import RUNAWAY
from belt_sim.mujoco3d.machine import lay_out
from belt_sim.mujoco3d.mesh import BeltModel, Chain, Grid, Membrane
from belt_sim.mujoco3d.options import Options, fitted, is_limp
from belt_sim.pytree import Numbers as Array
from belt_sim.quasi_static.friction import COLUMNS, TOLERANCE, Slip, worst_so_far
from belt_sim.quasi_static.plan import Command, Plan, State, plan_of
from belt_sim.quasi_static.rope import Kinks
from belt_sim.quasi_static.step import step
from belt_sim.scene_parts import SceneParts

_BELTS: dict[str, type[BeltModel]] = {"rope": Chain, "grid": Grid, "flex": Membrane}
_BYTES = 900  # of a case, a station and a pair of lines: 0.85 GB for 256 cases of the full rig
_SMALL_GPU = 4e9  # bytes, where it does not say
_MOST = 256  # cases of a chunk on one GPU: more are no faster, and more is lost when it is stopped


@dataclass(frozen=True)
class Prepared:
    """A case ready to be traced: what it shares with others of its mesh, its arrays, its state laid, its plan."""

    case: Case
    shape: Shape
    belt: Belt
    state: State
    plan: Plan

    @property
    def kind(self) -> Hashable:
        """Cases of one kind can be marched at once."""
        sizes = (np.shape(leaf) for leaf in jax.tree.leaves((self.belt, self.state)))
        return self.shape, self.plan.commands.travel.shape[1], tuple(sizes)


def prepared(
    case: Case,
    *,
    belt: str = "flex",
    travel: float,
    options: Options | None = None,
    parts: SceneParts | None = None,
    acting: Acting | None = None,
) -> Prepared:
    """For ``travel`` [m]; acting: in its batch, None = in this case.

    Raises CannotRepresent for what this engine cannot do.
    """
    options = options or Options()
    parts = parts or SceneParts.undisturbed(case, options.friction)
    refuse(belt, options, parts)
    options = fitted(options, case, belt)
    scene = lay_out(case, _BELTS[belt](), options, parts)
    acting = acting or acting_in([parts])
    shape, arrays = belt_of(scene, belt, acting)
    nodes, wraps, pose = laid(scene)
    state = State(
        nodes=nodes,
        wraps=wraps,
        pose=pose,
        tension=np.array(float(case.tension_force)),
        travel=np.array(-scene.early),
        correction=np.array(0.0),
        slip=Slip.none(shape) if acting.slips else None,
        kinks=Kinks.none(wraps, shape.sign) if shape.limp else None,
        turned=np.zeros(2) if acting.gives_way else None,
        layer=np.zeros((2, 2, shape.lines, 2)) if acting.layered else None,
    )
    return Prepared(case, shape, arrays, state, plan_of(case.settings, options, travel, parts.sets_in))


def refuse(belt: str, options: Options, parts: SceneParts) -> None:
    """Raise CannotRepresent for what only engine=native does."""
    if options.tensioning == "koller":
        raise CannotRepresent("model.tensioning = koller: engine=quasi_static cannot do this; use engine=native")
    if math.isfinite(parts.friction) and is_limp(belt, options):
        raise CannotRepresent(f"options.friction = {parts.friction:g}: a limp belt sticks here; leave it out")


def simulate(
    case: Case, *, belt: str = "flex", travel: float, options: Options | None = None, parts: SceneParts | None = None
) -> Curves:
    """Curves of ``case`` over ``travel`` [m]. y = 0 at travel 0. Raises RunFailed when it diverges."""
    several = None if parts is None else [parts]
    found = simulate_batch([case], belt=belt, travel=travel, options=options, parts=several)[0]
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
) -> list[Curves | RunFailed]:
    """Curves of every case, in order, run over ``travel`` [m] in chunks of at most ``chunk`` at once (None: that fit).

    Cases may differ in everything but the mesh: tension [Pa], yaw schedules [rad], effects (parts), material. A case
    that fails is a RunFailed, with the curves so far in its ``curves``, and stops no other. Several devices of one
    host share a chunk. Raises InputError for cases whose meshes have unlike numbers of stations.
    """
    several: Sequence[SceneParts | None] = parts or [None] * len(cases)
    friction = (options or Options()).friction
    acting = acting_in([p or SceneParts.undisturbed(c, friction) for c, p in zip(cases, several, strict=True)])
    ready = [
        prepared(c, belt=belt, travel=travel, options=options, parts=p, acting=acting)
        for c, p in zip(cases, several, strict=True)
    ]
    if len({r.shape for r in ready}) > 1:
        counts = sorted({r.shape.stations for r in ready})
        raise InputError("cases", f"{counts} stations", "", "give cases of one mesh and direction to a batch")
    return [found for some in in_batches(ready, chunk) for found in some]


def in_batches(ready: Sequence[Prepared], chunk: int | None) -> Iterator[list[Curves | RunFailed]]:
    """Curves of cases of one kind, chunk by chunk; see ``simulate_batch``."""
    rows = max(len(r.plan.recorded) for r in ready)
    devices = jax.device_count()
    size = min(chunk or that_fit(ready[0].shape), math.ceil(len(ready) / devices) * devices)
    for begin in range(0, len(ready), size):
        some = ready[begin : begin + size]
        table = _chunk_marched([*some, *[some[-1]] * (size - len(some))], rows, devices)
        yield [curves_of(r, t) for r, t in zip(some, table, strict=False)]


@in_float64
def _chunk_marched(filled: Sequence[Prepared], rows: int, devices: int) -> np.ndarray:
    """Rows of mean readings of a chunk, shape (cases, rows, 20)."""
    trees = [(r.belt, r.state, r.plan.padded(rows).commands) for r in filled]
    arrays = jax.tree.map(lambda *v: np.stack(v), *trees)
    if devices > 1 and len(filled) % devices == 0:
        over = jax.sharding.NamedSharding(jax.make_mesh((devices,), ("cases",)), jax.sharding.PartitionSpec("cases"))
        arrays = jax.device_put(arrays, over)
    return np.asarray(marched(filled[0].shape, *arrays))


def that_fit(shape: Shape) -> int:
    """Cases at once: on a GPU what half of its memory holds, but at most _MOST on each; on a CPU one, as more gain
    nothing there."""
    device = jax.devices()[0]
    if device.platform == "cpu":
        return 1
    memory = (device.memory_stats() or {}).get("bytes_limit", _SMALL_GPU)
    return jax.device_count() * max(min(int(0.5 * memory / (_BYTES * shape.stations * shape.lines**2)), _MOST), 1)


def curves_of(run: Prepared, table: np.ndarray) -> Curves | RunFailed:
    """Curves from the rows (rows, 20 or more) of ``marched``."""
    recorded = run.plan.recorded
    rows, residual = table[: len(recorded)][recorded], worst_so_far(table, recorded)
    good = np.isfinite(rows).all(axis=1) & (np.abs(rows[:, :4]).max(axis=1) < RUNAWAY * float(run.case.belt.width))
    good &= ~(residual > TOLERANCE)
    end = len(rows) if good.all() else int(np.argmin(good))
    t = rows[:end].T
    curves = Curves(
        travel=t[18],
        y=t[:4] - t[:4, :1],
        angle=t[4:8],
        moment=t[8:10],
        edge_stress=t[10:12],
        tilt=t[12:14],
        sag=t[14:16].mean(axis=1) if end else np.zeros(2),
        extra={"tension": t[16], "tail_x": t[17], "correction": t[19], **dict(zip(COLUMNS, t[20:], strict=False))},
    )
    if end == len(rows):
        return curves
    return failed(run, curves, float(residual[end]))


def failed(run: Prepared, curves: Curves, residual: float) -> RunFailed:
    """Of a run that got as far as ``curves``; residual: of friction in the row after them."""
    where = f"after {curves.travel[-1] if len(curves.travel) else 0:.2f} m"
    why = f"the belt ran off its pulleys or its equilibrium was lost {where}: turn the yaw back earlier, shorten travel"
    if residual > TOLERANCE:
        why = (
            f"friction = {float(run.belt.friction):g}: how far nodes slide was not found {where}, to {residual:.2g} of "
        )
        why += f"the largest limit ({TOLERANCE:g} is allowed): raise model.steps"
    failure = RunFailed(f"{why}, or use engine=native")
    failure.curves = curves
    return failure


@partial(jax.jit, static_argnums=0)
def marched(shape: Shape, belt: Belt, state: State, commands: Command) -> Array:
    """Rows of mean readings of a batch, shape (cases, rows, 20); see ``march``."""
    return jax.vmap(partial(march, shape))(belt, state, commands)


def march(shape: Shape, belt: Belt, state: State, commands: Command) -> Array:
    """Rows of mean readings of one case, shape (rows, 20): readings (recording.py), x of the tail pulley [m], travel
    [m], and by how much a node was corrected at most [m]; with friction 5 more (friction.py), the last of which is
    the largest, too. commands: arrays of shape (rows, steps, ...)."""

    def one(state: State, command: Command) -> tuple[State, Array]:
        state = step(shape, belt, state, command)
        tail_x = state.pose.centre[TAIL, 0]
        read = reading(shape, belt, state.nodes, state.wraps, tail_x, command.share)
        most = [] if state.slip is None else [state.slip.columns()]
        return state, jnp.concatenate([read, jnp.stack([tail_x, state.travel, state.correction]), *most])

    def row(state: State, commands: Command) -> tuple[State, Array]:
        state, reads = jax.lax.scan(one, state, commands)
        mean, most = reads.mean(axis=0), reads.max(axis=0)
        return state, mean.at[19].set(most[19]).at[24:].set(most[24:])

    return jax.lax.scan(row, state, commands)[1]
