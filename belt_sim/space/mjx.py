"""engine=mjx: a belt on MuJoCo MJX: its model, its data, a step in time, runs of one case or of many of one mesh.

MJX takes no flex and no discrete integrator: ``step`` calls its parts, and the belt's elasticity, the implicit solve
and the stations on the pulleys are ours. Assumptions about MJX 3.17: tests/space/test_mjx_interface.py.
"""

import io
import math
from collections.abc import Hashable, Iterator, Sequence
from contextlib import ExitStack, redirect_stdout
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.case import Numbers as Array
from belt_sim.curves import Curves, Observer
from belt_sim.errors import CannotRepresent, SimulationError
from belt_sim.jax_setup import STEP_EFFORT, in_float64, jit_float64
from belt_sim.scene_parts import SceneParts
from belt_sim.space import chain, run
from belt_sim.space.belt import (
    ActiveFeatures,
    BatchShape,
    BeltArrays,
    active_features,
    belt_arrays,
    guide_forces,
    load_forces,
)
from belt_sim.space.elastic import solve_chain
from belt_sim.space.mujoco_interface import compile_model
from belt_sim.space.options import HOLD_STIFFNESS, RUNAWAY, Options, fit_options, is_limp, refuse_unobeyed
from belt_sim.space.scene import (
    HEAD_SPIN,
    HEAD_YAW,
    STATION_JOINTS,
    TAIL_SLIDE,
    TAIL_SPIN,
    TAIL_YAW,
    SceneLayout,
    build_scene,
    laid_coordinates,
    lay_out,
    smoothstep,
    station_mass,
    stations_of,
)
from belt_sim.space.wrap import HEAD, TAIL, BeltOnPulley, SlipState, sink_wraps

with redirect_stdout(io.StringIO()):  # it prints that Warp is not installed, which is not needed
    from mujoco import mjx
    from mujoco.mjx._src import scan

T = TypeVar("T")


class MjxModel(NamedTuple):
    """What stands still in a run. mjx: MJX's model; belt: what ties its nodes; settle [s]: wobbles set in."""

    mjx: mjx.Model
    belt: BeltArrays
    tail: chain.TailPulley
    settle: Array

    @property
    def dt(self) -> Array:
        """Duration of a step [s]."""
        return self.mjx.opt.timestep


class MjxData(NamedTuple):
    """What moves. mjx: MJX's data (``PreparedCase.to_mujoco`` shows them with the belt); pulleys: head and tail;
    loads (2, 3): of ``belt_loads``; travel [m]: of the belt; reading (20,): of the instruments, READING says what of;
    compliance_yaw [rad], (2,): by which the pulleys give way, None if they do not; slip: of a belt with friction, and
    waiting, as of ``finish_step``."""

    mjx: mjx.Data
    pulleys: BeltOnPulley
    loads: Array
    travel: Array
    reading: Array
    compliance_yaw: Array | None = None
    slip: SlipState | None = None
    waiting: Array | None = None


EXTRA = {"tail_x": run.TAIL_X, "belt_speed": run.SPEED}  # further columns of the curves


def command(
    model: MjxModel, data: MjxData, speed: Array, yaw: Array, drag: Array | float = 1.0, *,
    acceleration: Array | float = 3.0, turning: Array | float = 0.02,
) -> run.Command:  # fmt: skip
    """The command of a controller that wants belt speed [m/s] and yaw [rad], (2,): head, tail.

    drag [1/s]: of the belt across its travel; acceleration [m/s2], turning [rad/s]: by which speed and yaw change at
    most, step by step, because a jump folds the belt; inf = at once. The yaw itself is not limited: beyond
    2 L sigma/(E b) an edge of a span L is slack, and far beyond it (10 mrad on a span of 2 m) the belt folds, which
    ``diverged`` tells.
    """
    before, one, dt = data.reading[run.READING["speed"]], jnp.ones(()), model.dt
    gained = jnp.clip((speed - before) / dt, -acceleration, acceleration)
    was = data.mjx.qpos[jnp.array([HEAD_YAW, TAIL_YAW])]
    was = was if data.compliance_yaw is None else was - data.compliance_yaw
    yaw = was + jnp.clip(yaw - was, -turning * dt, turning * dt)
    speed, drags = before + dt * gained, jnp.stack([0.0 * one, drag * one])
    return run.Command(data.travel + dt * speed, yaw, one, one * speed, gained, drags, model.belt.friction)


