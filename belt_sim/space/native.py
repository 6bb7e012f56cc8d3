"""A run in three dimensions: case in, curves out. One step is pulleys, springs, forces, MuJoCo, contact."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from belt_sim.case import Case, Schedule
from belt_sim.case import Numbers as Array
from belt_sim.curves import Curves, Observer
from belt_sim.errors import CannotRepresent, InputError, SimulationError
from belt_sim.io import write_text
from belt_sim.jax_setup import in_float64, jit_float64
from belt_sim.scene_parts import SceneParts
from belt_sim.space.belt import BeltArrays, active_features, belt_arrays, guide_forces, load_forces
from belt_sim.space.chain import (
    RopeKinks,
    anchor_positions,
    cut_chain,
    end_offsets,
    hold_run_up_end,
    run_off_end,
    sway_drag,
    twist_of_cells,
    twist_on_nodes,
)
from belt_sim.space.loop import library_of, smoothstep
from belt_sim.space.machine import STATION_JOINTS, SceneLayout, build_scene, laid_coordinates
from belt_sim.space.mesh import tie_lengths
from belt_sim.space.mujoco_interface import Motion, Solver, compile_model, mjcf, silence_expected_warnings
from belt_sim.space.options import BELTS, CONTACTS, Options, fit_options, is_limp
from belt_sim.space.pulleys import TailPulley, belt_loads, lay_pulleys, pose_of
from belt_sim.space.rolling_contact import build_contact, story
from belt_sim.space.rolling_run import ContactRun, Edited
from belt_sim.space.run import TOLD_EVERY, Command, Recorder, notify_observers, plan_in_time, reading, tell_share
from belt_sim.space.wrap import (
    NEITHER,
    TAIL,
    BeltOnPulley,
    SlipState,
    carry_wraps,
    sink_wraps,
    slide_wraps,
)


@dataclass(frozen=True)
class Packing:
    """How a tree of arrays lies in one vector of floats: a call of JAX costs by the number of its arguments."""

    structure: Any
    shapes: tuple[tuple[int, ...], ...]
    kinds: tuple[str, ...]

    @staticmethod
    def of(tree: Any) -> "Packing":
        leaves, structure = jax.tree.flatten(tree)
        arrays = [np.asarray(leaf) for leaf in leaves]
        return Packing(structure, tuple(a.shape for a in arrays), tuple(a.dtype.str for a in arrays))

    def pack(self, tree: Any) -> Array:
        """The vector of a tree of this structure."""
        leaves = jax.tree.leaves(tree)
        library = library_of(leaves[0])
        return library.concatenate([library.ravel(leaf).astype(float) for leaf in leaves])

    def unpack(self, vector: Array) -> Any:
        """The tree; integers are integers again."""
        ends = np.cumsum([math.prod(shape) for shape in self.shapes])
        parts = (vector[end - math.prod(shape) : end] for end, shape in zip(ends, self.shapes, strict=True))
        each = zip(parts, self.shapes, self.kinds, strict=True)
        return jax.tree.unflatten(self.structure, [part.reshape(shape).astype(kind) for part, shape, kind in each])


class Fixed(NamedTuple):
    """What stands still in a run: belt and tail pulley; rest [m], (n, m, 3): of the mesh; dt [s]; hold_stiffness [N/m];
    wobbled [s]: time over which a wobble sets in."""

    belt: BeltArrays
    tail: TailPulley
    rest: Array
    dt: Array
    hold_stiffness: Array
    wobbled: Array


class Carried(NamedTuple):
    """What goes from step to step beside MuJoCo's coordinates; of arrays of two the first is the head pulley's.

    pulleys: where they are at the end of the coming step, the stations on them, their bending layers (wrap.py); slip:
    of these stations; waiting: the pulley on which the belt did not slide in the last step, because both take turns
    (-1 = neither); loads, (2, 3): of ``belt_loads``; compliance_yaw [rad], (2,); kinks, run_off: of a limp belt, its
    stations at the run-offs when they were last put on their lines, (2,).
    """

    pulleys: BeltOnPulley
    slip: SlipState
    waiting: Array
    loads: Array
    compliance_yaw: Array
    kinks: RopeKinks | None = None
    run_off: Array | None = None


class Instant(NamedTuple):
    """A step's end: the command, the time [s], and 1 from travel 0 on, where stations land on the pulleys as they are,
    0 before, on plain cylinders."""

    command: Command
    time: Array
    shaped: Array


class StepInput(NamedTuple):
    """What a step of MuJoCo starts from. free, (n,): whether a station lies on no pulley; nodes [m], (n, m, 3), where a
    limp belt's new outermost stations have been moved; forces [N] on them; rest [m] and stiffness [N/m] of the springs,
    of pulleys and guides, of the same shape; joints [rad, m], their rates, and the forces on them [N m, N], (3, 5);
    fewest: links that lie on a pulley."""

    free: Array
    nodes: Array
    forces: Array
    rest: Array
    stiffness: Array
    joints: Array
    fewest: Array


def carry_belt(fixed: Fixed, was: Carried, at: Instant, nodes: Array, pull: Array) -> tuple[Carried, Array]:
    """After a step, with held nodes on their anchors: loads on the pulleys, and what slid, landed and left; and what
    the instruments read, (22,): ``reading``, then slip and share of sliding nodes of both pulleys, x of the tail.

    nodes [m], pull [N], (m, 3, n): of belt and weight on the nodes.
    """
    belt, (command, _, shaped), pulleys, slip, waiting = fixed.belt, at, was.pulleys, was.slip, was.waiting
    loads = belt_loads(pulleys, nodes, pull)
    if belt.sliding_stiffness is not None:
        moves = command.friction, command.speed, shaped
        pulleys, slip, waiting = slide_wraps(belt, pulleys, slip, waiting, pull, *moves)
    pulleys = carry_wraps(belt, pulleys, (pulleys.pose, nodes), nodes, 0.0, shaped, command.share, fixed.dt)
    tail_x = pulleys.pose.centre[TAIL, 0]
    read = reading(belt, nodes, pulleys.wrap.first, pulleys.wrap.last, tail_x, command.share)
    read = jnp.concatenate([read, slip.total, slip.sliding, tail_x[None]])
    return was._replace(pulleys=pulleys, slip=slip, waiting=waiting, loads=loads), read


def hold_belt(fixed: Fixed, was: Carried, at: Instant, joints: Array, nodes: Array) -> tuple[Carried, StepInput]:
    """Before a step: the pulleys where they will be at its end, their stations on their anchors, and all other forces.

    joints [rad, m] and their rates, (2, 5); nodes [m], (m, 3, n).
    """
    belt, (command, time, shaped), pulleys, kinks, run_off = fixed.belt, at, was.pulleys, was.kinks, was.run_off
    sign, n, speed, before = belt.shape.sign, nodes.shape[-1], command.speed, was.pulleys.pose
    driven, tail, turned = fixed.tail.advance(belt, joints, was.loads, was.compliance_yaw, command, fixed.dt)
    pulleys = pulleys._replace(pose=pose_of(belt, command, tail, turned, smoothstep(time / fixed.wobbled)))
    moved = jnp.abs(pulleys.pose.spin - before.spin) * belt.surfaces.radius
    pulleys = sink_wraps(belt, pulleys, before, moved, shaped, (speed == 0.0) & (command.travel >= 0.0))
    if kinks is not None:
        wraps, kinks = jax.vmap(partial(hold_run_up_end, sign=sign))(pulleys, kinks)
        pulleys = pulleys._replace(wrap=wraps)
    places = cut_chain(pulleys.wrap)
    chain, anchors = nodes[..., places.stations], anchor_positions(belt, pulleys, places)
    forces = jnp.zeros_like(chain)
    if len(nodes) > 1:
        tension = jnp.maximum(-0.5 * was.loads[TAIL, 0], 0.0)
        forces += twist_on_nodes(belt, chain, twist_of_cells(belt, pulleys, places, tension))
    if belt.loads is not None:
        forces += command.share * load_forces(belt, chain)
    if kinks is not None:
        aside, slopes = end_offsets(belt, pulleys, places, chain, 0.0, kinks)
        anchors += aside
        end = run_off_end(sign)
        ends, leaving = places.ends[:, end], pulleys.wrap.outer(end)
        chain = chain.at[..., ends].add(jnp.where(leaving != run_off, aside[..., ends], 0.0))
        landed = (anchors - chain)[:, 1] / fixed.dt
        drag = sway_drag(belt, places, chain[:, 1], slopes, landed, speed, command.drag[1])
        forces, run_off = forces.at[:, 1].add(drag), leaving
    rest = jnp.where(places.free, chain, anchors)
    stiffness = jnp.where(places.free, 0.0 * chain, fixed.hold_stiffness)
    if belt.guides is not None:  # a free node beyond a roller's face is pushed back to it
        force, guiding = guide_forces(belt, chain, places.free)
        rest = rest.at[:, 1].add(force / jnp.where(guiding > 0.0, guiding, 1.0))
        stiffness = stiffness.at[:, 1].add(guiding)
    fewest = (was.pulleys.wrap.last - was.pulleys.wrap.first).min()
    back = (jnp.arange(n) - places.stations[0]) % n  # from the chain to stations' numbers
    found = (places.free, chain, forces, rest, stiffness)
    carried = was._replace(pulleys=pulleys, compliance_yaw=turned, kinks=kinks, run_off=run_off)
    return carried, StepInput(*(jnp.moveaxis(v[..., back], -1, 0) for v in found), driven, fewest)


@partial(jit_float64, static_argnums=0)
def between_steps(
    packings: tuple[Packing, Packing, Packing], fixed: Array, carried: Array, instants: Array, joints: Array,
    slides: Array, pull: Array,
) -> tuple[Array, Array, StepInput]:  # fmt: skip
    """From one step of MuJoCo to the next: what is carried on, what the instruments read, the next step's input.

    fixed, carried, instants (2, k), of the step that has been made and of the next: packed; joints, (2, 5): and rates;
    slides [m] of the nodes and the belt's pull [N] on them, (n, m, 3).
    """
    still, was = packings[0].unpack(fixed), packings[1].unpack(carried)
    now, following = (packings[2].unpack(instant) for instant in instants)
    nodes = jnp.moveaxis(still.rest + slides, 0, -1)
    forces = jnp.moveaxis(pull, 0, -1).at[:, 2].add(-still.belt.mass[:, None] * still.belt.gravity)
    after, read = carry_belt(still, was, now, nodes, forces)
    after, given = hold_belt(still, after, following, joints, nodes)
    slid = given._replace(nodes=given.nodes - still.rest, rest=given.rest - still.rest)
    return packings[1].pack(after), read, slid


@dataclass
class NativeState(Motion):
    """The belt and the machine at the end of a step. carried: packed ``Carried``, for the coming step; given: what that
    starts from; readings: as of ``carry_belt``; acting: share and drag that MuJoCo's model has; the others as of
    RunState."""

    packing: Packing
    instant: np.ndarray
    carried: Array
    given: StepInput
    readings: np.ndarray
    acting: tuple[float, ...] = (math.nan, math.nan, math.nan)

    travel = property(lambda self: float(self.instant[0]))
    yaw = property(lambda self: self.instant[1:3])
    share = property(lambda self: float(self.instant[3]))
    speed = property(lambda self: float(self.instant[4]))
    time = property(lambda self: float(self.instant[9]))
    tail_x = property(lambda self: float(self.readings[-1]))
    slip = property(lambda self: SlipState(None, self.readings[17:19], self.readings[19:21], None))

    def read(self, arrays: BeltArrays, nodes: np.ndarray) -> np.ndarray:
        """What ``reading`` says, shape (17,)."""
        return self.readings[:17]

    @property
    def carrying(self) -> Carried:
        """``carried`` in the open."""
        found: Carried = self.packing.unpack(np.asarray(self.carried))
        return found

    def held_stations(self, pulley: int) -> np.ndarray:
        """Numbers of the stations on a pulley."""
        wrap = self.carrying.pulleys.wrap
        return np.arange(int(wrap.first[pulley]), int(wrap.last[pulley]) + 1) % len(self.slides)


_FEWEST = 2  # links on a pulley


@dataclass(frozen=True)
class Engine:
    """What acts on a state. belt: the case as arrays; packings: of Fixed, Carried and Instant; fixed: packed; laid: a
    belt at rest; rest_lengths [m], (k,) each: of the ties without and with camber, None where the belt has neither
    camber nor residual stress."""

    scene: SceneLayout
    solver: Solver
    belt: BeltArrays
    packings: tuple[Packing, Packing, Packing]
    fixed: Array
    laid: Carried
    rest_lengths: tuple[np.ndarray, np.ndarray] | None

    @staticmethod
    def from_scene(scene: SceneLayout, solver: Solver) -> "Engine":
        mesh, options, parts = scene.mesh, scene.options, scene.parts
        belt = in_float64(belt_arrays)(scene, active_features([parts]), mesh.mass / options.step**2)
        rest_lengths = None
        if mesh.curvature is not None or mesh.residual:
            tied = solver.tied_nodes()
            rest_lengths = tie_lengths(mesh, tied, 0.0), tie_lengths(mesh, tied, 1.0)
            solver.set_rest_lengths(rest_lengths[0])
        tail = TailPulley.from_scene(scene, solver.model, solver.model.body_mass, solver.model.dof_armature)
        wobbled = max(0.5 * options.settle, options.step)
        fixed = Fixed(belt, tail, mesh.rest, options.step, options.hold_stiffness, wobbled)
        pulleys, shape = lay_pulleys(scene, belt), belt.shape
        kinks = RopeKinks.from_wrap(pulleys.wrap, shape.sign) if shape.limp else None
        run_off = pulleys.wrap.outer(run_off_end(shape.sign)) if shape.limp else None
        slip = SlipState.none(shape.lines, shape.stations)
        laid = Carried(pulleys, slip, np.array(NEITHER), np.zeros((2, 3)), np.zeros(2), kinks, run_off)
        instant = Instant(Command(0.0, np.zeros(2), 0.0, 0.0, 0.0, np.zeros(2), 0.0), 0.0, 0.0)
        packings = Packing.of(fixed), Packing.of(laid), Packing.of(instant)
        on_device = in_float64(jax.device_put)(packings[0].pack(fixed), _processor())
        return Engine(scene, solver, belt, packings, on_device, laid, rest_lengths)

    def lay(self, first: np.ndarray) -> NativeState:
        """The belt laid round the pulleys, at rest, before a step to the instant ``first``, packed."""
        scene, mesh, at_rest = self.scene, self.scene.mesh, np.zeros_like(first)
        joints, slides = np.split(laid_coordinates(scene, *self.laid.pulleys.pose.spin), [STATION_JOINTS])
        slides, at_rest[0], at_rest[8] = slides.reshape(mesh.rest.shape), -scene.early, math.inf
        still = np.zeros_like(joints), np.zeros_like(slides)
        carried, given, read = self.packings[1].pack(self.laid), None, np.zeros(22)
        state = NativeState(joints, still[0], slides, still[1], self.packings[1], at_rest, carried, given, read)  # type: ignore[arg-type]
        self._carry(state, first)
        return state

    def step(self, state: NativeState, instant: np.ndarray, following: np.ndarray) -> None:
        """The step to an instant, for which the state is ready, and all that makes it ready for the following one."""
        solver, given, drag = self.solver, state.given, instant[6:8]
        if self.rest_lengths is not None and state.acting[0] != instant[3]:
            straight, curved = self.rest_lengths
            solver.set_rest_lengths(straight + instant[3] * (curved - straight))
        if state.acting[1:] != tuple(drag):
            damping = self.scene.mesh.mass[:, None] * drag[[0, 1, 1]]  # along x, and across
            solver.damp(np.broadcast_to(damping, solver.shape))
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
        found = between_steps(self.packings, self.fixed, state.carried, instants, joints, state.slides, pull)
        state.carried, state.readings = found[0], np.asarray(found[1])
        state.given = StepInput(*map(np.asarray, found[2]))
        if state.given.fewest < _FEWEST:
            raise SimulationError("the belt leaves a pulley: tension too low for its weight; raise tension")


def _processor() -> jax.Device | None:
    """The CPU, if JAX may use it: a step is a few operations between two of MuJoCo's."""
    try:
        return jax.devices("cpu")[0]
    except RuntimeError:
        return None


