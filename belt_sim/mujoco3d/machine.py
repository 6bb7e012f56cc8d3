"""Case -> MJCF, and the two pulleys: how they are yawed, driven and tensioned during a run.

The head pulley is driven, the tail pulley is free on its slide and its axis, both are yawed as commanded. Yaw steps are
made while the belt stands still, yaw ramps over travel.
"""

import math
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np

from belt_sim.case import Case, Schedule, Settings
from belt_sim.errors import CannotRepresent
from belt_sim.files import MODELS
from belt_sim.mujoco3d.loop import LaidLoop, lay_loop, lift
from belt_sim.mujoco3d.mesh import BeltModel, Membrane, Mesh
from belt_sim.mujoco3d.mujoco_4 import Solver, add_dummy_equality, set_solver
from belt_sim.mujoco3d.options import COMPLIANCE_TIME, RESIDUAL_TORSION, TAIL_DAMPING_RATIO, Options
from belt_sim.mujoco3d.state import TAIL, Pose, RunState
from belt_sim.mujoco3d.stress_free import with_curvature
from belt_sim.mujoco3d.tensioning import KollerPlan
from belt_sim.scene_parts import GuideRoller, PulleySurface, SceneParts
from belt_sim.si import N_PER_MM2


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Boundary values of a step, at its end.

    travel [m], speed [m/s], acceleration [m/s2]: of the belt, along its direction; yaw [rad], shape (2,): commanded,
    head and tail; share: how much of yaw offsets, cants and camber acts; slide_speed [m/s]: of a tail pulley that is
    moved, 0 = fixed, None = it follows the forces; lead [m/s]: how much faster than the belt the tail pulley's rim
    steadily goes; friction [1], inf = sticking; drag [1/s]: of the belt per unit of its mass, along x and across it.
    """

    travel: float
    speed: float = 0.0
    acceleration: float = 0.0
    yaw: np.ndarray = field(default_factory=lambda: np.zeros(2))
    share: float = 0.0
    slide_speed: float | None = None
    lead: float = 0.0
    friction: float
    drag: tuple[float, float]


#: entries of a schedule: at [m], over [m], change [rad]
_Entries = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class YawPlan:
    """What the head and the tail pulley are to be turned by."""

    head: _Entries
    tail: _Entries

    @staticmethod
    def of(settings: Settings) -> "YawPlan":
        """As it is set."""
        return YawPlan(_schedule_entries(settings.yaw_head), _schedule_entries(settings.yaw))

    def stops(self, until: float) -> set[float]:
        """Travels [m] of the steps within the run."""
        return {at for at, over, change in (*self.head, *self.tail) if over <= 0.0 and change and at < until}

    def angles(self, travel: float, done: float) -> np.ndarray:
        """Yaw [rad] of both at ``travel`` [m] when the steps up to travel ``done`` [m] have been made, shape (2,)."""
        return np.array([_yaw_angle(entries, travel, done) for entries in (self.head, self.tail)])

    def turning(self, travel: float, done: float, share: float) -> np.ndarray:
        """Yaw [rad] of both when ``share`` (0..1) of the step at ``travel`` [m] has been made, shape (2,)."""
        before = self.angles(travel, done)
        return before + share * (self.angles(travel, travel) - before)


def _schedule_entries(schedule: Schedule) -> _Entries:
    columns = (np.asarray(v, float).tolist() for v in (schedule.at, schedule.over, schedule.change))
    return tuple(zip(*columns, strict=True))


def _yaw_angle(entries: _Entries, travel: float, done: float) -> float:
    total = 0.0
    for at, over, change in entries:
        if over <= 0.0:
            total += change if at <= done else 0.0
        else:
            total += change * min(max((travel - at) / over, 0.0), 1.0)
    return total


def smoothstep(u: float) -> float:
    """From 0 at u = 0 to 1 at 1 and beyond, 3 u^2 - 2 u^3."""
    u = min(u, 1.0)
    return u * u * (3.0 - 2.0 * u)


STATION = MODELS / "pulley_station.xml"
#: the pulleys' joints in a scene; the nodes follow
HEAD_YAW, HEAD_SPIN, TAIL_SLIDE, TAIL_YAW, TAIL_SPIN = range(5)
STATION_JOINTS = 5
_STAGGER_MARGIN = 6.0  # 0.5 would be the limit of stability
_FACE_MARGIN = 1.5  # pulley face over belt width, only seen
_ROLLER = (0.02, 0.03)  # [m], radius and half height of an edge guide, only seen


@dataclass(frozen=True)
class SceneLayout:
    """What stands still in a run. case: with the gravity of its parts; early [m]: travel before travel 0; apart: how
    the pulleys move apart at its beginning."""

    case: Case
    options: Options
    parts: SceneParts
    mesh: Mesh
    loop: LaidLoop
    early: float
    koller: KollerPlan | None = None


def lay_out(case: Case, belt: BeltModel, options: Options, parts: SceneParts, *, path=lift) -> SceneLayout:
    """The scene: the belt's nodes laid round the pulleys, which they come onto along ``path`` (loop.py)."""
    case = replace(case, rig=replace(case.rig, gravity=parts.gravity))
    loop, laid = lay_loop(case, options.dx, path=path), case
    apart = KollerPlan.of(case, loop) if options.tensioning == "koller" else None
    if apart is not None:
        laid, loop = apart.slack, lay_loop(apart.slack, options.dx, len(loop.x), path=path)
    early = options.run_in + (apart.travel if apart else 0.0)
    mesh = _add_camber(belt.mesh(laid, loop, options), loop, parts, laid, early)
    if parts.residual:
        mesh = replace(mesh, residual=parts.residual / float(case.belt.youngs_modulus))
        _refuse_slack_lines(mesh, case, options, isinstance(belt, Membrane))
    return SceneLayout(case, options, parts, mesh, loop, early, apart)