def diverged(model: MjxModel, data: MjxData) -> Array:
    """Whether the belt has run off its pulleys or its motion is not finite: a bool, for jax.jit and jax.vmap."""
    read = data.reading
    return ~jnp.isfinite(read).all() | (jnp.abs(read[run.POINTS]).max() > RUNAWAY * model.belt.width)


@dataclass(frozen=True)
class PreparedCase:
    """A case ready to be stepped, its belt laid round the pulleys at rest; compiled: the MjModel that MJX was given,
    without the belt's membrane or bonds; spec: of the whole scene."""

    case: Case
    scene: SceneLayout
    model: MjxModel
    data: MjxData
    compiled: mujoco.MjModel
    spec: mujoco.MjSpec

    @cached_property
    def drawable(self) -> mujoco.MjModel:
        """The MjModel of the scene with the belt, for MuJoCo's renderer and viewer."""
        return compile_model(self.spec)

    def to_mujoco(self, data: MjxData | mjx.Data, into: mujoco.MjData | None = None) -> mujoco.MjData:
        """MuJoCo's data of ``drawable`` where the data of this case are, the belt's vertices included.

        data: of one case (of a batch: ``jax.tree.map(lambda v: v[k], data)``); into: MjData that are filled instead of
        new ones, so that an open viewer follows.
        """
        now, shown = data.mjx if isinstance(data, MjxData) else data, into or mujoco.MjData(self.drawable)
        shown.qpos[:], shown.qvel[:], shown.time = np.asarray(now.qpos), np.asarray(now.qvel), float(now.time)
        mesh = self.scene.mesh  # of cases that share what MJX was given, each belt has stress-free places of its own
        first = self.drawable.nbody - mesh.stations * mesh.lines
        apart = (mesh.rest.reshape(-1, 3) - self.drawable.body_pos[first:]).ravel()
        shown.qpos[STATION_JOINTS : STATION_JOINTS + apart.size] += apart
        for update in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_camlight, mujoco.mj_flex, mujoco.mj_tendon):
            update(self.drawable, shown)
        return shown


def scene_of(case: Case, *, belt: str = "flex", options: Options | None = None) -> mujoco.MjSpec:
    """The specification of a case's scene, for actuators and sensors of one's own (``prepare``, spec)."""
    options = fit_options(options or Options(), case, "flex", "mjx")
    return build_scene(case, belt, options, SceneParts.from_case(case, options.friction))[0]


