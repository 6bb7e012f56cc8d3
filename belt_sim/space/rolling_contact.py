"""The scene of a belt that MuJoCo's contacts alone carry: an MJCF that needs nothing of ours at run time.

It has colliding pulleys, actuators, sensors and key frames. A node touches a pulley with a small sphere. Points 1-4
are places and nodes travel, so that y at a point is measured as on a machine, by two rays along y from either side:
they meet the edge flags, boxes one chord long that ride on the nodes and end where the real belt's edge is.
``rolling_run`` runs it.
"""

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.errors import CannotRepresent
from belt_sim.scene_parts import PulleySurface, SceneParts
from belt_sim.si import DEGREE, N_PER_MM2
from belt_sim.space.loop import LaidLoop
from belt_sim.space.machine import SceneLayout, begin_scene
from belt_sim.space.mesh import node_name
from belt_sim.space.mujoco_interface import compile_model, set_contact_solver, silence_expected_warnings
from belt_sim.space.options import Options, is_limp

#: what stands at the top of the MJCF
STORY = """ A steel belt on two pulleys, carried and tracked by MuJoCo's contacts alone.
     In python -m mujoco.viewer load the key frame "running" and press play: the belt runs. Key frame "laid" is the same
     belt at rest. Sliders: speed of the belt [m/s], tension [N/mm2], yaw of tail and head pulley [degrees]. Sensors
     edge-1-left ... edge-4-right are rays from beside the machine to the belt's edges at the points 1 (upper end at the
     tail pulley), 2 (lower, tail), 3 (lower, head) and 4 (upper, head): y = (right - left) / 2. Units are SI. """

#: friction coefficient that stands for a belt that sticks: 1 lets the beginning of a wrap slip at the yaw step
STICKING = 10.0
_DEEPEST = 1e-3  # [m]


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