def build_scene(case: Case, belt: BeltModel, options: Options, parts: SceneParts) -> tuple[mujoco.MjSpec, SceneLayout]:
    """The scene, and its specification, not yet compiled."""
    scene = lay_out(case, belt, options, parts)
    case, mesh, loop = scene.case, scene.mesh, scene.loop
    spec = mujoco.MjSpec()
    spec.modelname = "belt on two pulleys"
    set_solver(spec, options.dt, parts.gravity)
    spec.stat.extent = 2.0
    spec.worldbody.add_light(pos=[0, -3, 4], dir=[0, 0.6, -0.8], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    add_cameras(spec, float(case.rig.centre_distance))
    add_station(spec, "head", 0.0, parts.head, loop.radius_head, case, options)
    add_station(spec, "tail", float(case.rig.centre_distance), parts.tail, loop.radius_tail, case, options)
    add_dummy_equality(spec, "head-yaw")
    for k, guide in enumerate(parts.edge_guides):
        _draw_guide(spec, f"guide-{k}", guide, case)
    belt.tie(spec, mesh, case, options)
    pulleys = np.zeros(STATION_JOINTS)
    pulleys[TAIL_SLIDE] = loop.centre_distance - float(case.rig.centre_distance)
    spec.add_key(name="laid", qpos=np.concatenate([pulleys, (mesh.laid - mesh.rest).ravel()]))
    return spec, scene


def add_cameras(spec: mujoco.MjSpec, length: float) -> None:
    """Where one sees the whole machine from: the side (sag) and above (lateral movement)."""
    far = length + 0.5
    spec.worldbody.add_camera(name="side", pos=[length / 2, -far, 0.2], xyaxes=[1, 0, 0, 0, 0, 1])
    spec.worldbody.add_camera(name="above", pos=[length / 2, 0, far], xyaxes=[1, 0, 0, 0, 1, 0])


def _add_camber(mesh: Mesh, loop: LaidLoop, parts: SceneParts, case: Case, early: float) -> Mesh:
    """The mesh with the natural curvature that the belt has where each link lies at travel 0."""
    if parts.camber is None:
        return mesh
    if mesh.across == 1:
        raise CannotRepresent("camber: a rope of particles has no width that could be curved; use belt=flex or grid")
    shift = float(np.sign(float(case.settings.direction))) * early
    middle = loop.chord * (np.arange(mesh.stations) + 0.5) + shift
    return with_curvature(mesh, parts.camber(middle % (loop.chord * mesh.stations)))


def _refuse_slack_lines(mesh: Mesh, case: Case, options: Options, membrane: bool) -> None:
    """Raise CannotRepresent for a residual stress that presses a line of nodes, or takes all of the belt's torsion.

    Strips of a membrane between three or more lines hold each other's width and shear, and twist 9-15 % too easily.
    Steel edges carry pressure over some mm (studies/notes/shell.md); a line of nodes without plate stiffness folds.
    """
    tension, modulus = float(case.settings.tension), float(case.belt.youngs_modulus)
    what = f"effects = flatness: a residual stress of {mesh.residual * modulus / N_PER_MM2:.3g} N/mm2"
    if membrane and mesh.across > 2:
        raise CannotRepresent(f"{what} needs model.across = 2 in a membrane; use that, or model=mujoco_grid")
    if options.tensioning == "koller":
        raise CannotRepresent(f"{what} folds the slack belt of model.tensioning = koller; use force or length")
    if RESIDUAL_TORSION * mesh.residual * modulus >= tension:
        raise CannotRepresent(f"{what} is too much for {tension / N_PER_MM2:g} N/mm2: the spans twist by themselves")
    if tension + modulus * mesh.residual_strain.min() <= 0.0:
        raise CannotRepresent(f"{what} makes a line of {mesh.across} slack, which folds: give a smaller model.across")


def _draw_guide(spec: mujoco.MjSpec, name: str, guide: GuideRoller, case: Case) -> None:
    """A standing roller, only seen; what it does to the belt is in loads.py."""
    level = float(case.rig.tail_radius) * (1.0 if guide.span == "upper" else -1.0)
    y = guide.side * (0.5 * float(case.belt.width) + guide.gap + _ROLLER[0])
    geom = spec.worldbody.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[guide.x, y, level])
    geom.size, geom.rgba = [*_ROLLER, 0.0], [0.9, 0.6, 0.1, 1.0]
    geom.contype = geom.conaffinity = 0
    geom.group = 1