@in_float64
def prepare_cases(
    cases: Sequence[Case], *, belt: str = "flex", options: Options | Sequence[Options] | None = None,
    parts: Sequence[SceneParts] | None = None, features: ActiveFeatures | None = None,
    spec: mujoco.MjSpec | None = None,
) -> list[PreparedCase]:  # fmt: skip
    """Cases of one mesh, ready to be stepped: one MJCF is compiled and handed to MJX, with each case's own numbers.

    Cases may differ in tension, yaw, speed, friction, material, effects. belt: "flex" or "grid"; options: of all or of
    each; parts: the scenes as effects change them; features: in the batch, None = in these cases; spec: of ``scene``,
    with actuators and sensors added. Raises InputError for an option that it does not obey.
    """
    asked = [options or Options()] * len(cases) if isinstance(options, Options | None) else list(options)
    refuse_unobeyed(asked[0], belt, "mjx")
    several = parts or [SceneParts.from_case(case, asked[0].friction) for case in cases]
    features = features or active_features(several)
    # the step is implicit in bonds across their direction, too
    own = [fit_options(o, c, "flex", "mjx") for o, c in zip(asked, cases, strict=True)]
    whole = spec or build_scene(cases[0], belt, own[0], replace(several[0], edge_guides=()))[0]
    compiled = plain_model(whole.copy(), own[0].step)
    m, shared_data = to_mjx(compiled, compiled.qpos0)
    carriages, prepared = [compiled.body(f"{name}-carriage").id for name in ("head", "tail")], []
    for case, fitted, acting in zip(cases, own, several, strict=True):
        layout = lay_out(case, belt, fitted, acting)
        first = m.nbody - layout.mesh.stations * layout.mesh.lines
        arrays = belt_arrays(layout, features, layout.mesh.mass / fitted.step**2)
        pulleys, shape = chain.lay_pulleys(layout, arrays), arrays.shape
        mesh, mass = layout.mesh, station_mass(case, fitted)
        places, masses, armature = (np.array(v) for v in (m.body_pos, m.body_mass, m.dof_armature))
        places[first:] = mesh.rest.reshape(-1, 3)
        masses[first:] = np.broadcast_to(mesh.mass, mesh.rest.shape[:2]).ravel()
        places[carriages[1], 0], masses[carriages] = float(case.rig.centre_distance), mass
        armature[[HEAD_SPIN, TAIL_SPIN]] = mass * np.array([layout.loop.radius_head, layout.loop.radius_tail]) ** 2
        gravity, dt = jnp.array([0.0, 0.0, -layout.parts.gravity]), jnp.array(fitted.step)
        own_model = m.replace(  # arrays of JAX: those of NumPy are constants to MJX
            body_pos=jnp.asarray(places), body_mass=jnp.asarray(masses), dof_armature=jnp.asarray(armature),
            opt=m.opt.replace(gravity=gravity, timestep=dt),
        )  # fmt: skip
        tail = chain.TailPulley.from_scene(layout, compiled, masses, armature)
        model = MjxModel(own_model, arrays, chain.TailPulley(*map(np.array, tail)), np.array(max(fitted.settle, 1e-9)))
        qpos, laid = np.array(compiled.qpos0), laid_coordinates(layout, *pulleys.pose.spin)
        qpos[: len(laid)] = laid
        data = MjxData(
            mjx=shared_data.replace(qpos=jnp.asarray(qpos)),
            pulleys=pulleys,
            loads=np.outer([1.0, -1.0], [2.0 * float(case.tension_force), 0.0, 0.0]),
            travel=np.array(-layout.early),
            reading=np.zeros(20),
            compliance_yaw=np.zeros(2) if features.gives_way else None,
            slip=SlipState.none(shape.lines, shape.stations) if features.slips else None,
            waiting=np.array(-1) if features.slips else None,
        )
        prepared.append(PreparedCase(layout.case, layout, model, data, compiled, whole))
    return prepared


def nodes_of(shape: BatchShape, flat: Array) -> Array:
    """Values by node (m, 3, n) of values by coordinate, of which the last are the nodes'."""
    nodes = flat[-3 * shape.lines * shape.stations :].reshape(shape.stations, shape.lines, 3)
    return jnp.moveaxis(nodes, 0, -1)


def flat_of(base: Array, nodes: Array) -> Array:
    """Values by coordinate: those of the pulleys' joints (5,), then those of the nodes (m, 3, n)."""
    return jnp.concatenate([base, jnp.moveaxis(nodes, -1, 0).reshape(-1)])


#: what MJX computes of position and velocity: xpos, inertia, qfrc_passive, qfrc_bias
MULTIBODY = (mjx.kinematics, mjx.com_pos, mjx.crb, mjx.com_vel, mjx.passive, mjx.rne)