def simulate(
    case: Case,
    *,
    belt: str = "flex",
    travel: float,
    options: Options | None = None,
    parts: SceneParts | None = None,
    scene_path: Path | None = None,
    observers: Sequence[Observer] = (),
    control: bool = False,
    contact: str = CONTACTS[0],
    edited: Edited | None = None,
) -> Curves:
    """Run ``case`` over ``travel`` [m] of belt and return its curves; y = 0 at travel 0.

    belt: "rope", "grid" or "flex"; parts: what stands in the scene, None = as the case has it; scene_path: where to
    write the MJCF; control: subtract a run without yaw; contact: one of CONTACTS; edited: with "mujoco", the scene that
    is run instead of the case's own.
    Raises SimulationError, with the curves so far in its ``curves``, when the run diverges, and CannotRepresent for a
    limp belt with finite friction: the friction law takes the place of the last station on a pulley for its own.
    """
    if belt not in BELTS:
        raise InputError("belt", belt, "", f"choose one of {', '.join(BELTS)}")
    options = options or Options()
    parts = parts or SceneParts.from_case(case, options.friction)
    held = contact == CONTACTS[0]
    if held and math.isfinite(parts.friction) and is_limp(belt, options):
        raise CannotRepresent(f"model.friction = {parts.friction:g}: a limp belt sticks here; leave it out")
    options = fit_options(options, case, belt, contact)

    def run(case: Case, path: Path | None = None, observers: Sequence[Observer] = ()) -> Curves:
        if held:
            return SpaceRun.begin(case, belt, options, parts, path).go(travel, observers)
        return ContactRun.begin(case, belt, options, parts, path, edited).go(travel, observers)

    curves = run(case, scene_path, observers)
    if not control:
        return curves
    aligned = replace(case.settings, yaw=Schedule.step(0.0), yaw_head=Schedule.step(0.0))
    zero = run(replace(case, settings=aligned))
    drift = np.array([np.interp(curves.travel, zero.travel, y) for y in zero.y])
    names = {f"control_{k + 1}": y for k, y in enumerate(drift)}
    return replace(curves, y=curves.y - drift, extra=(curves.extra or {}) | names)


