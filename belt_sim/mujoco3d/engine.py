"""A run in three dimensions: case in, curves out. One step is pulleys, springs, forces, MuJoCo, contact."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import jax
import mujoco
import numpy as np

from belt_sim.case import Case, Schedule
from belt_sim.curves import Curves
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.files import write_text
from belt_sim.frame import Observer
from belt_sim.jax_setup import in_float64
from belt_sim.mujoco3d.belt import (
    BeltArrays,
    active_features,
    belt_arrays,
    guide_forces,
    load_forces,
)
from belt_sim.mujoco3d.contact import lay_wraps, update_contact
from belt_sim.mujoco3d.elastic import twist_forces
from belt_sim.mujoco3d.friction import read_sliding_stiffness
from belt_sim.mujoco3d.machine import STATION_JOINTS, SceneLayout, build_scene, laid_coordinates
from belt_sim.mujoco3d.mesh import drag_coefficients, tie_lengths
from belt_sim.mujoco3d.mujoco_interface import Solver, Springs, compile_model, mjcf
from belt_sim.mujoco3d.options import (
    BELTS,
    CONTACTS,
    KINK_STATIONS,
    LAYER_TIME,
    Options,
    fit_options,
    is_limp,
)
from belt_sim.mujoco3d.pulleys import Pulleys, TailPulley, belt_loads, laid_poses
from belt_sim.mujoco3d.recording import Recorder, notify_observers
from belt_sim.mujoco3d.rolling_contact import build_contact
from belt_sim.mujoco3d.rolling_run import Edited, run_contact
from belt_sim.mujoco3d.rope import RopeKinks, hold_run_up_end, run_off_end, run_off_line, run_up_end
from belt_sim.mujoco3d.run_stages import Command, Stage, apply_command, run_stages
from belt_sim.mujoco3d.state import RunState
from belt_sim.mujoco3d.wrap import (
    FIRST,
    HEAD,
    LAST,
    TAIL,
    BeltOnPulley,
    anchor_places,
    layer_displacements,
    layer_of_fibres,
    outer_depth,
    sink_ends,
)
from belt_sim.scene_parts import SceneParts


def section_couples(engine: "Engine", state: RunState) -> np.ndarray:
    """The couples on the sections of the free spans that lines lack (elastic.TwistStiffness), as vertical forces on the
    outer nodes, (n, m, 3) [N]."""
    belt, rest = engine.belt, engine.scene.mesh.rest
    tension = max(-0.5 * float(state.loads[TAIL, 0]), 0.0)
    ends = np.array([[w.first, w.last] for w in state.wraps])
    pulleys = [engine.pulley(state, which) for which in (HEAD, TAIL)]
    behind = np.array([[outer_depth(pulley, end) for end in (FIRST, LAST)] for pulley in pulleys])
    stiffness = belt.twist.of_cells(belt.chord, ends, behind, tension, len(rest))
    roll = rest[:, 0, 2] - rest[:, -1, 2] + state.slides[:, 0, 2] - state.slides[:, -1, 2]
    couple = twist_forces(roll, stiffness, belt.twist.cubic)
    forces = np.zeros_like(state.slides)
    forces[:, 0, 2] = couple - np.roll(couple, 1)
    forces[:, -1, 2] = -forces[:, 0, 2]
    return forces


def span_loads(engine: "Engine", state: RunState) -> np.ndarray:
    """Loads at a place of the spans or all along them, as they set in, (n, m, 3) [N]."""
    nodes = engine.scene.mesh.nodes(state.slides)
    return state.share * np.moveaxis(load_forces(engine.belt, nodes), -1, 0)


def sway_drag(engine: "Engine", state: RunState, springs: Springs) -> np.ndarray:
    """What is added to the drag of a limp belt's slides, (n, m, 3) [N], so that it acts against waves only.

    It is drag times the sideways speed of a straight span, which is linear between its ends: at the tangent point
    (theta its direction) that is v (theta + slope), at the run-up it is the pulley's.
    """
    mesh, options, sign = engine.scene.mesh, engine.scene.options, engine.belt.shape.sign
    forces, y = np.zeros_like(state.slides), mesh.rest[..., 1] + state.slides[..., 1]
    if state.speed == 0.0:
        return forces
    for begins, ends in ((HEAD, TAIL), (TAIL, HEAD)):
        wrap, first = state.wraps[ends], state.run_off_stations[begins]
        landed = wrap.outer(run_up_end(sign))
        links = sign * (landed - first) % mesh.stations
        k = (first + sign * np.arange(1, links + 1)) % mesh.stations
        theta = (y[k[-1]] - y[k[0]]) / (mesh.chord * (links - 1))
        at_run_off = state.speed * (theta + state.kink_slope[begins])
        at_run_up = (springs.rest[k[-1]] - state.slides[k[-1]])[:, 1] / options.dt
        share = np.arange(1, links)[:, None] / links
        forces[k[:-1], :, 1] = options.damping * mesh.mass * (at_run_off + (at_run_up - at_run_off) * share)
    return forces


@dataclass(frozen=True)
class Engine:
    """What acts on a state. belt: the case as arrays; rest_lengths [m], (k,) each: of the ties without and with camber,
    None where the belt has neither camber nor residual stress."""

    scene: SceneLayout
    solver: Solver
    belt: BeltArrays
    pulleys: Pulleys
    rest_lengths: tuple[np.ndarray, np.ndarray] | None

    @staticmethod
    def from_scene(scene: SceneLayout, solver: Solver) -> "Engine":
        mesh, options, parts = scene.mesh, scene.options, scene.parts
        belt = belt_arrays(scene, active_features([parts])._replace(slips=False))
        belt, shape = jax.tree.map(lambda v: v if v.ndim else float(v), belt), belt.shape
        rest_lengths = None
        if mesh.curvature is not None or mesh.residual:
            tied = solver.tied_nodes()
            rest_lengths = tie_lengths(mesh, tied, 0.0), tie_lengths(mesh, tied, 1.0)
            solver.set_rest_lengths(rest_lengths[0])
        if math.isfinite(parts.friction) or options.tensioning == "koller":
            inertia = mesh.mass / options.dt**2
            sliding = in_float64(read_sliding_stiffness)(belt.ties, shape.bonds, mesh, scene.loop, inertia)
            belt = replace(belt, sliding_stiffness=sliding)
        tail = TailPulley.from_scene(scene, solver.model, solver.model.body_mass, solver.model.dof_armature)
        return Engine(scene, solver, belt, Pulleys(scene, belt, tail), rest_lengths)

    def lay(self) -> RunState:
        """The belt laid round the pulleys, at rest."""
        scene, mesh, sign, poses = self.scene, self.scene.mesh, self.belt.shape.sign, laid_poses(self.scene)
        wraps = lay_wraps(scene, self.belt, poses)
        joints, slides = np.split(laid_coordinates(scene, poses[HEAD].spin, poses[TAIL].spin), [STATION_JOINTS])
        state = RunState(
            joints=joints,
            joint_rates=np.zeros_like(joints),
            slides=slides.reshape(mesh.rest.shape),
            slide_rates=np.zeros(mesh.rest.shape),
            poses=poses,
            wraps=wraps,
            layers=[np.zeros((2, mesh.lines, 2)) for _ in wraps],
            slip_increments=[np.zeros((mesh.lines, 2, mesh.stations)) for _ in wraps],
            travel=-scene.early,
            kinks=[RopeKinks.from_wrap(wrap, sign) for wrap in wraps],
            run_off_stations=[wrap.outer(run_off_end(sign)) for wrap in wraps],
            kink_slope=np.zeros((2, mesh.lines)),
        )
        state.loads = self._loads(state, mesh.nodes(state.slides), self._pull(state))
        return state

    def step(self, state: RunState, command: Command) -> None:
        """One step of the state, whose travel, speed, time and yaw are those of its end already (``apply_command``)."""
        scene, solver, belt, dt = self.scene, self.solver, self.belt, self.scene.options.dt
        joint_forces = self.pulleys.advance(state, command, dt)
        springs = self._springs(state)
        forces = np.zeros_like(state.slides)
        if scene.mesh.lines > 1:
            forces += section_couples(self, state)
        if belt.loads is not None:
            forces += span_loads(self, state)
        if belt.shape.limp:
            forces += sway_drag(self, state, springs)
        if self.rest_lengths is not None:
            straight, curved = self.rest_lengths
            solver.set_rest_lengths(straight + state.share * (curved - straight))
        solver.damp(drag_coefficients(scene.mesh, *command.drag))
        solver.step(state, springs, forces, joint_forces)
        self.pulleys.read(state)
        for which in (HEAD, TAIL):
            held = state.held_stations(which)
            state.slides[held] = springs.rest[held]
        nodes, pull = scene.mesh.nodes(state.slides), self._pull(state)
        state.loads = self._loads(state, nodes, pull)
        update_contact(belt, state, nodes, pull, dt, command.friction)
        if belt.fibres is not None:
            for which, layer in enumerate(state.layers):
                wanted = layer_of_fibres(belt, self.pulley(state, which), state.share, nodes)
                layer += (wanted - layer) * min(dt / LAYER_TIME, 1.0)

    def pulley(self, state: RunState, which: int) -> BeltOnPulley:
        """The belt on the head or the tail pulley."""
        return BeltOnPulley(state.wraps[which], self.belt.each_surface[which], state.poses[which], state.layers[which])

    def _loads(self, state: RunState, nodes: np.ndarray, pull: np.ndarray) -> np.ndarray:
        return np.stack([belt_loads(self.pulley(state, which), nodes, pull) for which in (HEAD, TAIL)])

    def _pull(self, state: RunState) -> np.ndarray:
        """Forces of belt and weight [N] on the nodes, shape (m, 3, n)."""
        pull = self.solver.elastic_forces(state.slides)
        pull[..., 2] -= self.scene.mesh.mass * self.scene.parts.gravity
        return np.moveaxis(pull, 0, -1)

    def _springs(self, state: RunState) -> Springs:
        """All that holds nodes in the coming step: anchors on the pulleys, where these will be at its end, and guides
        beside the spans."""
        mesh, belt, shape, springs = self.scene.mesh, self.belt, self.belt.shape, Springs.none(state.slides.shape)
        for which, pose in enumerate(state.poses):
            for end in (FIRST, LAST):
                pulley = self.pulley(state, which)
                state.wraps[which] = sink_ends(belt, pulley, end, state.rolled[which], state.shaped)
            if shape.limp:
                held = hold_run_up_end(self.pulley(state, which), state.kinks[which], shape.sign)
                state.wraps[which], state.kinks[which] = held
            wrap, k = state.wraps[which], state.held_stations(which)
            turned = wrap.angle[:, k] + pose.spin
            places = anchor_places(wrap.r[:, k], wrap.y[:, k], turned, pose.axes[..., None], pose.centre[:, None])
            if belt.fibres is not None:
                places += layer_displacements(belt, self.pulley(state, which), k)
            springs.rest[k] = np.moveaxis(places, -1, 0) - mesh.rest[k]
            springs.stiffness[k] = self.scene.options.hold_stiffness
            if shape.limp:
                self._straighten_ends(state, which, springs)
        if belt.guides is not None:
            self._press_guides(state, springs)
        return springs

    def _straighten_ends(self, state: RunState, which: int, springs: Springs) -> None:
        """Put the outermost stations of a limp belt on the lines through the tangent points.

        A station that has just become the last is moved there at once: the line then does not notice the change.
        """
        wrap, pose, kink, sign = state.wraps[which], state.poses[which], state.kinks[which], self.belt.shape.sign
        n, mesh = self.belt.shape.stations, self.scene.mesh
        springs.rest[kink.station % n] -= kink.offset * pose.axes[:, 1]
        last = wrap.outer(run_off_end(sign))
        free, far = (mesh.rest[k] + state.slides[k] for k in ((last + sign * i) % n for i in (1, KINK_STATIONS)))
        move, state.kink_slope[which] = run_off_line(wrap, pose, sign, free, far, self.belt.chord)
        aside = move[:, None] * pose.axes[:, 1]
        springs.rest[last % n] += aside
        if last != state.run_off_stations[which]:
            state.slides[last % n] += aside
            state.run_off_stations[which] = last

    def _press_guides(self, state: RunState, springs: Springs) -> None:
        """A free node beyond a roller's face gets a spring that pushes the edge back to it."""
        free = np.ones(self.belt.shape.stations, bool)
        for which in (HEAD, TAIL):
            free[state.held_stations(which)] = False
        force, stiffness = guide_forces(self.belt, self.scene.mesh.nodes(state.slides), free)
        k = np.flatnonzero(stiffness[0])
        springs.stiffness[k, :, 1] = stiffness[:, k].T
        springs.rest[k, :, 1] = state.slides[k, :, 1] + (force[:, k] / stiffness[:, k]).T


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
        return run_contact(case, belt, travel, options, parts, path, observers, edited)

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