def step(model: MjxModel, data: MjxData, command: run.Command) -> MjxData:
    """The data after a step. For jax.jit, jax.vmap (``stack_cases`` gives the axes), jax.lax.scan and jax.grad.

    The pulleys' joints come from the forces on them (slide and spin of the tail) and the command (drive, yaw); the
    anchors of landed stations are springs of joints in MJX's model. From q + h v, landed nodes on their anchors, one
    Newton iteration (M/h^2 + D/h + K) dq = f - M (q* - q - h v)/h^2 on the chain of stations is enough. The tension
    that stiffens the belt across is that of the step's beginning: that of the predicted state may be slack.
    """
    m, belt, shape, h = model.mjx, model.belt, model.belt.shape, model.dt
    d = data.mjx
    if m.nu:  # forces of a user's actuators
        d = mjx.transmission(m, mjx.com_pos(m, mjx.kinematics(m, d)))
        d = mjx.fwd_actuation(m, d.tree_replace({"_impl.actuator_velocity": d._impl.actuator_moment @ d.qvel}))
    q, v = d.qpos, d.qvel
    first = m.nbody - shape.stations * shape.lines  # of the nodes among the bodies
    rest = nodes_of(shape, m.body_pos[first:].reshape(-1))  # stress-free places
    before = rest + nodes_of(shape, q)
    moves = jnp.stack([q[:STATION_JOINTS], v[:STATION_JOINTS]])
    actuators = d.qfrc_actuator[:STATION_JOINTS]
    driven, tail, turned = model.tail.advance(belt, moves, data.loads, data.compliance_yaw, command, h, actuators)
    spin = shape.sign * command.travel / belt.surfaces.radius[HEAD]
    joints = driven[0].at[TAIL_SLIDE].set(tail[0] - model.tail.x).at[TAIL_SPIN].set(tail[1]).at[HEAD_SPIN].set(spin)
    applied = jnp.concatenate([driven[2], jnp.zeros(q.size - STATION_JOINTS)])
    askew = smoothstep(d.time / (0.5 * model.settle))  # a wobble sets in while the belt comes to rest
    pose = chain.pose_of(belt, command, tail, turned, askew)
    came_from = data.pulleys.pose
    moved = jnp.abs(pose.spin[HEAD] - came_from.spin[HEAD]) * belt.surfaces.radius[HEAD]
    shaped = jnp.where(data.travel >= 0.0, 1.0, 0.0)
    stands = (command.speed == 0.0) & (command.travel >= 0.0)
    pulleys = data.pulleys._replace(surface=belt.surfaces, pose=pose)
    pulleys = sink_wraps(belt, pulleys, came_from, moved, shaped, stands)
    places = chain.cut_chain(pulleys.wrap)
    twist = chain.twist_of_cells(belt, pulleys, places, jnp.maximum(-0.5 * data.loads[TAIL, 0], 0.0))
    rates = nodes_of(shape, v)
    back = (jnp.arange(shape.stations) - places.stations[0]) % shape.stations  # from the chain to stations' numbers
    anchors, free = chain.anchor_positions(belt, pulleys, places)[..., back], places.free[back]
    predicted = jnp.where(free, before + h * rates, anchors)  # where the belt would go by itself
    drag = jnp.stack([command.drag[0], command.drag[1], command.drag[1]])[None, :, None]
    damping = belt.mass[:, None, None] * jnp.broadcast_to(drag, before.shape)
    nothing = jnp.zeros(STATION_JOINTS)
    m = m.replace(
        qpos_spring=flat_of(nothing, anchors - rest),
        jnt_stiffness=flat_of(nothing, jnp.broadcast_to(jnp.where(free, 0.0, HOLD_STIFFNESS), before.shape)),
        dof_damping=flat_of(nothing, damping),
    )
    qvel = flat_of((joints - q[:STATION_JOINTS]) / h, (predicted - before) / h)
    there = d.replace(qpos=flat_of(joints, predicted - rest), qvel=qvel, qfrc_applied=applied)
    for stage in MULTIBODY:
        there = stage(m, there)

    # from stations' numbers to the chain; masses are of slides that stand square to each other
    by_number = (
        nodes_of(shape, there.xpos[first:].reshape(-1)), before, rates, damping,
        nodes_of(shape, mjx.mul_m(m, there, jnp.ones(m.nv))),
        nodes_of(shape, there.qfrc_passive - there.qfrc_bias + there.qfrc_actuator),
    )  # fmt: skip
    nodes, was, rates, damping, mass, others = (values[..., places.stations] for values in by_number)
    more = (mass / h**2 + damping / h).reshape(3 * shape.lines, -1)
    lacking = (others - mass * (nodes - was - h * rates) / h**2).reshape(more.shape)
    lacking = chain.chain_forces(belt, nodes, places, twist, command.share)[0] + lacking
    if belt.guides is not None:
        force, stiffness = guide_forces(belt, nodes, places.free)
        lacking, more = lacking.at[1::3].add(force), more.at[1::3].add(stiffness)
    if belt.loads is not None:
        lacking = lacking + command.share * load_forces(belt, was).reshape(lacking.shape)
    levels, _ = chain.factorise_chain(belt, nodes, was, places, twist, command.share, more)
    change = solve_chain(levels, jnp.where(places.free, lacking, 0.0)[:, None])[:, 0]
    after = (nodes + change.reshape(nodes.shape))[..., back]
    goal = flat_of((joints - q[:STATION_JOINTS]) / h, (after - before) / h)
    d = mjx.euler(m, there.replace(qpos=q, qvel=v, qacc=(goal - v) / h))
    if m.nsensor:  # of positions and velocities
        d = mjx.com_vel(m, mjx.com_pos(m, mjx.kinematics(m, d)))
        d = mjx.sensor_vel(m, mjx.sensor_pos(m, d))
    pull, slips = chain.pull_on_nodes(belt, after, command.share), (data.slip, data.waiting)
    made = (came_from, before), after, pull, moved, shaped, command, h
    pulleys, slip, waiting, loads, read = chain.finish_step(belt, pulleys, slips, *made)
    return MjxData(d, pulleys, loads, command.travel, read, turned, slip, waiting)