def build_contact(
    case: Case, belt: str, options: Options, parts: SceneParts, contact: ContactLaw | None = None
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
    # nodes come straight onto the circle
    spec, scene = begin_scene(case, belt, options, parts, path=lambda depth, *_: 0.0 * depth)
    set_contact_solver(spec, options.dt, parts.gravity)
    if contact is None:
        contact = _stiffest_contact(scene)
    _dress_nodes(spec, scene, contact)
    _add_actuators(spec, scene.case)
    _add_sensors(spec, scene.loop)
    _complete_keys(spec, scene)
    _make_solid(spec, scene, contact)
    return spec, scene


def _stiffest_contact(scene: SceneLayout) -> ContactLaw:
    """With a shorter time constant the belt chatters on the pulleys.

    MuJoCo takes the stiffness of tendons for inertia of the nodes: their contact is hundreds of times as stiff, but not
    where the normal runs along x or z. So it is softer, and hardens within three times the depth at which the wrap goes
    slack, strain x radius.
    """
    dt, belt, settings = scene.options.dt, scene.case.belt, scene.case.settings
    if scene.kind == "flex":
        return ContactLaw(2.0 * dt, (0.998, 0.9998, 1e-4, 0.5, 2.0), scene.parts.friction)
    slack = float(settings.tension) / float(belt.youngs_modulus) * scene.loop.radius_head
    return ContactLaw(4.0 * dt, (0.5, 0.9, 3.0 * slack, 0.5, 2.0), scene.parts.friction)


NODE_RADIUS = 1e-3  # [m], of the spheres that touch the pulleys
_BELT_BIT, _PULLEY_BIT = 1, 2  # nodes meet pulleys, and nothing else meets anything
_FLAG = (4e-4, 4e-3)  # [m], half thickness along y and half height of an edge flag
_FLAGS_OVERLAP = 1.04  # length of an edge flag over a chord: the corners on a pulley would let a ray through
_COLOURS = {"node": (0.75, 0.78, 0.82, 1.0), "flag": (0.2, 0.45, 0.8, 1.0)}


def _dress_nodes(spec: mujoco.MjSpec, scene: SceneLayout, contact: ContactLaw) -> None:
    """Spheres on all nodes that meet the pulleys (class "node"; what the pulleys say of contact does not count), edge
    flags that the rays meet on those of the outer lines (class "flag")."""
    mesh, node, flag = scene.mesh, spec.add_default("node", spec.default), spec.add_default("flag", spec.default)
    touch, seen = node.geom, flag.geom
    touch.contype, touch.conaffinity, touch.condim, touch.priority = _BELT_BIT, _PULLEY_BIT, 3, 1
    touch.friction = [contact.friction if math.isfinite(contact.friction) else STICKING, 0.0, 0.0]
    touch.solref, touch.solimp = [contact.timeconst, 1.0], contact.solimp
    touch.type, touch.size, touch.mass = mujoco.mjtGeom.mjGEOM_SPHERE, [NODE_RADIUS, 0, 0], 0.0
    touch.rgba, touch.group = _COLOURS["node"], 2
    seen.type, seen.size = mujoco.mjtGeom.mjGEOM_BOX, [0.5 * _FLAGS_OVERLAP * scene.loop.chord, *_FLAG]
    seen.contype = seen.conaffinity = 0
    seen.mass, seen.rgba, seen.group = 0.0, _COLOURS["flag"], 4
    margin = 0.5 * float(scene.case.belt.width) - mesh.line_y[0] - _FLAG[0]
    drag = scene.options.damping if is_limp(scene.kind, scene.options) else 0.0  # of spans that would sway on
    for i in range(mesh.stations):
        for j in range(mesh.lines):
            body = spec.body(node_name(i, j))
            body.add_geom(node)
            for joint in body.joints[1:]:
                joint.damping[0] = drag * mesh.mass[j]
            for side, line in ((1.0, 0), (-1.0, mesh.lines - 1)):
                if j == line:
                    body.add_geom(flag, pos=[0.0, side * margin, 0.0])


_FASTEST, _TIGHTEST, _MOST_YAW = 2.0, 200.0, 0.5  # ranges of the sliders: m/s, N/mm2, degrees
_SPEED_GAIN, _DRIVE_FORCE = 2e4, 200.0  # [N s/m] and [N] at the rim: the drive accelerates the machine at 1-2 m/s2
_YAW_STIFFNESS = 1e9  # [N m/rad]: a moment of 100 N m turns the pulley by 1e-7 rad


def _add_actuators(spec: mujoco.MjSpec, case: Case) -> None:
    """Sliders in the units of the command line: m/s, N/mm2, degrees."""

    def add(name: str, target: str, gear: float, least: float, most: float) -> mujoco.MjsActuator:
        made = spec.add_actuator(name=name, target=target, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        made.gear[0] = gear
        made.ctrllimited, made.ctrlrange = True, [least, most]
        return made

    speed = add("speed", "head-spin", float(case.rig.head_radius), -_FASTEST, _FASTEST)
    speed.set_to_velocity(kv=_SPEED_GAIN)
    speed.forcelimited, speed.forcerange = True, [-_DRIVE_FORCE, _DRIVE_FORCE]
    add("tension", "tail-slide", 2.0 * float(case.belt.area) * N_PER_MM2, 0.0, _TIGHTEST).set_to_motor()
    for name in ("tail", "head"):
        yaw = add(f"{name}_yaw", f"{name}-yaw", 1.0 / DEGREE, -_MOST_YAW, _MOST_YAW)
        yaw.set_to_position(kp=_YAW_STIFFNESS * DEGREE**2, dampratio=1.0)


_RAY_FROM = 0.3  # [m] from the middle of the machine


def _add_sensors(spec: mujoco.MjSpec, loop: LaidLoop) -> None:
    """Two rays to the edges at each of the points 1-4; joints; loads on the axles."""
    kind, site, joint = mujoco.mjtSensor, mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_JOINT
    head, tail = loop.radius_head, loop.radius_tail
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


def _complete_keys(spec: mujoco.MjSpec, scene: SceneLayout) -> None:
    """``laid``: at rest, the sliders at the speed and the tension of the case; ``running``: at its speed, about to be
    yawed as the case's schedule ends."""
    mesh, rig, settings, laid = scene.mesh, scene.case.rig, scene.case.settings, spec.key("laid")
    pace = scene.options.run_speed * float(np.sign(float(settings.direction)))
    way = np.roll(mesh.laid, -1, axis=0) - np.roll(mesh.laid, 1, axis=0)
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    spins = np.array([0.0, pace / float(rig.head_radius), 0.0, 0.0, pace / float(rig.tail_radius)])
    at_speed = np.concatenate([spins, (pace * way).ravel()])
    driven = [pace, float(settings.tension) / N_PER_MM2]
    yawed = [float(schedule.last()) / DEGREE for schedule in (settings.yaw, settings.yaw_head)]
    laid.ctrl = [*driven, 0.0, 0.0]
    spec.add_key(name="running", qpos=laid.qpos, qvel=at_speed, ctrl=[*driven, *yawed])


_TOUCH = 5e-6  # [m] by which the nodes sink in when the mass that counts in contact is read


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
