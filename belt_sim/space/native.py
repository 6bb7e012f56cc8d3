"""A run in three dimensions: case in, curves out. One step is pulleys, springs, forces, MuJoCo, contact."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree

from belt_sim.case import Case
from belt_sim.case import Numbers as Array
from belt_sim.curves import Curves, Observer
from belt_sim.errors import SimulationError
from belt_sim.io import write_text
from belt_sim.jax_setup import STEP_EFFORT, in_float64, jit_float64
from belt_sim.scene_parts import SceneParts
from belt_sim.space import chain, run, wrap
from belt_sim.space.belt import BeltArrays, active_features, belt_arrays, guide_forces, load_forces
from belt_sim.space.elastic import twist_energy
from belt_sim.space.mujoco_interface import Motion, Solver, compile_model, mjcf, silence_expected_warnings
from belt_sim.space.options import CONTACTS, HOLD_STIFFNESS, Options, fit_options, refuse_sliding_limp
from belt_sim.space.rolling_contact import ContactRun, Edited
from belt_sim.space.scene import STATION_JOINTS, SceneLayout, build_scene, laid_coordinates, smoothstep, tie_lengths
from belt_sim.space.wrap import TAIL


class Fixed(NamedTuple):
    """What stands still in a run; rest [m], (n, m, 3): of the mesh; wobbled [s]: time over which a wobble sets in."""

    belt: BeltArrays
    tail: chain.TailPulley
    rest: Array
    dt: Array
    wobbled: Array


class Carried(NamedTuple):
    """What goes from step to step beside MuJoCo's coordinates; of arrays of two the first is the head pulley's.

    pulleys: where they are at the end of the coming step, the stations on them, their bending layers (wrap.py); slip:
    of these stations; waiting: the pulley on which the belt did not slide in the last step, because both take turns
    (-1 = neither); loads, (2, 3): of ``belt_loads``; compliance_yaw [rad], (2,); kinks, run_off: of a limp belt, its
    stations at the run-offs when they were last put on their lines, (2,).
    """

    pulleys: wrap.BeltOnPulley
    slip: wrap.SlipState
    waiting: Array
    loads: Array
    compliance_yaw: Array
    kinks: chain.RopeKinks | None = None
    run_off: Array | None = None


class Instant(NamedTuple):
    """A step's end: the command, the time [s], and 1 from travel 0 on, where stations land on the pulleys as they are,
    0 before, on plain cylinders."""

    command: run.Command
    time: Array
    shaped: Array


class StepInput(NamedTuple):
    """What a step of MuJoCo starts from. free, (n,): whether a station lies on no pulley; nodes [m], (n, m, 3), where a
    limp belt's new outermost stations have been moved, forces [N] on them, rest [m] and stiffness [N/m] of their
    springs; joints [rad, m], their rates, and the forces on them [N m, N], (3, 5); fewest: links on a pulley."""

    free: Array
    nodes: Array
    forces: Array
    rest: Array
    stiffness: Array
    joints: Array
    fewest: Array


def hold_belt(fixed: Fixed, was: Carried, at: Instant, joints: Array, nodes: Array) -> tuple[Carried, StepInput]:
    """Before a step: the pulleys where they will be at its end, their stations on their anchors, and all other forces;
    joints [rad, m] and their rates, (2, 5)."""
    belt, (command, time, shaped), pulleys, kinks, run_off = fixed.belt, at, was.pulleys, was.kinks, was.run_off
    sign, n, speed, before = belt.shape.sign, nodes.shape[-1], command.speed, was.pulleys.pose
    driven, tail, turned = fixed.tail.advance(belt, joints, was.loads, was.compliance_yaw, command, fixed.dt)
    pulleys = pulleys._replace(pose=chain.pose_of(belt, command, tail, turned, smoothstep(time / fixed.wobbled)))
    moved = jnp.abs(pulleys.pose.spin - before.spin) * belt.surfaces.radius
    pulleys = wrap.sink_wraps(belt, pulleys, before, moved, shaped, (speed == 0.0) & (command.travel >= 0.0))
    pulleys, kinks = chain.hold_run_up_ends(pulleys, kinks, sign)
    places = chain.cut_chain(pulleys.wrap)
    led, anchors = nodes[..., places.stations], chain.anchor_positions(belt, pulleys, places)
    forces = jnp.zeros_like(led)
    if len(nodes) > 1:
        twist = chain.twist_of_cells(belt, pulleys, places, jnp.maximum(-0.5 * was.loads[TAIL, 0], 0.0))
        forces += twist_energy(led, twist, belt.twist.cubic).forces.reshape(led.shape)
    if belt.loads is not None:
        forces += command.share * load_forces(belt, led)
    if kinks is not None:
        aside, slopes = chain.end_offsets(belt, pulleys, places, led, 0.0, kinks)
        anchors += aside
        end = chain.run_up_end(-sign)
        ends, leaving = places.ends[:, end], pulleys.wrap.outer(end)
        led = led.at[..., ends].add(jnp.where(leaving != run_off, aside[..., ends], 0.0))
        landed = (anchors - led)[:, 1] / fixed.dt
        drag = chain.sway_drag(belt, places, led[:, 1], slopes, landed, speed, command.drag[1])
        forces, run_off = forces.at[:, 1].add(drag), leaving
    rest = jnp.where(places.free, led, anchors)
    stiffness = jnp.where(places.free, 0.0 * led, HOLD_STIFFNESS)
    if belt.guides is not None:  # a free node beyond a roller's face is pushed back to it
        force, guiding = guide_forces(belt, led, places.free)
        rest = rest.at[:, 1].add(force / jnp.where(guiding > 0.0, guiding, 1.0))
        stiffness = stiffness.at[:, 1].add(guiding)
    fewest = (was.pulleys.wrap.last - was.pulleys.wrap.first).min()
    back = (jnp.arange(n) - places.stations[0]) % n  # from the chain to stations' numbers
    found: list[Array] = [jnp.moveaxis(v[..., back], -1, 0) for v in (places.free, led, forces, rest, stiffness)]
    carried = was._replace(pulleys=pulleys, compliance_yaw=turned, kinks=kinks, run_off=run_off)
    return carried, StepInput._make((*found, driven, fewest))


@partial(jit_float64, static_argnums=0, effort=STEP_EFFORT)
def between_steps(
    unpack: tuple[Callable[[Array], Any], ...], fixed: Array, carried: Array, instants: Array, joints: Array,
    slides: Array, pull: Array,
) -> tuple[Array, Array, StepInput]:  # fmt: skip
    """From one step of MuJoCo to the next: what is carried on, what the instruments read, the next step's input.

    fixed, carried, instants (2, k) of both steps: each tree as one vector, of which ``unpack`` makes it again, for a
    call of JAX costs by the number of its arguments; slides [m] of the nodes and pull [N] on them, (n, m, 3).
    """
    still, was, (now, following) = unpack[0](fixed), unpack[1](carried), map(unpack[2], instants)
    nodes = jnp.moveaxis(still.rest + slides, 0, -1)
    forces = jnp.moveaxis(pull, 0, -1).at[:, 2].add(-still.belt.mass[:, None] * still.belt.gravity)
    before, slips = (was.pulleys.pose, nodes), (was.slip, was.waiting)  # held nodes are on their anchors
    step = nodes, forces, 0.0, now.shaped, now.command, still.dt
    pulleys, slip, waiting, loads, read = chain.finish_step(still.belt, was.pulleys, slips, before, *step)
    after = was._replace(pulleys=pulleys, slip=slip, waiting=waiting, loads=loads)
    read = jnp.concatenate([read, slip.total, slip.sliding])
    after, given = hold_belt(still, after, following, joints, nodes)
    slid = given._replace(nodes=given.nodes - still.rest, rest=given.rest - still.rest)
    return ravel_pytree(after)[0], read, slid


#: columns of a reading besides: lateral slip [m] and share of sliding nodes on head and tail pulley, x of the tail
#: pulley [m], steps made, belt speed [m/s]
NATIVE_EXTRA = {"slip_head": 20, "slip_tail": 21, "sliding_head": 22, "sliding_tail": 23, "tail_x": run.TAIL_X}
NATIVE_EXTRA |= {"steps": 24, "belt_speed": run.SPEED}


@dataclass
class NativeState(Motion):
    """The belt and the machine at the end of a step; carried: ``Carried`` for the coming step, as a vector; given: what
    that starts from; readings (24,): of ``finish_step``, then slip and share of sliding nodes of both pulleys; acting:
    share and drag that MuJoCo's model has."""

    unpack: Callable[[Array], Carried]
    instant: np.ndarray
    carried: Array
    given: StepInput
    readings: np.ndarray
    acting: tuple[float, ...] = (math.nan, math.nan, math.nan)