def carried_state(data: MjxData) -> MjxData:
    """Without what MJX computes anew every step."""
    return data._replace(mjx=(data.mjx.qpos, data.mjx.qvel, data.mjx.time))


def restored_state(data: MjxData, still: mjx.Data) -> MjxData:
    """The data of ``carried_state`` with MJX's own of any instant, ``still``."""
    qpos, qvel, time = data.mjx
    return data._replace(mjx=still.replace(qpos=qpos, qvel=qvel, time=time))


def march(model: MjxModel, data: MjxData, commands: run.Command, *, piece: int = 0) -> tuple[MjxData, Array]:
    """The data after many steps, and what the instruments read after each, (steps, 20).

    commands: with a leading axis of steps (``plan`` makes those of a case). piece: for ``jax.grad`` through thousands
    of steps: of so many steps only the beginning is kept, and on the way back they are run once more; memory goes with
    steps / piece + piece; 0 = keep all.
    """
    still = data.mjx

    def one(data: MjxData, command: run.Command) -> tuple[MjxData, Array]:
        after = step(model, restored_state(data, still), command)
        return carried_state(after), after.reading

    march_on = partial(jax.lax.scan, jax.checkpoint(one) if piece else one)
    steps, reads = len(commands.travel), []
    data, whole = carried_state(data), steps - steps % piece if piece else 0
    if whole:
        pieces = jax.tree.map(lambda c: c[:whole].reshape(-1, piece, *c.shape[1:]), commands)
        data, read = jax.lax.scan(jax.checkpoint(march_on), data, pieces)
        reads.append(read.reshape(whole, -1))
    if whole < steps:
        data, read = march_on(data, jax.tree.map(lambda c: c[whole:], commands))
        reads.append(read)
    return restored_state(data, still), jnp.concatenate(reads)


def plan(ready: PreparedCase, travel: float) -> run.Command:
    """The commands of all steps of a run over ``travel`` [m], for ``march``: rest, run-in, yaw steps, run."""
    return run.plan_in_time(ready.scene, travel)[0]


def plain_model(spec: mujoco.MjSpec, dt: float) -> mujoco.MjModel:
    """The compiled model of ``spec``, which loses flex, tendons, equalities and key frames, for steps of ``dt`` [s].

    Cases share what is compiled: key frames are part of it, and sizes of geoms, only seen, which are rounded to 0.1 mm.
    MJX's own implicit damping is off: the belt's step has the damping already.
    """
    for elements in (spec.flexes, spec.tendons, spec.equalities, spec.keys):
        for element in list(elements):
            spec.delete(element)
    for geom in spec.geoms:
        geom.size = np.round(geom.size, 4)
    model = compile_model(spec)
    model.opt.timestep = dt
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    return model


