"""The belt carried by MuJoCo's contacts alone: an MJCF that needs nothing of ours at run time, and its runs.

The scene has colliding pulleys, actuators, sensors and key frames. A node touches a pulley with a small sphere. Points
1-4 are places and nodes travel, so that y at a point is measured as on a machine, by two rays along y from either side:
they meet the edge flags, boxes one chord long that ride on the nodes and end where the real belt's edge is.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import mujoco
import numpy as np

from belt_sim.case import Case, Schedule
from belt_sim.curves import Curves
from belt_sim.errors import CannotRepresent, InputError, SimulationError
from belt_sim.files import write_text
from belt_sim.frame import Observer
from belt_sim.mujoco3d.machine import (
    HEAD_SPIN,
    STATION_JOINTS,
    TAIL_SLIDE,
    SceneLayout,
    laid_coordinates,
    lay_out,
    pulleys_specification,
)
from belt_sim.mujoco3d.mesh import BeltModel, Mesh, node_name
from belt_sim.mujoco3d.mujoco_interface import compile_model, mjcf, set_contact_solver, silence_expected_warnings
from belt_sim.mujoco3d.options import Options
from belt_sim.mujoco3d.pulleys import laid_poses
from belt_sim.mujoco3d.recording import Recorder, notify_observers
from belt_sim.mujoco3d.run_stages import YawPlan
from belt_sim.mujoco3d.state import RunState
from belt_sim.mujoco3d.wrap import HEAD, TAIL, WrapArrays
from belt_sim.scene_parts import PulleySurface, SceneParts
from belt_sim.si import DEGREE, N_PER_MM2

ACTUATORS = ("speed", "tension", "tail_yaw", "head_yaw")
#: friction coefficient that stands for a belt that sticks: 1 lets the beginning of a wrap slip at the yaw step
STICKING = 10.0
NODE_RADIUS = 1e-3  # [m], of the spheres that touch the pulleys
_BELT_BIT, _PULLEY_BIT = 1, 2  # nodes meet pulleys, and nothing else meets anything
#: time constant [steps] and impedance of the contact; with one step the belt chatters on the pulleys. MuJoCo takes the
#: stiffness of tendons for inertia of the nodes, which would make the contact hundreds of times as stiff.
_MEMBRANE, _TENDONS = (2.0, (0.998, 0.9998, 1e-4, 0.5, 2.0)), (4.0, (0.5, 0.9, 1e-4, 0.5, 2.0))
_DEEPEST = 1e-3  # [m]
_TOUCH = 5e-6  # [m] by which the nodes sink in when the mass that counts in contact is read
_FASTEST, _TIGHTEST, _MOST_YAW = 2.0, 200.0, 0.5  # ranges of the sliders: m/s, N/mm2, degrees
_SPEED_GAIN, _DRIVE_FORCE = 2e4, 200.0  # [N s/m] and [N] at the rim: the drive accelerates the machine at 1-2 m/s2
_YAW_STIFFNESS = 1e9  # [N m/rad]: a moment of 100 N m turns the pulley by 1e-7 rad
_FLAG = (4e-4, 4e-3)  # [m], half thickness along y and half height of an edge flag
_FLAGS_OVERLAP = 1.04  # length of an edge flag over a chord: the corners on a pulley would let a ray through
_RAY_FROM = 0.3  # [m] from the middle of the machine
_COLOURS = {"node": (0.75, 0.78, 0.82, 1.0), "flag": (0.2, 0.45, 0.8, 1.0)}

#: what stands at the top of the MJCF
STORY = """ A steel belt on two pulleys, carried and tracked by MuJoCo's contacts alone.
     In python -m mujoco.viewer load the key frame "running" and press play: the belt runs. Key frame "laid" is the same
     belt at rest. Sliders: speed of the belt [m/s], tension [N/mm2], yaw of tail and head pulley [degrees]. Sensors
     edge-1-left ... edge-4-right are rays from beside the machine to the belt's edges at the points 1 (upper end at the
     tail pulley), 2 (lower, tail), 3 (lower, head) and 4 (upper, head): y = (right - left) / 2. Units are SI. """


@dataclass(frozen=True)
class ContactLaw:
    """How a node meets a pulley.

    timeconst [s]; solimp: impedance where contact begins and from a depth [m] on, that depth, midpoint and power;
    friction [1], inf = sticking.
    """

    timeconst: float
    solimp: tuple[float, float, float, float, float]
    friction: float

    def depth(self, load: float, mass: float) -> float:
        """How far a node sinks in under ``load`` [N]: load = mass p d / ((1 - d) (d_max t_c)^2), mass [kg] as in
        ``_mass_in_contact``."""
        softest, hardest, width, middle, power = self.solimp
        depth = np.linspace(0.0, _DEEPEST, 10001)
        x = np.minimum(depth / width, 1.0)
        rising, falling = x**power / middle ** (power - 1.0), 1.0 - (1.0 - x) ** power / (1.0 - middle) ** (power - 1.0)
        d = softest + (hardest - softest) * np.where(x < middle, rising, falling)
        carried = mass * depth * d / ((1.0 - d) * (hardest * self.timeconst) ** 2)
        return float(np.interp(load, carried, depth))

    def act_on(self, geom: Any) -> None:
        """Let a node, or the class of them, meet pulleys so; what the pulleys say of contact does not count."""
        geom.contype, geom.conaffinity, geom.condim, geom.priority = _BELT_BIT, _PULLEY_BIT, 3, 1
        geom.friction = [self.friction if math.isfinite(self.friction) else STICKING, 0.0, 0.0]
        geom.solref, geom.solimp = [self.timeconst, 1.0], self.solimp


def build_contact(
    case: Case, belt: BeltModel, options: Options, parts: SceneParts, contact: ContactLaw | None = None
) -> tuple[mujoco.MjSpec, SceneLayout]:
    """The scene and its specification, not yet compiled; options: fitted to the case; contact: None = the stiffest.

    Raises CannotRepresent for parts that are no plain cylinders.
    """
    cylinders = all(p == PulleySurface(radius=p.radius) for p in (parts.head, parts.tail))
    if not cylinders or parts.edge_guides or parts.sets_in or parts.residual:
        raise CannotRepresent(
            "model.contact = mujoco: it has plain cylinders and a straight belt; use model.contact=held with effects "
            "that have a shape"
        )
    scene = lay_out(case, belt, options, parts, path=lambda depth, *_: 0.0 * depth)  # straight onto the circle
    case, mesh, loop, spec = scene.case, scene.mesh, scene.loop, pulleys_specification(scene)
    set_contact_solver(spec, options.dt, parts.gravity)
    belt.tie(spec, mesh, case, options)
    steps, solimp = _TENDONS if spec.tendons else _MEMBRANE
    contact = contact or ContactLaw(steps * options.dt, solimp, parts.friction)
    _add_defaults(spec, contact, loop.chord)
    _dress_nodes(spec, mesh, case)
    _add_actuators(spec, case, options)
    _add_sensors(spec, case, loop.radius_head, loop.radius_tail)
    _add_keys(spec, scene)
    _make_solid(spec, scene, contact)
    return spec, scene


def _add_defaults(spec: mujoco.MjSpec, contact: ContactLaw, chord: float) -> None:
    """Classes "node" (what touches the pulleys) and "flag" (what the rays meet)."""
    node = spec.add_default("node", spec.default)
    contact.act_on(node.geom)
    node.geom.type, node.geom.size, node.geom.mass = mujoco.mjtGeom.mjGEOM_SPHERE, [NODE_RADIUS, 0, 0], 0.0
    node.geom.rgba, node.geom.group = _COLOURS["node"], 2
    flag = spec.add_default("flag", spec.default)
    flag.geom.type, flag.geom.size = mujoco.mjtGeom.mjGEOM_BOX, [0.5 * _FLAGS_OVERLAP * chord, *_FLAG]
    flag.geom.contype = flag.geom.conaffinity = 0
    flag.geom.mass, flag.geom.rgba, flag.geom.group = 0.0, _COLOURS["flag"], 4


def _make_solid(spec: mujoco.MjSpec, scene: SceneLayout, contact: ContactLaw) -> None:
    """Let the pulleys collide; they are so much wider as the nodes sink in, which then run on the circle wanted."""
    circles = {"head": scene.loop.radius_head, "tail": scene.loop.radius_tail}

    def widen(by: dict[str, float]) -> None:
        for name, radius in circles.items():
            shell = spec.geom(f"{name}-shell")
            shell.contype, shell.conaffinity = _PULLEY_BIT, _BELT_BIT
            shell.size = [radius - NODE_RADIUS + by[name], shell.size[1], 0.0]

    widen(dict.fromkeys(circles, _TOUCH))
    mass, force = _mass_in_contact(compile_model(spec)), float(scene.case.tension_force) / scene.mesh.lines
    widen({name: contact.depth(force * scene.loop.chord / radius, mass) for name, radius in circles.items()})


def _mass_in_contact(model: mujoco.MjModel) -> float:
    """The inertia [kg] of a node by which MuJoCo scales the stiffness of its contact: 1 / A of R = A (1 - d) / d.

    The discrete integrator takes spring k and damper b of a contact at the end of the step: R is divided by
    1 + h b + h^2 k.
    """
    data, h = mujoco.MjData(model), model.opt.timestep
    mujoco.mj_resetDataKeyframe(model, data, model.key("laid").id)
    with silence_expected_warnings():
        mujoco.mj_forward(model, data)
    rows = data.contact.efc_address[: data.ncon]
    k, b, d, _ = data.efc_KBIP[rows].T
    return float(np.median((1.0 - d) / (d * data.efc_R[rows] * (1.0 + h * b + h**2 * k))))


def _dress_nodes(spec: mujoco.MjSpec, mesh: Mesh, case: Case) -> None:
    """Spheres on all nodes, edge flags on those of the outer lines."""
    margin = 0.5 * float(case.belt.width) - mesh.line_y[0] - _FLAG[0]
    node, flag = (spec.find_default(name) for name in ("node", "flag"))
    for i in range(mesh.stations):
        for j in range(mesh.lines):
            body = spec.body(node_name(i, j))
            body.add_geom(node)
            for side, line in ((1.0, 0), (-1.0, mesh.lines - 1)):
                if j == line:
                    body.add_geom(flag, pos=[0.0, side * margin, 0.0])


def _add_actuators(spec: mujoco.MjSpec, case: Case, options: Options) -> None:
    """Sliders in the units of the command line: m/s, N/mm2, degrees."""
    radius, joint = float(case.rig.head_radius), mujoco.mjtTrn.mjTRN_JOINT

    def add(name: str, target: str, gear: float, most: float, least: float | None = None) -> mujoco.MjsActuator:
        made = spec.add_actuator(name=name, target=target, trntype=joint)
        made.gear[0] = gear
        made.ctrllimited, made.ctrlrange = True, [-most if least is None else least, most]
        return made

    speed = add("speed", "head-spin", radius, _FASTEST)
    speed.set_to_velocity(kv=_SPEED_GAIN)
    speed.forcelimited, speed.forcerange = True, [-_DRIVE_FORCE, _DRIVE_FORCE]
    add("tension", "tail-slide", 2.0 * float(case.belt.area) * N_PER_MM2, _TIGHTEST, 0.0).set_to_motor()
    for name in ("tail", "head"):
        yaw = add(f"{name}_yaw", f"{name}-yaw", 1.0 / DEGREE, _MOST_YAW)
        yaw.set_to_position(kp=_YAW_STIFFNESS * DEGREE**2, dampratio=1.0)


def _add_sensors(spec: mujoco.MjSpec, case: Case, head: float, tail: float) -> None:
    """Two rays to the edges at each of the points 1-4; joints; loads on the axles."""
    kind, site, joint = mujoco.mjtSensor, mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_JOINT
    places = ((1, "tail", tail), (2, "tail", -tail), (3, "head", -head), (4, "head", head))
    for point, station, z in places:
        for side, way in (("left", 1.0), ("right", -1.0)):
            name, turned = f"edge-{point}-{side}", [math.sqrt(0.5), way * math.sqrt(0.5), 0, 0]
            carriage = spec.body(f"{station}-carriage")
            carriage.add_site(name=name, pos=[0, way * _RAY_FROM, z], quat=turned, size=[5e-3] * 3, group=4)
            spec.add_sensor(name=name, type=kind.mjSENS_RANGEFINDER, objtype=site, objname=name, intprm=[1, 0, 0])
    for name in ("head-spin", "tail-spin", "tail-slide", "head-yaw", "tail-yaw"):
        spec.add_sensor(name=name, type=kind.mjSENS_JOINTPOS, objtype=joint, objname=name)
    for name in ("head", "tail"):
        spec.body(f"{name}-fork").add_site(name=f"{name}-axle", size=[5e-3] * 3, group=4)
        spec.add_sensor(name=f"{name}-axle-load", type=kind.mjSENS_FORCE, objtype=site, objname=f"{name}-axle")


def _add_keys(spec: mujoco.MjSpec, scene: SceneLayout) -> None:
    """``laid``: at rest, the sliders at the speed and the tension of the case; ``running``: at its speed, about to be
    yawed as the case's schedule ends."""
    mesh, case, settings = scene.mesh, scene.case, scene.case.settings
    qpos = laid_coordinates(scene)
    pace = scene.options.run_speed * float(np.sign(float(settings.direction)))
    way = np.roll(mesh.laid, -1, axis=0) - np.roll(mesh.laid, 1, axis=0)
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    spins = np.array([0.0, pace / float(case.rig.head_radius), 0.0, 0.0, pace / float(case.rig.tail_radius)])
    at_speed = np.concatenate([spins, (pace * way).ravel()])
    straight = [pace, float(settings.tension) / N_PER_MM2, 0.0, 0.0]
    yawed = [*straight[:2], *(float(schedule.last()) / DEGREE for schedule in (settings.yaw, settings.yaw_head))]
    spec.add_key(name="laid", qpos=qpos, ctrl=straight)
    spec.add_key(name="running", qpos=qpos, qvel=at_speed, ctrl=yawed)