_FEWEST = 2  # links on a pulley


class SpaceRun:
    """A held belt and what acts on it. belt: the case as arrays; laid: a belt at rest; fixed, begin: vectors of Fixed
    and of ``laid``, which ``unpack`` makes again, as those of Instant; rest_lengths [m], (k,) each: of the ties without
    and with camber, None where it has neither camber nor residual stress; state: of the run under way."""

    def __init__(
        self, case: Case, belt: str, options: Options, parts: SceneParts | None = None, scene_path: Path | None = None
    ) -> None:
        """Build the scene (and write its MJCF) with the belt laid round the pulleys; options: fitted to the case."""
        parts = parts or SceneParts.from_case(case, options.friction)
        spec, self.scene = build_scene(case, belt, options, parts)
        self.solver, mesh = Solver(compile_model(spec), self.scene.mesh.rest.shape), self.scene.mesh
        if scene_path is not None:
            write_text(scene_path, mjcf(spec))
        self.belt = in_float64(belt_arrays)(self.scene, active_features([parts]), mesh.mass / options.step**2)
        self.rest_lengths: tuple[np.ndarray, np.ndarray] | None = None
        if mesh.curvature is not None or mesh.residual:
            tied = self.solver.tied_nodes()
            self.rest_lengths = tie_lengths(mesh, tied, 0.0), tie_lengths(mesh, tied, 1.0)
            self.solver.set_rest_lengths(self.rest_lengths[0])
        model, shape = self.solver.model, self.belt.shape
        tail = chain.TailPulley.from_scene(self.scene, model, model.body_mass, model.dof_armature)
        wobbled = max(0.5 * options.settle, options.step)
        fixed = Fixed(self.belt, tail, mesh.rest, options.step, wobbled)
        pulleys, slip = chain.lay_pulleys(self.scene, self.belt), wrap.SlipState.none(shape.lines, shape.stations)
        ends = [pulleys.wrap.outer(chain.run_up_end(sign)) for sign in (shape.sign, -shape.sign)]
        kinks, run_off = (chain.RopeKinks(ends[0], *np.zeros((2, 2))), ends[1]) if shape.limp else (None, None)
        self.laid = Carried(pulleys, slip, np.array(wrap.NEITHER), np.zeros((2, 3)), np.zeros(2), kinks, run_off)
        instant = Instant(run.Command(0.0, np.zeros(2), 0.0, 0.0, 0.0, np.zeros(2), 0.0), 0.0, 0.0)
        vectors, self.unpack = zip(*map(in_float64(ravel_pytree), (fixed, self.laid, instant)), strict=True)
        self.begin = np.asarray(vectors[1])
        try:  # on the CPU, if JAX may use it: a step is a few operations between two of MuJoCo's
            processor = jax.devices("cpu")[0]
        except RuntimeError:
            processor = None
        self.fixed = in_float64(jax.device_put)(vectors[0], processor)
        self.state: NativeState | None = None

    def lay(self, first: np.ndarray) -> NativeState:
        """The belt laid round the pulleys, at rest, before a step to the instant ``first``, packed."""
        scene, at_rest = self.scene, np.zeros_like(first)
        joints, slides = np.split(laid_coordinates(scene, *self.laid.pulleys.pose.spin), [STATION_JOINTS])
        slides, at_rest[0], at_rest[8] = slides.reshape(scene.mesh.rest.shape), -scene.early, math.inf
        motion = joints, np.zeros_like(joints), slides, np.zeros_like(slides)
        # where ``between_steps`` leaves it as well, which is compiled anew for a vector that stands elsewhere
        carried: Any = in_float64(jax.device_put)(self.begin, self.fixed.sharding), None, np.zeros(24)
        state = NativeState(*motion, self.unpack[1], at_rest, *carried)
        self._carry(state, first)
        return state

    def step(self, state: NativeState, instant: np.ndarray, following: np.ndarray) -> None:
        """The step to an instant, for which the state is ready, and all that makes it ready for the following one."""
        solver, given, drag = self.solver, state.given, instant[6:8]
        if self.rest_lengths is not None and state.acting[0] != instant[3]:
            straight, curved = self.rest_lengths
            solver.set_rest_lengths(straight + instant[3] * (curved - straight))
        if state.acting[1:] != tuple(drag):
            damping = self.scene.mesh.mass[:, None] * drag[[0, 1, 1]]  # [N s/m], along x, and across
            solver.model.dof_damping[solver.base :] = np.broadcast_to(damping, solver.shape).ravel()
        state.acting = instant[3], *drag
        state.joints, state.joint_rates, forces = np.array(given.joints)
        state.slides, state.instant = np.array(given.nodes), instant
        solver.step(state, given.rest, given.stiffness, given.forces, forces)
        held = ~given.free
        state.slides[held] = given.rest[held]
        self._carry(state, following)

    def _carry(self, state: NativeState, following: np.ndarray) -> None:
        pull, joints = self.solver.elastic_forces(state.slides), np.stack([state.joints, state.joint_rates])
        instants = np.stack([state.instant, following])
        found = between_steps(self.unpack, self.fixed, state.carried, instants, joints, state.slides, pull)
        state.carried, state.readings = found[0], np.asarray(found[1])
        state.given = StepInput(*map(np.asarray, found[2]))
        if state.given.fewest < _FEWEST:
            raise SimulationError("the belt leaves a pulley: tension too low for its weight; raise tension")

    def go(
        self, travel: float, observers: Sequence[Observer] = (), steer: Callable[[NativeState], float] | None = None
    ) -> Curves:
        """All steps up to ``travel`` [m]; steer: yaw [rad] that is added to the tail pulley's, of the state."""
        scene, solver, recorder = self.scene, self.solver, run.Recorder(self.scene, observers, NATIVE_EXTRA)
        rows, resting = instants_of(scene, travel)

        def instant(steps: int, **at: float) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
            """What the recorder is told after so many steps of the run-in and the run."""
            read = np.append(state.readings, steps)
            for name, value in at.items():
                read[run.READING[name]] = value
            return read, state.slides, float(state.instant[9]), state.instant[1:3]

        advancing = [o.advance for o in observers if hasattr(o, "advance")]  # who want to know the share that is made
        watched = run.notify_observers(observers, scene.case, travel, recorder.curves, solver.model, solver.data)
        with watched, silence_expected_warnings():
            state = self.state = self.lay(rows[0])
            for k, row in enumerate(rows):
                following = rows[min(k + 1, len(rows) - 1)]
                if steer is not None and k >= resting and following[0] > 0.0:
                    following[2] += steer(state)
                if k >= resting and not recorder.table and row[0] >= 0.0:  # y counts from here
                    state.instant = row
                    recorder.add(*instant(k - resting, travel=0.0, speed=row[4]))
                self.step(state, row, following)
                if k % run.TOLD_EVERY == 0:
                    for advance in advancing:
                        advance(k / len(rows))
                if k >= resting and row[0] >= recorder.next_reading and (row[4] != 0.0 or not recorder.table):
                    recorder.add(*instant(k + 1 - resting))
            if recorder.table:
                recorder.show(*instant(len(rows) - resting), last=True)
        return recorder.curves()