def add_station(
    spec: mujoco.MjSpec, name: str, x: float, surface: PulleySurface, radius: float, case: Case, options: Options
) -> None:
    """Attach models/pulley_station.xml; the head does not slide."""
    station = mujoco.MjSpec.from_file(str(STATION))
    mass = station_mass(case, options)
    width = float(case.belt.width)
    station.body("carriage").mass = mass
    station.joint("spin").armature = mass * radius**2
    station.geom("shell").size = [radius, 0.5 * _FACE_MARGIN * width, 0.0]
    station.geom("mark").size = [0.01, 0.501 * _FACE_MARGIN * width, 0.01]
    station.geom("mark").pos = [0.0, 0.0, radius - 0.014]  # below the surface: it stops no ray that looks for an edge
    station.site("top").pos, station.site("bottom").pos = [0, 0, radius], [0, 0, -radius]
    half = 0.5 * surface.cant
    station.body("fork").quat = [1.0, 0.0, 0.0, 0.0]
    station.body("pulley").quat = [math.cos(half), math.sin(half), 0.0, 0.0]
    if name == "head":
        station.delete(station.joint("slide"))
    frame = spec.worldbody.add_frame(pos=[x, 0.0, 0.0])
    spec.attach(station, frame=frame, prefix=f"{name}-")


def station_mass(case: Case, options: Options) -> float:
    """Inertia of the tail pulley [kg]: options.tail_mass, or more where the step needs it.

    The pulley feels the belt's pull one step late: stable for dt^2 k < 2 m, with k = 2 E b h / L of both spans.
    """
    stiffness = 2.0 * float(case.belt.youngs_modulus) * float(case.belt.area) / float(case.rig.span_length)
    return max(options.tail_mass, _STAGGER_MARGIN * options.dt**2 * stiffness)