#: an MjSpec, or the path of an MJCF
Edited: TypeAlias = mujoco.MjSpec | str | Path


def run_contact(
    case: Case,
    belt: BeltModel,
    travel: float,
    options: Options,
    parts: SceneParts,
    scene_path: Path | None = None,
    observers: Sequence[Observer] = (),
    edited: Edited | None = None,
) -> Curves:
    """Curves over ``travel`` [m] of a belt on colliding pulleys; options: fitted to the case.

    edited: the scene that is run instead of the case's own; it has the joints, nodes and actuators of that.
    """
    spec, scene = build_contact(case, belt, options, parts)
    if edited is not None:
        spec = load_specification(edited)
    model = compile_model(spec)
    if scene_path is not None:
        write_text(scene_path, mjcf(spec, STORY))
    return ContactRun(scene, model).go(travel, observers)


def load_specification(edited: Edited) -> mujoco.MjSpec:
    """A scene that has been edited; raises InputError for a file that is no MJCF."""
    if isinstance(edited, mujoco.MjSpec):
        return edited
    try:
        return mujoco.MjSpec.from_file(str(edited))
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise InputError("model.scene", edited, "", f"give an MJCF that belt-sim scene wrote ({reason})") from error


class ContactRun:
    """A scene under way in plain MuJoCo; ``state`` is what the readings of a 3D run are taken from."""

    def __init__(self, scene: SceneLayout, model: mujoco.MjModel) -> None:
        """Raises InputError for a model that does not have the case's joints, nodes and actuators."""
        self.scene, self.model, self.data = scene, model, mujoco.MjData(model)
        n, m = scene.mesh.stations, scene.mesh.lines
        lacking = [name for name in ACTUATORS if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name) < 0]
        wanted = STATION_JOINTS + 3 * n * m
        if lacking or model.nq != wanted:
            what = f"no actuator {lacking[0]}" if lacking else f"{model.nq} coordinates, not {wanted}"
            raise InputError("model.scene", what, "", "edit a scene that belt-sim scene made with the same settings")
        self.sliders = {name: model.actuator(name).id for name in ACTUATORS}
        self.sign = float(np.sign(float(scene.case.settings.direction)))
        self.radius = float(scene.case.rig.head_radius)
        settings, spread = scene.case.settings, scene.options.yaw_time * scene.options.run_speed

        def spread_steps(schedule: Schedule) -> Schedule:
            """Steps made while the belt runs, within yaw_time: friction of contacts creeps at rest."""
            over = np.asarray(schedule.over, float)
            return replace(schedule, over=np.where(over > 0.0, over, spread))

        yaw, yaw_head = spread_steps(settings.yaw), spread_steps(settings.yaw_head)
        self.plan = YawPlan.from_settings(replace(settings, yaw=yaw, yaw_head=yaw_head))
        self.state = self._lay()

    def _lay(self) -> RunState:
        """The belt laid round the pulleys, at its speed, ``scene.early`` before travel 0."""
        mujoco.mj_resetDataKeyframe(self.model, self.data, self.model.key("running").id)
        mesh, qpos, qvel = self.scene.mesh, self.data.qpos, self.data.qvel
        n, m = mesh.stations, mesh.lines
        nothing = np.zeros((m, 0))  # what holds a station is MuJoCo's contact: the wraps say only which lie there
        joints, rates = qpos[:STATION_JOINTS], qvel[:STATION_JOINTS]
        slides, slide_rates = (v[STATION_JOINTS:].reshape(n, m, 3) for v in (qpos, qvel))
        wraps = [WrapArrays(0, 0, nothing, nothing, nothing, np.zeros(0), np.zeros(2)) for _ in range(2)]
        slip = [np.zeros((m, 2, n)) for _ in range(2)]
        return RunState(joints, rates, slides, slide_rates, laid_poses(self.scene), wraps, [], slip, -self.scene.early)

    def go(self, travel: float, observers: Sequence[Observer] = ()) -> Curves:
        """Run in, then ``travel`` [m]; a yaw step is made while the belt runs, within options.yaw_time."""
        recorder = Recorder(self.scene, tuple(observers))

        def curves() -> Curves:
            """The curves without what is measured of held nodes alone."""
            found = recorder.curves()
            extra = {k: v for k, v in (found.extra or {}).items() if not k.startswith(("slip", "sliding"))}
            return replace(found, extra=extra)

        with notify_observers(recorder.observers, self.scene.case, travel, curves, self.model, self.data):
            while self.state.travel < travel + 0.5 * self.scene.options.sample:
                self.step()
                if not recorder.rows and self.state.travel >= 0.0:
                    recorder.begin(self.place())
                if recorder.is_due(self.state.travel):
                    self.place()
                recorder.step(self.state)
        return curves()

    def step(self) -> None:
        """One step of MuJoCo with the sliders where the case wants them at this travel."""
        state, data = self.state, self.data
        state.yaw = self.plan.angles(state.travel, -math.inf)
        data.ctrl[self.sliders["head_yaw"]], data.ctrl[self.sliders["tail_yaw"]] = state.yaw / DEGREE
        mujoco.mj_step(self.model, data)
        state.time = data.time
        state.speed = self.sign * data.qvel[HEAD_SPIN] * self.radius
        state.travel = self.sign * data.qpos[HEAD_SPIN] * self.radius - self.scene.early
        if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number or not np.isfinite(data.qpos[-1]):
            raise SimulationError(f"the belt's acceleration grew without bound at {data.time:.3f} s: halve options.dt")

    def place(self) -> RunState:
        """The state with what is read seldom: where the pulleys are, and which stations lie on them."""
        state, mesh = self.state, self.scene.mesh
        tail_x = float(self.scene.case.rig.centre_distance) + float(self.data.qpos[TAIL_SLIDE])
        state.poses[TAIL] = state.poses[TAIL]._replace(centre=np.array([tail_x, 0.0, 0.0]))
        x = (mesh.rest + state.slides).mean(axis=1)[:, 0]
        ends = [_wrap_ends(np.flatnonzero(on), mesh.stations) for on in (x <= 0.0, x >= tail_x)]
        later = mesh.stations if ends[TAIL][0] < ends[HEAD][1] else 0  # the upper span runs from head to tail
        for which, (first, last) in enumerate(ends):
            state.wraps[which] = state.wraps[which]._replace(first=first + later * which, last=last + later * which)
        return state


def _wrap_ends(stations: np.ndarray, n: int) -> tuple[int, int]:
    """First and last of consecutive station numbers, modulo n: first in 0..n-1, last above it."""
    gap = int(np.argmax(np.diff(stations, append=stations[0] + n)))
    first = int(stations[(gap + 1) % len(stations)])
    return first, first + len(stations) - 1