def instants_of(scene: SceneLayout, travel: float) -> tuple[np.ndarray, int]:
    """Packed instants of all steps of a run over ``travel`` [m], (steps, 11), and how many come before the run-in."""
    plan, resting = run.plan_in_time(scene, travel)
    steps = np.arange(len(plan.travel))
    shaped = (plan.travel >= 0.0) & (steps >= resting)
    columns = [plan.travel, plan.yaw, plan.share, plan.speed, plan.acceleration, plan.drag, plan.friction]
    return np.column_stack([*columns, (steps + 1) * scene.options.step, shaped]), resting


def run_native(
    case: Case, *, belt: str = "flex", travel: float, options: Options | None = None, parts: SceneParts | None = None,
    scene_path: Path | None = None, observers: Sequence[Observer] = (), contact: str = CONTACTS[0],
    edited: Edited | None = None,
) -> Curves:  # fmt: skip
    """Run ``case`` over ``travel`` [m] of belt and return its curves; y = 0 at travel 0.

    belt: one of BELTS; parts: what stands in the scene, None = as the case has it; scene_path: where to write the MJCF;
    contact: one of CONTACTS; edited: with "mujoco", the scene that is run instead of the case's own. Raises
    SimulationError, with the curves so far in its ``curves``, when the run diverges, and CannotRepresent for a limp
    belt with finite friction: the friction law takes the place of the last station on a pulley for its own.
    """
    options = options or Options()
    parts = parts or SceneParts.from_case(case, options.friction)
    if contact == CONTACTS[0]:
        refuse_sliding_limp(belt, options, parts)
    options = fit_options(options, case, belt, contact)
    if contact == CONTACTS[0]:
        return SpaceRun(case, belt, options, parts, scene_path).go(travel, observers)
    return ContactRun(case, belt, options, parts, scene_path, edited).go(travel, observers)
