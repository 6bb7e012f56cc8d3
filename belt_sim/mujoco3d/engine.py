"""A run in three dimensions: case in, curves out. One step is pulleys, springs, forces, MuJoCo, contact."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from belt_sim.case import Case, Schedule
from belt_sim.curves import Curves
from belt_sim.errors import CannotRepresent, InputError, RunFailed
from belt_sim.files import write_text
from belt_sim.frame import Observer, SceneObserver
from belt_sim.mujoco3d.friction import WrapStiffness
from belt_sim.mujoco3d.loads import (
    DistributedLoads,
    EdgeGuideSprings,
    NodeLoad,
    PushLoads,
    Torsion,
    loads_on_pulleys,
    pull_on_nodes,
)
from belt_sim.mujoco3d.machine import Drive, Pulleys, SceneLayout, build_scene
from belt_sim.mujoco3d.mesh import BeltModel, Chain, Grid, Membrane, Mesh, drag_coefficients
from belt_sim.mujoco3d.mujoco_4 import Solver, Springs, compile_model, mjcf
from belt_sim.mujoco3d.options import (
    BELTS,
    CONTACTS,
    FURTHEST_KINK,
    KINK_STATIONS,
    Options,
    contact_options,
    fit_options,
    is_limp,
)
from belt_sim.mujoco3d.recording import Recorder
from belt_sim.mujoco3d.rolling_contact import Edited, build_contact, run_contact
from belt_sim.mujoco3d.stages import Stage, run_stages
from belt_sim.mujoco3d.state import HEAD, TAIL, Pose, RunState, Wrap, cylinder_coordinates
from belt_sim.mujoco3d.stress_free import RestLengths
from belt_sim.mujoco3d.wrap import (
    FIRST,
    LAST,
    BendingLayer,
    depth,
    held_displacements,
    lay_wraps,
    move_anchors,
    shape_pulleys,
    update_contact,
)
from belt_sim.scene_parts import SceneParts

# How a belt without bending stiffness meets and leaves a pulley between two stations, and what damps its sway.
#
# Where such a belt runs off it has a kink, from the direction of the stations that lie on the pulley to that of the
# span. If the span simply began at the last station held, each release would let its beginning jump by kink x chord
# (10-18 um at 25 mm and a yaw of 0.042 deg). The spans of a limp belt ring with these jumps, and as the stations land
# in step with them, each landing catches the same phase: the rate of drift comes out wrong by as much as a fifth. So
# the span of a limp belt begins at the tangent point: the last station held stands on the straight line through the
# tangent point and the first free station.
#
# At the run-up a yaw step makes such a kink. The belt on the pulley turns with it, and the span goes on from the
# tangent point, which does not move. The outermost station held is up to half a chord before or behind that point and
# the pulley would take it aside by yaw x this distance, and the span with it (15 um at 40 mm), for a span length of
# travel. Before the tangent point a station belongs to the span and is not taken along; behind it, it is, but the
# span's line goes through the tangent point until the next station lands.
#
# Belts with bending stiffness have no kink and need none of this.


def run_off(wrap: Wrap, sign: int) -> int:
    """The last station held where the belt leaves; sign: +1 or -1, travel along station numbers."""
    return wrap.last if sign > 0 else wrap.first


def place_run_off_stations(mesh: Mesh, state: RunState, springs: Springs, sign: int) -> None:
    """Before a step: put the last stations on the lines through the tangent points.

    A station that has just become the last is moved there at once: the line then does not notice the change.
    """
    n = mesh.stations
    for which, (wrap, pose) in enumerate(zip(state.wraps, state.poses, strict=True)):
        last = run_off(wrap, sign)
        k, landed, free = last % n, (last - sign) % n, (last + sign) % n
        r, y, angle = cylinder_coordinates(mesh.at(springs.rest, [k, landed]), pose)
        state.kink_slope[which] = slope = (y[1] - y[0]) / mesh.chord
        beyond = _beyond_tangent(
            mesh, mesh.at(state.slides, (last + sign * KINK_STATIONS) % n), pose, sign, r[0], angle[0]
        )
        tangent = y[0] + slope * beyond
        y_free = cylinder_coordinates(mesh.at(state.slides, free), pose)[1]
        move = tangent + (y_free - tangent) * beyond / (beyond + mesh.chord) - y[0]
        aside = move[:, None] * pose.axes[:, 1]
        springs.rest[k] += aside
        if last != state.run_off_stations[which]:
            state.slides[k] += aside
            state.run_off_stations[which] = last


def hold_run_up_ends(mesh: Mesh, state: RunState, springs: Springs, sign: int) -> None:
    """Before a step: keep the spans' ends at the tangent points while the pulleys at their run-ups are yawed."""
    end = FIRST if sign > 0 else LAST
    for which, (wrap, pose) in enumerate(zip(state.wraps, state.poses, strict=True)):
        outer, yaw = run_off(wrap, -sign), math.atan2(-pose.axes[0, 1], pose.axes[1, 1])
        if outer != state.run_up_stations[which]:
            state.run_up_stations[which], state.run_up_offset[which] = outer, 0.0
        k = outer % mesh.stations
        inside = float(depth(wrap, pose, wrap.angle[k].mean(), end))
        ahead = -end * inside * math.cos(wrap.tangent[(end + 1) // 2])  # along x
        taken = (yaw - state.run_up_yaw[which]) * ahead
        state.run_up_yaw[which] = yaw
        if inside < 0.0:
            wrap.y[k] -= taken
            springs.rest[k] -= taken * pose.axes[:, 1]
        else:
            state.run_up_offset[which] += taken
        springs.rest[k] -= state.run_up_offset[which] * pose.axes[:, 1]


def _beyond_tangent(mesh: Mesh, far: np.ndarray, pose: Pose, sign: int, r: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """How far the last nodes held, at radius r and material angle, are beyond the tangent point [m], shape (m,).

    far [m], shape (m, 3): nodes further along the span, to which it runs straight.
    """
    r_far, _, angle_far = cylinder_coordinates(far, pose)
    ahead = r_far * np.sin(sign * (angle_far - angle))
    beyond = r * np.arctan2(r_far * np.cos(angle_far - angle) - r, ahead)
    return np.clip(beyond, -FURTHEST_KINK * mesh.chord, FURTHEST_KINK * mesh.chord)


@dataclass(frozen=True)
class SwayDrag:
    """What is added to the drag of the nodes' slides, so that it acts against waves only.

    sign: +1 or -1, travel along station numbers; drag [N s/m], shape (m,): sideways damping of a node; dt [s].
    """

    mesh: Mesh
    sign: int
    drag: np.ndarray
    dt: float

    def forces(self, state: RunState, springs: Springs) -> np.ndarray:
        """Drag times the sideways speed of a straight span, which is linear between its ends.

        At the tangent point (theta its direction) that is v (theta + slope), at the run-up it is the pulley's.
        """
        mesh, forces = self.mesh, np.zeros_like(state.slides)
        if state.speed == 0.0:
            return forces
        for begins, ends in ((HEAD, TAIL), (TAIL, HEAD)):
            wrap, first = state.wraps[ends], state.run_off_stations[begins]
            landed = wrap.first if self.sign > 0 else wrap.last
            links = self.sign * (landed - first) % mesh.stations
            k = (first + self.sign * np.arange(1, links + 1)) % mesh.stations
            y = mesh.at(state.slides, k[-1])[:, 1]
            theta = (y - mesh.at(state.slides, k[0])[:, 1]) / (mesh.chord * (links - 1))
            at_run_off = state.speed * (theta + state.kink_slope[begins])
            at_run_up = (springs.rest[k[-1]] - state.slides[k[-1]])[:, 1] / self.dt
            share = np.arange(1, links)[:, None] / links
            forces[k[:-1], :, 1] = self.drag * (at_run_off + (at_run_up - at_run_off) * share)
        return forces


@dataclass(frozen=True)
class Engine:
    """What acts on a state. tangent: None for a belt that only sticks; rest_lengths: None without camber and residual
    stress; limp: without bending stiffness in its spans; layer: None for a belt that leaves a pulley like a thread."""

    scene: SceneLayout
    solver: Solver
    pulleys: Pulleys
    loads: tuple[NodeLoad, ...]
    guides: EdgeGuideSprings
    tangent: WrapStiffness | None
    rest_lengths: RestLengths | None
    limp: bool
    layer: BendingLayer | None

    @staticmethod
    def of(scene: SceneLayout, solver: Solver, limp: bool) -> "Engine":
        """For a compiled scene."""
        mesh, options = scene.mesh, scene.options
        pulleys = Pulleys.of(scene, solver)
        loads: list[NodeLoad] = []
        if mesh.across > 1:
            loads.append(Torsion.of(scene.case.belt, mesh))
        parts = scene.parts
        if parts.pushes:
            loads.append(PushLoads(parts.pushes, mesh))
        if parts.lean or parts.roll:
            loads.append(DistributedLoads(parts.lean * parts.gravity, parts.roll, mesh))
        if limp:
            loads.append(SwayDrag(mesh, int(pulleys.sign), options.damping * mesh.mass, options.dt))
        curved = parts.camber is not None or mesh.residual
        rest_lengths = RestLengths.of(mesh, solver) if curved else None
        if rest_lengths is not None and mesh.residual:
            solver.set_rest_lengths(rest_lengths.lengths(0.0))
        slides = math.isfinite(parts.friction) or options.tensioning == "koller"
        return Engine(
            scene=scene,
            solver=solver,
            pulleys=pulleys,
            loads=tuple(loads),
            guides=EdgeGuideSprings(parts.edge_guides, mesh),
            tangent=WrapStiffness.of(mesh, scene.loop, solver, options.dt) if slides else None,
            rest_lengths=rest_lengths,
            limp=limp,
            layer=BendingLayer.of(scene.case, mesh, parts.lift_off, options.dt) if parts.lift_off else None,
        )

    def lay(self) -> RunState:
        """The belt laid round the pulleys, at rest."""
        scene, poses = self.scene, self.pulleys.laid()
        mesh = scene.mesh
        slides = mesh.laid - mesh.rest
        radii = scene.parts.head.radius, scene.parts.tail.radius
        wraps = lay_wraps(mesh, scene.loop, slides, poses, radii)
        pull = pull_on_nodes(mesh, self.solver, slides, scene.parts.gravity)
        joints = self.pulleys.joints(poses)
        return RunState(
            joints=joints,
            joint_rates=np.zeros_like(joints),
            slides=slides,
            slide_rates=np.zeros_like(slides),
            poses=poses,
            wraps=wraps,
            loads=loads_on_pulleys(mesh, slides, pull, wraps, poses),
            run_off_stations=[run_off(wrap, int(self.pulleys.sign)) for wrap in wraps],
            kink_slope=np.zeros((2, mesh.across)),
            run_up_stations=[run_off(wrap, -int(self.pulleys.sign)) for wrap in wraps],
            travel=-scene.early,
        )

    def step(self, state: RunState, drive: Drive) -> None:
        """One step of the state, whose travel, speed, time and yaw are those of its end already (``command``)."""
        scene, solver = self.scene, self.solver
        joint_forces = self.pulleys.advance(state, drive, scene.options.dt)
        move_anchors(state, scene.mesh.chord)
        springs = self._springs(state)
        forces = np.zeros_like(state.slides)
        for load in self.loads:
            forces += load.forces(state, springs)
        if self.rest_lengths is not None:
            solver.set_rest_lengths(self.rest_lengths.lengths(state.share))
        solver.damp(drag_coefficients(scene.mesh, *drive.drag))
        solver.step(state, springs, forces, joint_forces)
        if solver.diverged:
            raise RunFailed(f"the belt's acceleration grew without bound at {state.time:.3f} s: halve options.dt")
        self.pulleys.read(state)
        for wrap in state.wraps:
            state.slides[wrap.stations] = springs.rest[wrap.stations]
        pull = pull_on_nodes(scene.mesh, solver, state.slides, scene.parts.gravity)
        state.loads = loads_on_pulleys(scene.mesh, state.slides, pull, state.wraps, state.poses)
        update_contact(scene.mesh, state, pull, scene.options.dt, drive.friction, self.tangent)
        if self.layer is not None:
            self.layer.follow(state)

    def _springs(self, state: RunState) -> Springs:
        """All that holds nodes in the coming step: anchors on the pulleys, and guides beside the spans."""
        mesh, springs = self.scene.mesh, Springs.none(state.slides.shape)
        for wrap, pose in zip(state.wraps, state.poses, strict=True):
            springs.rest[wrap.stations] = wrap.place(pose) - mesh.rest[wrap.stations]
            if self.layer is not None:
                springs.rest[wrap.stations] += held_displacements(wrap, pose, mesh)
            springs.stiffness[wrap.stations] = self.scene.options.hold_stiffness
        if self.limp:
            hold_run_up_ends(mesh, state, springs, int(self.pulleys.sign))
            place_run_off_stations(mesh, state, springs, int(self.pulleys.sign))
        self.guides.press(state, springs)
        return springs


def apply_command(state: RunState, drive: Drive, dt: float) -> None:
    """What the machine is told counts from the beginning of the step."""
    state.time += dt
    state.travel, state.speed, state.yaw, state.share = drive.travel, drive.speed, drive.yaw, drive.share


BELT_MODELS: dict[str, Callable[[], BeltModel]] = {"rope": Chain, "grid": Grid, "flex": Membrane}


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
    Raises RunFailed, with the curves so far in its ``curves``, when the run diverges, and CannotRepresent for a limp
    belt with finite friction: the friction law takes the place of the last station on a pulley for its own.
    """
    if belt not in BELTS:
        raise InputError("belt", belt, "", f"choose one of {', '.join(BELTS)}")
    options = options or Options()
    parts = parts or SceneParts.undisturbed(case, options.friction)
    held = contact == CONTACTS[0]
    if held and math.isfinite(parts.friction) and is_limp(belt, options):
        raise CannotRepresent(f"options.friction = {parts.friction:g}: a limp belt sticks here; leave it out")
    options = fit_options(options if held else contact_options(options), case, belt)

    def run(case: Case, path: Path | None = None, observers: Sequence[Observer] = ()) -> Curves:
        if held:
            return SpaceRun.begin(case, belt, options, parts, path).go(travel, observers)
        return run_contact(case, BELT_MODELS[belt](), travel, options, parts, path, observers, edited)

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
    options = fit_options(contact_options(options), case, belt)
    return build_contact(case, BELT_MODELS[belt](), options, SceneParts.undisturbed(case, options.friction))[0]


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
        spec, scene = build_scene(
            case, BELT_MODELS[belt](), options, parts or SceneParts.undisturbed(case, options.friction)
        )
        model = compile_model(spec)
        if scene_path is not None:
            write_text(scene_path, mjcf(spec))
        engine = Engine.of(scene, Solver(model, scene.mesh.rest.shape), is_limp(belt, options))
        return SpaceRun(scene, engine, engine.lay())

    def stages(self, travel: float) -> list[Stage]:
        """What it consists of, in order."""
        return run_stages(self.scene, self.engine.pulleys.load, travel)

    def go(self, travel: float, observers: Iterable[Observer] = ()) -> Curves:
        """All stages up to ``travel`` [m]."""
        recorder = Recorder(self.scene, tuple(observers))
        for observer in recorder.observers:
            observer.start(self.scene.case, travel)
            if isinstance(observer, SceneObserver):
                observer.show(self.engine.solver.model, self.engine.solver.data)
        try:
            for stage in self.stages(travel):
                self.through(stage, recorder)
        except RunFailed as failure:
            failure.curves = recorder.curves()
            raise
        finally:
            for observer in recorder.observers:
                observer.finish(recorder.curves())
        return recorder.curves()

    def through(self, stage: Stage, recorder: Recorder) -> None:
        """All steps of a stage."""
        scene, state = self.scene, self.state
        for drive in stage.drives(state):
            apply_command(state, drive, scene.options.dt)
            if stage.recorded and recorder.start is None and state.travel >= 0.0:
                recorder.begin(state)
                shape_pulleys(state, scene.parts)
            self.engine.step(state, drive)
            if stage.recorded:
                recorder.step(state)
            elif math.isfinite(stage.frame):
                recorder.watch(state, stage.frame)