@dataclass(frozen=True)
class Pulleys:
    """MuJoCo integrates the tail pulley's slide and spin; the rest is commanded.

    sign: +1 or -1, direction of travel; load [N]: force on the slide; slide_mass [kg], spin_inertia [kg m2],
    slide_drag [N s/m], spin_drag [N m s]: of the tail pulley; fixed: its slide is (tensioning by length).
    """

    scene: SceneLayout
    sign: float
    load: float
    slide_mass: float
    spin_inertia: float
    slide_drag: float
    spin_drag: float
    fixed: bool

    @staticmethod
    def of(scene: SceneLayout, solver: Solver) -> "Pulleys":
        """With the inertia that the compiled pulleys have."""
        model, case = solver.model, scene.case
        tail_bodies = [model.body(f"tail-{name}").id for name in ("carriage", "fork", "pulley")]
        mass = float(model.body_mass[tail_bodies].sum())
        stiffness = 2.0 * scene.mesh.line_stiffness.sum() / float(case.rig.span_length)
        drag = 2.0 * TAIL_DAMPING_RATIO * (stiffness * mass) ** 0.5
        return Pulleys(
            scene=scene,
            sign=float(np.sign(float(case.settings.direction))),
            load=2.0 * float(case.tension_force),
            slide_mass=mass,
            spin_inertia=float(model.dof_armature[TAIL_SPIN] + model.body_inertia[tail_bodies[-1], 1]),
            slide_drag=drag,
            spin_drag=drag * scene.parts.tail.radius**2,
            fixed=scene.options.tensioning == "length",
        )

    def laid(self) -> tuple[Pose, Pose]:
        """Both aligned, and turned back by what comes before travel 0, so that they have turned by 0 there."""
        parts, turned = self.scene.parts, -self.sign * self.scene.early
        at = (np.zeros(3), np.array([self.scene.loop.centre_distance, 0.0, 0.0]))
        head, tail = (
            Pose(centre, surface.axes(0.0, 0.0, askew=0.0), turned / surface.radius)
            for centre, surface in zip(at, (parts.head, parts.tail), strict=True)
        )
        return head, tail

    def joints(self, poses: tuple[Pose, Pose]) -> np.ndarray:
        """Coordinates of aligned pulleys in these places, shape (5,)."""
        joints = np.zeros(STATION_JOINTS)
        joints[TAIL_SLIDE] = self.scene.loop.centre_distance - float(self.scene.case.rig.centre_distance)
        joints[HEAD_SPIN], joints[TAIL_SPIN] = (pose.spin for pose in poses)
        return joints

    def advance(self, state: RunState, drive: Drive, dt: float) -> np.ndarray:
        """Move the poses to where they will be at the end of the step, and say which forces bring the joints there.

        Returns forces [N or N m] on the joints, shape (5,); where a joint is commanded its rate is set instead.
        """
        (head, tail), rates, forces = state.poses, state.joint_rates, np.zeros(STATION_JOINTS)
        slide_speed = 0.0 if self.fixed else drive.slide_speed
        radius, spin = self.scene.parts.tail.radius, self.sign * drive.travel / self.scene.parts.head.radius
        rates[HEAD_SPIN] = (spin - head.spin) / dt
        head.spin = spin
        slide_force = self.load + state.loads[TAIL, 0] - self.slide_drag * rates[TAIL_SLIDE]
        rim = self.sign * (drive.speed - drive.acceleration * dt) + drive.lead
        spin_error = rates[TAIL_SPIN] - rim / radius
        driving = self.spin_inertia * self.sign * drive.acceleration / radius
        spin_moment = state.loads[TAIL, 1] + driving - self.spin_drag * spin_error
        if slide_speed is not None:
            slide_force, rates[TAIL_SLIDE] = 0.0, slide_speed
        forces[TAIL_SLIDE], forces[TAIL_SPIN] = slide_force, spin_moment
        tail.centre[0] += dt * (rates[TAIL_SLIDE] + dt * slide_force / self.slide_mass)
        tail.spin += dt * (rates[TAIL_SPIN] + dt * spin_moment / self.spin_inertia)
        self._turn(state, dt)
        return forces

    def _turn(self, state: RunState, dt: float) -> None:
        surfaces = (self.scene.parts.head, self.scene.parts.tail)
        compliance = np.array([surface.yaw_compliance for surface in surfaces])
        state.compliance_yaw += (compliance * state.loads[:, 2] - state.compliance_yaw) * min(dt / COMPLIANCE_TIME, 1.0)
        turned = state.yaw + state.compliance_yaw
        askew = smoothstep(state.time / max(0.5 * self.scene.options.settle, dt))
        for wrap, pose, surface, yaw in zip(state.wraps, state.poses, surfaces, turned, strict=True):
            level, pose.axes = pose.axes[2, 1], surface.axes(float(yaw), state.share, pose.spin, askew)
            if state.speed == 0.0 and state.travel >= 0.0:
                wrap.lay_anew(pose, pose.axes[2, 1] - level)
        state.joints[[HEAD_YAW, TAIL_YAW]] = turned
        state.joint_rates[[HEAD_YAW, TAIL_YAW]] = 0.0

    def read(self, state: RunState) -> None:
        """After a step: the tail pulley is where it was brought."""
        tail = state.poses[TAIL]
        tail.centre[0] = float(self.scene.case.rig.centre_distance) + state.joints[TAIL_SLIDE]
        tail.spin = float(state.joints[TAIL_SPIN])
