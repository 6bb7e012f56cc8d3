"""A run in three dimensions: case in, curves out. One step is pulleys, springs, forces, MuJoCo, contact."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from belt_sim.case import Case, Schedule
from belt_sim.case import Numbers as Array
from belt_sim.curves import Curves, Observer
from belt_sim.errors import CannotRepresent, InputError, SimulationError
from belt_sim.files import write_text
from belt_sim.jax_setup import in_float64, jit_float64
from belt_sim.scene_parts import SceneParts
from belt_sim.space.belt import BeltArrays, active_features, belt_arrays, guide_forces, load_forces
from belt_sim.space.chain import anchor_positions, cut_chain, twist_of_cells, twist_on_nodes
from belt_sim.space.loop import smoothstep
from belt_sim.space.machine import STATION_JOINTS, SceneLayout, build_scene, laid_coordinates
from belt_sim.space.mesh import drag_coefficients, tie_lengths
from belt_sim.space.mujoco_interface import Solver, compile_model, mjcf
from belt_sim.space.options import BELTS, CONTACTS, Options, fit_options, is_limp
from belt_sim.space.pulleys import TailPulley, belt_loads, lay_pulleys, pose_of
from belt_sim.space.recording import Recorder, notify_observers
from belt_sim.space.rolling_contact import build_contact
from belt_sim.space.rolling_run import ContactRun, Edited
from belt_sim.space.rope import RopeKinks, end_offsets, hold_run_up_end, run_off_end, sway_drag
from belt_sim.space.run_stages import Command, Stage, apply_command, run_stages
from belt_sim.space.state import RunState
from belt_sim.space.wrap import (
    HEAD,
    TAIL,
    BeltOnPulley,
    SlipState,
    WrapArrays,
    carry_wraps,
    sink_wraps,
    slide_wrap,
)


def plain(command: Command) -> Command:
    """The command in arrays alone, for which one program is compiled."""
    return jax.tree.map(np.asarray, command._replace(tail_motion=None))


class StepInput(NamedTuple):
    """What a step of MuJoCo starts from, (n, m, 3) each but free, (n,), whether a station lies on no pulley: nodes [m],
    where a limp belt's new outermost stations have been moved; forces [N] on them; rest [m] and stiffness [N/m] of the
    springs, of pulleys and guides."""

    free: Array
    nodes: Array
    forces: Array
    rest: Array
    stiffness: Array


#: head and tail, kinks and run-off stations of a limp belt: of RunState
OnPulleys: TypeAlias = tuple[BeltOnPulley, RopeKinks | None, Array | None]


@jit_float64
def hold_belt(
    belt: BeltArrays, was: OnPulleys, command: Command, tail: Array, turned: Array, askew: Array, nodes: Array,
    tension: Array, shaped: Array, hold_stiffness: Array, dt: Array,
) -> tuple[OnPulleys, StepInput]:  # fmt: skip
    """Before a step: the pulleys where they will be at its end, their stations on their anchors, and all other forces.

    tail, turned, askew: as of ``pose_of``; nodes [m], (m, 3, n); tension [N]: of a span; shaped: as of RunState;
    hold_stiffness [N/m].
    """
    sign, n, speed = belt.shape.sign, nodes.shape[-1], command.speed
    pulleys, kinks, run_off = was
    before = pulleys.pose
    pulleys = pulleys._replace(pose=pose_of(belt, command, tail, turned, askew))
    moved = jnp.abs(pulleys.pose.spin - before.spin) * belt.surfaces.radius
    pulleys = sink_wraps(belt, pulleys, before, moved, shaped, (speed == 0.0) & (command.travel >= 0.0))
    if kinks is not None:
        wraps, kinks = jax.vmap(partial(hold_run_up_end, sign=sign))(pulleys, kinks)
        pulleys = pulleys._replace(wrap=wraps)
    places = cut_chain(pulleys.wrap)
    chain, anchors = nodes[..., places.stations], anchor_positions(belt, pulleys, places)
    forces = jnp.zeros_like(chain)
    if len(nodes) > 1:
        forces += twist_on_nodes(belt, chain, twist_of_cells(belt, pulleys, places, tension))
    if belt.loads is not None:
        forces += command.share * load_forces(belt, chain)
    if kinks is not None:
        aside, slopes = end_offsets(belt, pulleys, places, chain, 0.0, kinks)
        anchors += aside
        end = run_off_end(sign)
        ends, leaving = places.ends[:, end], pulleys.wrap.outer(end)
        chain = chain.at[..., ends].add(jnp.where(leaving != run_off, aside[..., ends], 0.0))
        drag = sway_drag(belt, places, chain[:, 1], slopes, (anchors - chain)[:, 1] / dt, speed, command.drag[1])
        forces, run_off = forces.at[:, 1].add(drag), leaving
    rest, stiffness = jnp.where(places.free, chain, anchors), jnp.where(places.free, 0.0 * chain, hold_stiffness)
    if belt.guides is not None:  # a free node beyond a roller's face is pushed back to it
        force, guiding = guide_forces(belt, chain, places.free)
        rest = rest.at[:, 1].add(force / jnp.where(guiding > 0.0, guiding, 1.0))
        stiffness = stiffness.at[:, 1].add(guiding)
    back = (jnp.arange(n) - places.stations[0]) % n  # from the chain to stations' numbers
    found = (places.free, chain, forces, rest, stiffness)
    return (pulleys, kinks, run_off), StepInput(*(jnp.moveaxis(v[..., back], -1, 0) for v in found))


_NEITHER = -1


@jit_float64
def carry_belt(
    belt: BeltArrays, pulleys: BeltOnPulley, slip: SlipState, waiting: Array, command: Command, nodes: Array,
    pull: Array, shaped: Array, dt: Array,
) -> tuple[BeltOnPulley, SlipState, Array, Array]:  # fmt: skip
    """After a step, with held nodes on their anchors: loads on the pulleys, (2, 3), and what slid, landed and left.

    nodes [m], pull [N], (m, 3, n): of belt and weight on the nodes; waiting: the pulley that waited in the last step.
    When both belts slide as a whole they take turns, since each reckons with the other standing still.
    """
    loads = belt_loads(pulleys, nodes, pull)
    if belt.sliding_stiffness is not None:
        turn = jnp.where(waiting == HEAD, TAIL, HEAD)
        waiting = jnp.where((slip.sliding > 0.5).all(), turn, _NEITHER)

        def slide(of: tuple[Array, BeltOnPulley, SlipState]) -> tuple[WrapArrays, SlipState]:
            which, pulley, own = of
            moves = partial(slide_wrap, belt, pull, command.friction, command.speed, shaped, pulley, own)
            return jax.lax.cond(which == waiting, lambda: (pulley.wrap, own), moves)

        wraps, slip = jax.lax.map(slide, (jnp.arange(2), pulleys, slip))
        pulleys = pulleys._replace(wrap=wraps)
    pulleys = carry_wraps(belt, pulleys, (pulleys.pose, nodes), nodes, 0.0, shaped, command.share, dt)
    return pulleys, slip, waiting, loads


_FEWEST = 2  # links on a pulley


@dataclass(frozen=True)
class Engine:
    """What acts on a state. belt: the case as arrays, and on JAX's device; rest_lengths [m], (k,) each: of the ties
    without and with camber, None where the belt has neither camber nor residual stress."""

    scene: SceneLayout
    solver: Solver
    belt: BeltArrays
    on_device: BeltArrays
    tail: TailPulley
    rest_lengths: tuple[np.ndarray, np.ndarray] | None

    @staticmethod
    def from_scene(scene: SceneLayout, solver: Solver) -> "Engine":
        mesh, options, parts = scene.mesh, scene.options, scene.parts
        slips = math.isfinite(parts.friction) or options.tensioning == "koller"
        features = active_features([parts])._replace(slips=slips)
        belt = in_float64(belt_arrays)(scene, features, mesh.mass / options.dt**2)
        rest_lengths = None
        if mesh.curvature is not None or mesh.residual:
            tied = solver.tied_nodes()
            rest_lengths = tie_lengths(mesh, tied, 0.0), tie_lengths(mesh, tied, 1.0)
            solver.set_rest_lengths(rest_lengths[0])
        tail = TailPulley.from_scene(scene, solver.model, solver.model.body_mass, solver.model.dof_armature)
        on_device = in_float64(jax.device_put)(belt, _processor())
        return Engine(scene, solver, belt, on_device, tail, rest_lengths)

    def lay(self) -> RunState:
        """The belt laid round the pulleys, at rest."""
        scene, mesh, shape = self.scene, self.scene.mesh, self.belt.shape
        pulleys = lay_pulleys(scene, self.belt)
        joints, slides = np.split(laid_coordinates(scene, *pulleys.pose.spin), [STATION_JOINTS])
        slides = slides.reshape(mesh.rest.shape)
        return RunState(
            joints=joints,
            joint_rates=np.zeros_like(joints),
            slides=slides,
            slide_rates=np.zeros_like(slides),
            pulleys=pulleys,
            slip=SlipState.none(shape.lines, shape.stations),
            travel=-scene.early,
            kinks=RopeKinks.from_wrap(pulleys.wrap, shape.sign) if shape.limp else None,
            run_off_stations=pulleys.wrap.outer(run_off_end(shape.sign)) if shape.limp else None,
            loads=np.array(_loads(pulleys, mesh.nodes(slides), self._pull(slides))),
        )

    def step(self, state: RunState, command: Command) -> None:
        """One step of the state, whose travel, speed, time and yaw are those of its end already (``apply_command``)."""
        solver, mesh, dt = self.solver, self.scene.mesh, self.scene.options.dt
        joint_forces, given = self.hold(state, command)
        if self.rest_lengths is not None:
            straight, curved = self.rest_lengths
            solver.set_rest_lengths(straight + state.share * (curved - straight))
        solver.damp(drag_coefficients(mesh, *command.drag))
        held, rest = ~given.free, given.rest - mesh.rest
        state.slides[:] = given.nodes - mesh.rest
        solver.step(state, rest, given.stiffness, given.forces, joint_forces)
        state.slides[held] = rest[held]
        state.pulleys, state.slip, waiting, loads = carry_belt(
            self.on_device, state.pulleys, state.slip, state.waiting_pulley, plain(command),
            mesh.nodes(state.slides), self._pull(state.slides), state.shaped, dt,
        )  # fmt: skip
        state.waiting_pulley, state.loads = int(waiting), np.array(loads)
        wrap = state.pulleys.wrap
        if (np.asarray(wrap.last - wrap.first) < _FEWEST).any():
            raise SimulationError("the belt leaves a pulley: tension too low for its weight; raise settings.tension")

    def hold(self, state: RunState, command: Command) -> tuple[np.ndarray, StepInput]:
        """Forces on the joints [N or N m], (5,), and all that the nodes are given in the coming step."""
        options, nodes = self.scene.options, self.scene.mesh.nodes(state.slides)
        forces, tail = self.tail.advance(self.belt, state, command, options.dt)
        askew = smoothstep(state.time / max(0.5 * options.settle, options.dt))
        tension, was = -0.5 * state.loads[TAIL, 0], (state.pulleys, state.kinks, state.run_off_stations)
        found, given = hold_belt(
            self.on_device, was, plain(command), tail, state.compliance_yaw, askew, nodes,
            np.maximum(tension, 0.0), state.shaped, options.hold_stiffness, options.dt,
        )  # fmt: skip
        state.pulleys, state.kinks, state.run_off_stations = found
        return forces, StepInput(*map(np.asarray, given))

    def _pull(self, slides: np.ndarray) -> np.ndarray:
        """Forces of belt and weight [N] on the nodes, shape (m, 3, n)."""
        pull = self.solver.elastic_forces(slides)
        pull[..., 2] -= self.scene.mesh.mass * self.scene.parts.gravity
        return np.moveaxis(pull, 0, -1)


_loads = jit_float64(belt_loads)


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
        raise CannotRepresent(f"options.friction = {parts.friction:g}: a limp belt sticks here; leave it out")
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


def contact_scene(case: Case, belt: str, options: Options) -> mujoco.MjSpec:
    """The specification of a case's scene that MuJoCo's contacts carry."""
    options = fit_options(options, case, belt, CONTACTS[1])
    return build_contact(case, belt, options, SceneParts.from_case(case, options.friction))[0]


@dataclass
class SpaceRun:
    """One run under way."""

    scene: SceneLayout
    engine: Engine
    state: RunState

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
        engine = Engine.from_scene(scene, Solver(model, scene.mesh.rest.shape))
        return SpaceRun(scene, engine, engine.lay())

    def stages(self, travel: float) -> list[Stage]:
        return run_stages(self.scene, self.engine.belt.load, travel)

    def go(self, travel: float, observers: Iterable[Observer] = ()) -> Curves:
        """All stages up to ``travel`` [m]."""
        recorder, solver = Recorder(self.scene, tuple(observers)), self.engine.solver
        with notify_observers(recorder.observers, self.scene.case, travel, recorder.curves, solver.model, solver.data):
            for stage in self.stages(travel):
                self.run_stage(stage, recorder)
        return recorder.curves()

    def run_stage(self, stage: Stage, recorder: Recorder) -> None:
        scene, state = self.scene, self.state
        for command in stage.commands(state):
            apply_command(state, command, scene.options.dt)
            if stage.is_recorded and not recorder.rows and state.travel >= 0.0:
                recorder.begin(state)
                state.shaped = 1.0
            self.engine.step(state, command)
            if stage.is_recorded:
                recorder.step(state)
            elif math.isfinite(stage.frame):
                recorder.watch(state, stage.frame)