def contact_scene(case: Case, belt: str, options: Options, parts: SceneParts) -> tuple[mujoco.MjSpec, str]:
    """The specification of a case's scene that MuJoCo's contacts carry, and what is to be said of it in its MJCF."""
    spec, scene = build_contact(case, belt, fit_options(options, case, belt, CONTACTS[1]), parts)
    return spec, story(scene)


@dataclass
class SpaceRun:
    """One run under way."""

    scene: SceneLayout
    engine: Engine
    state: NativeState | None = None

    @staticmethod
    def begin(
        case: Case, belt: str, options: Options, parts: SceneParts | None = None, scene_path: Path | None = None
    ) -> "SpaceRun":
        """Build the scene (and write its MJCF) with the belt laid round the pulleys; options: fitted to the case."""
        parts = parts or SceneParts.from_case(case, options.friction)
        spec, scene = build_scene(case, belt, options, parts)
        model = compile_model(spec)
        if scene_path is not None:
            write_text(scene_path, mjcf(spec))
        return SpaceRun(scene, Engine.from_scene(scene, Solver(model, scene.mesh.rest.shape)))

    def go(
        self, travel: float, observers: Sequence[Observer] = (), steer: Callable[[NativeState], float] | None = None
    ) -> Curves:
        """All steps up to ``travel`` [m]; steer: yaw [rad] that is added to the tail pulley's, of the state."""
        scene, solver, recorder = self.scene, self.engine.solver, Recorder(self.scene, tuple(observers))
        rows, resting = instants_of(scene, travel)
        watched = notify_observers(recorder.observers, scene.case, travel, recorder.curves, solver.model, solver.data)
        with watched, silence_expected_warnings():
            state = self.state = self.engine.lay(rows[0])
            for k, row in enumerate(rows):
                following = rows[min(k + 1, len(rows) - 1)]
                if steer is not None and k >= resting and following[0] > 0.0:
                    following[2] += steer(state)
                if k >= resting and not recorder.rows and row[0] >= 0.0:
                    state.instant = row
                    recorder.begin(state)
                self.engine.step(state, row, following)
                if k % TOLD_EVERY == 0:
                    tell_share(recorder.observers, k / len(rows))
                if k >= resting:
                    recorder.step(state)
            recorder.end(state)
        return recorder.curves()


def instants_of(scene: SceneLayout, travel: float) -> tuple[np.ndarray, int]:
    """Packed instants of all steps of a run over ``travel`` [m], (steps, 11), and how many come before the run-in."""
    plan, resting = plan_in_time(scene, travel)
    steps = np.arange(len(plan.travel))
    shaped = (plan.travel >= 0.0) & (steps >= resting)
    columns = [plan.travel, plan.yaw, plan.share, plan.speed, plan.acceleration, plan.drag, plan.friction]
    return np.column_stack([*columns, (steps + 1) * scene.options.step, shaped]), resting