def to_mjx(model: mujoco.MjModel, qpos: np.ndarray) -> tuple[mjx.Model, mjx.Data]:
    """The model and its data at rest at ``qpos``, on JAX, not committed to a device as MJX has them: ``jax.jit`` would
    compile everything once more for the committed results of a step."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    tied = mjx.put_model(model, impl="jax"), mjx.put_data(model, data, impl="jax")
    return jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)), tied)


def stack_cases(trees: Sequence[T]) -> tuple[T, Any]:
    """Cases of one structure as one: leaves that differ stacked on a first axis, and the in_axes for jax.vmap.

    MJX keeps some fields as part of the structure, so cases must come from one compiled scene.
    """
    structure, leaves, axes = jax.tree.structure(trees[0]), [], []
    for some in zip(*map(jax.tree.leaves, trees), strict=True):
        first = np.asarray(some[0])
        same = all(leaf is some[0] or np.array_equal(first, leaf, equal_nan=True) for leaf in some[1:])
        leaves.append(some[0] if same else np.stack([np.asarray(leaf) for leaf in some]))
        axes.append(None if same else 0)
    return jax.tree.unflatten(structure, leaves), jax.tree.unflatten(structure, axes)


#: MJX asks for the body of every coordinate once a body, in Python: 195 s of tracing on the full rig
SLOW_TEXT = "_q_bodyid"
_bodies_of: Any = getattr(scan, SLOW_TEXT, None)
_kept: list[Any] = [None, None]  # the last model's kinds of joints, and what was found of them


def _once_a_model(m: mjx.Model) -> np.ndarray:
    if _kept[0] is not m.jnt_type:
        _kept[:] = m.jnt_type, _bodies_of(m)
    return _kept[1]


if _bodies_of is not None:
    setattr(scan, SLOW_TEXT, _once_a_model)


SEGMENT = 50  # steps of one compiled call: at most 0.1 m of travel at 1 ms and 2 m/s


class TimeCase(NamedTuple):
    """A case, to be prepared with others of its kind; stations: of its mesh; alike: belt, features, travel [m]."""

    case: Case
    options: Options
    parts: SceneParts
    stations: int
    alike: tuple[str, ActiveFeatures, float]
    kind: Hashable


def lay_time_case(
    case: Case, belt: str, travel: float, options: Options, parts: SceneParts, features: ActiveFeatures
) -> TimeCase:
    """A case that can be run; raises CannotRepresent for a belt without bending stiffness. See BatchEngine."""
    if is_limp(belt, options):
        why = f"model = mujoco_{belt} without bending stiffness"
        raise CannotRepresent(f"{why}: engine=mjx cannot do this; use engine=native")
    fit_options(options, case, "flex", "mjx")  # here, what it refuses stops no other case of a batch
    stations, alike = stations_of(case, options.dx), (belt, features, travel)
    kind = alike, stations, float(np.sign(float(case.settings.direction))), replace(options, belt_speed=None, dt=None)
    return TimeCase(case, options, parts, stations, alike, kind)


def run_time_cases(
    cases: Sequence[TimeCase], chunk: int | None, observers: Sequence[Sequence[Observer]] = ()
) -> Iterator[list[Curves | SimulationError]]:
    """Curves of cases of one kind, chunk by chunk; observers: of each case, or none; see BatchEngine."""
    belt, features, travel = cases[0].alike
    size = min(chunk or run.cases_per_chunk(cases[0].stations, cases[0].options.across), len(cases))
    for begin in range(0, len(cases), size):
        several, options, parts, *_ = zip(*cases[begin : begin + size], strict=True)
        ready = prepare_cases(several, belt=belt, options=options, parts=parts, features=features)
        yield run_prepared(ready, travel, observers[begin : begin + size])


@in_float64
def run_prepared(
    ready: Sequence[PreparedCase], travel: float, observers: Sequence[Sequence[Observer]] = ()
) -> list[Curves | SimulationError]:
    """Curves of cases of one mesh over ``travel`` [m]; observers: of each case, or of the first few."""
    models, axes = stack_cases([r.model for r in ready])
    data = jax.tree.map(lambda *v: np.stack([np.asarray(x) for x in v]), *[carried_state(r.data) for r in ready])
    models, still, data = jax.device_put((models, ready[0].data.mjx, data))
    plans = [plan(r, travel) for r in ready]
    leaves, structure = jax.tree.flatten(axes, is_leaf=lambda v: v is None)
    march_segment = compile_batch(tuple(leaves), structure)
    steps, widths = np.array([len(p.travel) for p in plans]), np.array([float(r.case.belt.width) for r in ready])
    watched = [(k, run.Recorder(ready[k].scene, own, EXTRA)) for k, own in enumerate(observers) if own]
    options = [one.scene.options for _, one in watched]
    segment = min([SEGMENT, *(max(int(o.frame / (o.step * o.run_speed)), 1) for o in options)])  # a frame at each end
    whole, found = np.arange(segment * math.ceil(steps.max() / segment)), [np.empty((len(ready), 0, 20))]
    kept = [np.minimum(whole, n - 1) for n in steps]  # a run that has ended keeps its last command
    commands = jax.tree.map(lambda *of: np.stack([c[k] for c, k in zip(of, kept, strict=True)]), *plans)

    def curves(k: int) -> Curves | SimulationError:
        """Of the steps made so far, or a failure that has those before it."""
        made, table = plans[k], np.concatenate([part[k] for part in found])[: steps[k]]
        good = run.is_on_pulleys(table, widths[k])
        until, begin = len(table) if good.all() else int(np.argmin(good)), int(np.argmax(made.travel >= 0.0))
        used = np.arange(until) >= begin - 1
        used[begin:] &= made.speed[begin:until] > 0.0  # a belt that stands for a yaw step is in no row
        rows = table[:until][used]
        rows[:1, [run.TRAVEL_ROW, run.SPEED]] = 0.0, made.speed[begin]
        so_far = run.curves_in_time(ready[k].scene, rows, EXTRA)
        if until == len(table):
            return so_far
        why = "the belt ran off its pulleys or its motion grew without bound {where}: turn the yaw back earlier, "
        return run.failure_with(so_far, why + "shorten travel, or halve model.dt")

    with ExitStack() as stack:
        for k, one in watched:
            so_far = partial(lambda k: c.curves if isinstance(c := curves(k), SimulationError) else c, k)
            stack.enter_context(run.notify_observers(one.observers, one.scene.case, travel, so_far))
        pending = None
        for begin in range(0, len(commands.travel[0]), segment):
            now = slice(begin, begin + segment)
            data, reads = march_segment(models, still, data, jax.tree.map(lambda c, now=now: c[:, now], commands))
            if pending is not None:  # readings are fetched while the next segment runs
                found.append(np.asarray(pending))
                if not run.is_on_pulleys(found[-1][:, -1], widths).any():
                    break
            places = np.asarray(data.mjx[0]) if watched else ()
            for k, one in watched:
                for advance in (o.advance for o in one.observers if hasattr(o, "advance")):
                    advance(begin / len(commands.travel[0]))
                last = min(now.stop, steps[k]) - 1  # after it the belt keeps its last command
                read = np.asarray(reads[k, last - begin])
                if begin <= last and run.is_on_pulleys(read[None], widths[k])[0]:
                    slides = np.moveaxis(np.asarray(nodes_of(ready[k].model.belt.shape, places[k])), -1, 0)
                    time, ends = (last + 1) * one.scene.options.step, last + 1 == steps[k]
                    one.show(read, slides, time, commands.yaw[k, last], ends)
                    every, gone = one.scene.options.frame, float(read[run.TRAVEL_ROW])  # segments end where they do
                    one.next_frame = max(every * math.ceil((gone + 1e-12) / every), 0.0)
            pending = reads
        found.append(np.asarray(pending))
    return [curves(k) for k in range(len(ready))]


@cache
def compile_batch(leaves: tuple[int | None, ...], structure: Any):
    """``march`` from and to ``carried_state``, of a batch whose models differ by these axes; made and compiled once."""

    def run_steps(model: MjxModel, still: mjx.Data, data: MjxData, commands: run.Command) -> tuple[MjxData, Array]:
        after, read = march(model, restored_state(data, still), commands)
        return carried_state(after), read

    axes = jax.tree.unflatten(structure, leaves)
    return jit_float64(jax.vmap(run_steps, in_axes=(axes, None, 0, 0)), effort=STEP_EFFORT, donate_argnums=2)


MJX = run.BatchEngine(lay_time_case, run_time_cases)
simulate, simulate_batch = MJX.simulate, MJX.simulate_batch
