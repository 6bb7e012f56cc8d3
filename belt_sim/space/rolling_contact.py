"""The scene of a belt that MuJoCo's contacts alone carry: an MJCF that needs nothing of ours at run time.

A node touches a pulley with a small sphere. A contact that began only where a sphere has sunk in would begin at a
random depth of up to a step's fall, 0.1 mm, which stretches the chord behind it by several times the belt's own strain.
So the contacts stand ready before touchdown, through a gap of 0.5 mm (an adhesion of no weight keeps them active
there), and the discrete integrator lets the sphere arrive on the surface at the end of a step. Then they may be as
stiff as MuJoCo's largest impedance allows, and quiet.

Points 1-4 are places and nodes travel, so that y at a point is measured as on a machine, by two rays along y from
either side. They meet the edge flags, boxes one chord long that ride on the nodes and end where the real belt's edge
is. ``rolling_run`` runs it, ``scene_looks`` says what is seen of it.
"""

import math
from dataclasses import asdict, replace

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.errors import CannotRepresent
from belt_sim.scene_parts import GuideRoller, SceneParts
from belt_sim.space.loop import LaidLoop
from belt_sim.space.machine import SceneLayout, begin_scene, station_mass
from belt_sim.space.mesh import node_name
from belt_sim.space.mujoco_interface import set_contact_solver
from belt_sim.space.options import CONTACT_STIFFNESS, IMPEDANCE, Options
from belt_sim.space.scene_looks import furnish
from belt_sim.units import DEGREE, N_PER_MM2

#: friction coefficient that stands for a belt that sticks: at 10 the end of a wrap slips by 1 % more of y
STICKING = 100.0
#: [m], of the spheres that touch the pulleys. They do not turn with the belt, so that their lowest point runs at its
#: speed: it lies at the pulley's radius, for corners of a loop of chords 25 mm long stand out by as much
NODE_RADIUS = 1.5e-4
_WIDTH = 1e-3  # [m]: the same impedance at any depth
DAMPING = 10.0  # of a contact, times step; less lets nodes rebound
_READY, _NO_WEIGHT = 5e-4, 1e-6  # [m] before touchdown, [N]


def build_contact(case: Case, belt: str, options: Options, parts: SceneParts) -> tuple[mujoco.MjSpec, SceneLayout]:
    """The scene and its specification, not yet compiled; options: fitted to the case.

    Raises CannotRepresent for parts without a rigid shape that a sphere can touch.
    """
    if belt != "flex":
        raise CannotRepresent(
            f"model.contact = mujoco: a {belt} lies quietly there but walks some 50 mm aside in a metre of travel; "
            "use model=mujoco_flex, or belt-sim simulate with model.contact=held"
        )
    shapes = {
        "camber": parts.camber is not None,
        "lift_off": bool(parts.lift_off),
        "a load on a span": bool(parts.pushes or parts.roll or parts.roll_lower),
        "residual stress": bool(parts.residual),
        "a bent axis": bool(parts.head.bow or parts.tail.bow),
        "a hollow pulley (crown c < 0)": min(parts.head.crown, parts.tail.crown) < 0.0,
    }
    for name in (name for name, is_asked in shapes.items() if is_asked):
        raise CannotRepresent(
            f"model.contact = mujoco: {name} has no place in a scene of plain MuJoCo, which takes taper, crown, cant, "
            "wobble, lean, yaw_offset, yaw_compliance and guide rollers; use belt-sim simulate with model.contact=held"
        )
    # nodes come straight onto the circle
    spec, scene = begin_scene(_with_plate_torsion(case), belt, options, parts, path=lambda depth, *_: 0.0 * depth)
    scene = replace(scene, case=replace(case, rig=scene.case.rig))
    set_contact_solver(spec, options.step, parts.gravity, parts.lean)
    _dress_nodes(spec, scene)
    for name, radius in (("head", scene.loop.radius_head), ("tail", scene.loop.radius_tail)):
        _make_solid(spec, name, radius, scene)
    for k, guide in enumerate(parts.edge_guides):
        _add_guide(spec, f"guide-{k}", guide, scene)
    _start_tensioned(spec, scene)
    _add_actuators(spec, scene)
    _add_sensors(spec, scene)
    furnish(spec, scene)
    spec.add_text(name=CASE, data="; ".join(f"{name} = {value}" for name, value in case_words(scene).items()))
    return spec, scene


def rim_radius(scene: SceneLayout) -> float:
    """Radius [m] of the head pulley where the nodes touch it: what it turns by, the belt has run."""
    return scene.loop.radius_head - NODE_RADIUS


def story(scene: SceneLayout) -> str:
    """What stands at the top of the MJCF."""
    case, options = scene.case, scene.options
    tension, yaw = float(case.settings.tension) / N_PER_MM2, float(case.settings.yaw.last()) / DEGREE
    width, thickness = float(case.belt.width), float(case.belt.thickness)
    apart, lower = 2.0 * float(scene.mesh.line_y[0]), lower_ray(scene) - CLEAR  # flags rise with their nodes
    return f""" A steel belt on two pulleys, carried and tracked by MuJoCo's contacts alone. Units are SI.
     python -m mujoco.viewer with this file, play: the belt, at {tension:g} N/mm2, starts to run at
     {options.run_speed:.3g} m/s and tracks, for its tail pulley is yawed by {yaw:g} degrees. Sliders add to it:
     speed [m/s], tension [N/mm2], tail_yaw and head_yaw [degrees]; sensors show the sums. Key frames: "laid" (the
     same at rest) and "running".
     y at the points 1 (upper end at the tail pulley), 2 (lower, tail), 3 (lower, head) and 4 (upper, head):
     (edge-N-right - edge-N-left) / 2. Of a span's middle, by height-upper-..., height-lower-...: tilt = upper
     (right - left) / {apart:.6g}, lower (left - right) / {apart:.6g}; sag = upper mean - {RAY + CLEAR:.6g}, lower
     {lower:.6g} - mean. Bending stress [N/m2] of the edge at y > 0 at a pulley, mean of
     both spans: {-3.0 / (width**2 * thickness):.6g} times the z of its axle-moment. """


#: the text in which a scene carries the settings that it was made of
CASE = "belt_sim case"


def case_words(scene: SceneLayout) -> dict[str, str]:
    """The settings that a scene stands for, by their names on the command line and in its units."""
    case, options = scene.case, scene.options
    words: dict[str, float | str] = {
        "model": f"mujoco_{scene.kind}",
        "tension": float(case.settings.tension) / N_PER_MM2,
    }
    words |= {"direction": float(case.settings.direction), "friction": scene.parts.friction}
    words |= {f"rig.{k}": float(v) for k, v in asdict(case.rig).items() if v is not None}
    words |= {f"belt.{k}": float(v) for k, v in asdict(case.belt).items()}
    words |= {"model.dx": options.dx, "model.dt": options.step, "model.belt_speed": options.run_speed}
    for name in ("head", "tail"):
        shape = vars(getattr(scene.parts, name)).items()
        words |= {f"effects ({name} pulley's {k})": v for k, v in shape if k != "radius"}
    words |= {"effects (guide rollers)": len(scene.parts.edge_guides), "effects (lean)": scene.parts.lean}
    words |= {
        "yaw": float(case.settings.yaw.last()) / DEGREE,
        "yaw_head": float(case.settings.yaw_head.last()) / DEGREE,
    }
    return {k: v if isinstance(v, str) else f"{v:.9g}" for k, v in words.items()}


def _with_plate_torsion(case: Case) -> Case:
    """The case with a belt of the same section, weight and EI whose tension resists twist as the real one's tension and
    plate torsion G b h^3 / 3 together do: lines of nodes have none of the latter."""
    belt, force = case.belt, float(case.tension_force)
    b, h, modulus = (float(v) for v in (belt.width, belt.thickness, belt.youngs_modulus))
    plate = modulus * b * h**3 / (6.0 * (1.0 + float(belt.poisson_ratio)))
    wider = math.sqrt(1.0 + 12.0 * plate / (force * b**2))
    return replace(case, belt=replace(belt, width=b * wider, thickness=h / wider, youngs_modulus=modulus / wider**2))


#: what meets what: nodes meet pulleys; nodes, pulleys and flags meet what a user adds, whose bits are 1 and 1
_NODE, _PULLEY, _FLAG_BIT, _USER = 8, 2, 4, 1
CLEAR = -4e-3  # [m], minus half the height of an edge flag, where rays at heights end
_FLAGS_OVERLAP = 1.04  # length of an edge flag over a chord: the corners on a pulley would let a ray through
_FIRST_LINE = 16  # bit of line 0 where every line of nodes meets a shell of its own
_FLAG_FRICTION = 0.2
_FLAG_TIME = (
    0.01  # [s], of contacts with flags: were they as stiff as the nodes', steps between flags would stop a roller
)
_COLOURS = {"node": (0.75, 0.78, 0.82, 1.0), "flag": (0.2, 0.45, 0.8, 1.0), "guide": (0.9, 0.6, 0.1, 1.0)}


def _dress_nodes(spec: mujoco.MjSpec, scene: SceneLayout) -> None:
    """Spheres on all nodes that meet the pulleys (class "node"; what the pulleys say of contact does not count), and
    flags that rays, guides and a user's bodies meet (class "flag"): each line's reach halfway to the next, the outer
    lines' to the belt's real edge."""
    mesh, dt, friction = scene.mesh, scene.options.step, scene.parts.friction
    node, flag = spec.add_default("node", spec.default), spec.add_default("flag", spec.default)
    touch, seen = node.geom, flag.geom
    touch.contype, touch.conaffinity, touch.condim, touch.priority = _NODE, _PULLEY | _USER, 3, 1
    touch.friction = [friction if math.isfinite(friction) else STICKING, 0.0, 0.0]
    touch.solref, touch.solimp = [-CONTACT_STIFFNESS / dt**2, -DAMPING / dt], [IMPEDANCE, IMPEDANCE, _WIDTH, 0.5, 2.0]
    touch.gap, touch.adhesion = _READY, _NO_WEIGHT
    touch.type, touch.size, touch.mass = mujoco.mjtGeom.mjGEOM_SPHERE, [NODE_RADIUS, 0, 0], 0.0
    touch.rgba, touch.group = _COLOURS["node"], 3
    edge, between = 0.5 * float(scene.case.belt.width), 0.5 * (mesh.line_y[1:] + mesh.line_y[:-1])
    ends = np.concatenate([[edge], between, [-edge]])
    seen.type = mujoco.mjtGeom.mjGEOM_BOX
    seen.contype, seen.conaffinity, seen.priority = _FLAG_BIT, _USER, 1
    seen.friction, seen.solref, seen.solimp = [_FLAG_FRICTION, 0, 0], [_FLAG_TIME, 1.0], touch.solimp
    seen.mass, seen.rgba, seen.group = 0.0, _COLOURS["flag"], 4
    for i in range(mesh.stations):
        for j in range(mesh.lines):
            body = spec.body(node_name(i, j))
            spec.joint(f"{body.name}-z").damping[0] = mesh.mass[j] * scene.options.damping
            sphere = body.add_geom(node)
            if _is_tapered(scene):
                sphere.conaffinity = (_FIRST_LINE << j) | _USER
            size = [0.5 * _FLAGS_OVERLAP * scene.loop.chord, 0.5 * (ends[j] - ends[j + 1]), -CLEAR]
            body.add_geom(flag, pos=[0.0, 0.5 * (ends[j] + ends[j + 1]) - mesh.line_y[j], 0.0], size=size)


def _is_tapered(scene: SceneLayout) -> bool:
    """Whether a pulley is a cone; one with a crown is an ellipsoid."""
    return any(surface.taper and not surface.crown for surface in (scene.parts.head, scene.parts.tail))


def _make_solid(spec: mujoco.MjSpec, name: str, radius: float, scene: SceneLayout) -> None:
    """Let a pulley collide. A tapered one has a shell for each line of nodes, as wide as the cone is there; a crowned
    one is an ellipsoid, off the middle where it is tapered, too; one that wobbles sits askew on its axle."""
    surface, shell, pulley = getattr(scene.parts, name), spec.geom(f"{name}-shell"), spec.body(f"{name}-pulley")
    shell.size, shell.group = [radius - NODE_RADIUS, shell.size[1], 0.0], 3
    shell.contype, shell.conaffinity = _PULLEY, _NODE | _USER
    before = float(np.sign(float(scene.case.settings.direction))) * scene.early / surface.radius  # turns, travel 0
    yaw, roll = (0.5 * surface.wobble * f(surface.wobble_phase - before) for f in (math.cos, math.sin))
    askew = np.zeros(4)
    mujoco.mju_mulQuat(askew, np.array([1.0, roll, 0.0, yaw]), np.array(_ACROSS))
    shell.alt.type, shell.quat = mujoco.mjtOrientation.mjORIENTATION_QUAT, askew
    if surface.crown:
        widest = radius * (1.0 + 0.5 * surface.taper**2 / surface.crown) - NODE_RADIUS
        shell.type, shell.pos = mujoco.mjtGeom.mjGEOM_ELLIPSOID, [0.0, surface.taper / surface.crown, 0.0]
        shell.size = [widest, widest, math.sqrt(widest / (radius * surface.crown))]
    elif _is_tapered(scene):
        for line, y in enumerate(scene.mesh.line_y):
            size = [radius * (1.0 + surface.taper * y) - NODE_RADIUS, shell.size[1], 0.0]
            other = pulley.add_geom(name=f"{name}-shell-{line}", type=shell.type, size=size, quat=shell.quat)
            other.contype, other.conaffinity, other.mass, other.group = _FIRST_LINE << line, 0, 0.0, 3
        shell.contype, shell.conaffinity = 0, _USER
    nominal = scene.case.settings.yaw if name == "tail" else scene.case.settings.yaw_head
    turn, stiffness = spec.joint(f"{name}-yaw"), 1.0 / max(surface.yaw_compliance, 1.0 / _YAW_STIFFNESS)
    turn.springref = float(nominal.last()) + surface.yaw_offset  # laid straight, then yawed
    turn.stiffness[0], turn.damping[0] = stiffness, _YAW_TIME * stiffness


_ACROSS = [math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0]  # a cylinder's axis along y
_GUIDE = (0.02, 0.03)  # [m], radius and half height of an edge guide


def _add_guide(spec: mujoco.MjSpec, name: str, guide: GuideRoller, scene: SceneLayout) -> None:
    """A standing roller that the belt's edge can touch."""
    rig, width = scene.case.rig, float(scene.case.belt.width)
    level = float(rig.tail_radius) * (1.0 if guide.span == "upper" else -1.0)
    y = guide.side * (0.5 * width + guide.gap + _GUIDE[0])
    geom = spec.worldbody.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[guide.x, y, level])
    geom.size, geom.rgba, geom.group, geom.friction = [*_GUIDE, 0.0], _COLOURS["guide"], 1, [0, 0, 0]
    geom.contype, geom.conaffinity = 0, _FLAG_BIT | _USER
    geom.priority, geom.solref = 2, [-guide.stiffness / scene.mesh.mass[0], -2.0 / scene.options.step]
    geom.solimp = [0.5, 0.5, 1e-3, 0.5, 2.0]


_SOFT = 100.0  # [N/m], of the spring that gives the tail pulley its nominal pull, over metres


def _start_tensioned(spec: mujoco.MjSpec, scene: SceneLayout) -> None:
    """Let the model's default state be the laid belt under its tension; key frame ``running``: at its speed.

    A flex is stress-free in the default state. So the machine stands there shorter by the belt's strain, its nodes sunk
    into the pulleys by as much; contacts and the pull on the tail stretch the belt within 20 ms.
    """
    case, slide = scene.case, spec.joint("tail-slide")
    strain = float(case.settings.tension) / float(case.belt.youngs_modulus)
    shorter = float(case.rig.centre_distance) * strain / (1.0 + strain)
    spec.body("tail-carriage").pos, slide.ref = [-shorter, 0.0, 0.0], -shorter
    slide.stiffness[0], slide.springref = _SOFT, 2.0 * float(case.tension_force) / _SOFT
    spans = 2.0 * float(case.belt.youngs_modulus) * float(case.belt.area) / float(case.rig.span_length)
    slide.damping[0] = 2.0 * math.sqrt(spans * station_mass(case, scene.options))
    pace = scene.options.run_speed * float(np.sign(float(case.settings.direction)))
    way = np.roll(scene.mesh.laid, -1, axis=0) - np.roll(scene.mesh.laid, 1, axis=0)
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    spins = np.array([0.0, pace / rim_radius(scene), 0.0, 0.0, pace / (scene.loop.radius_tail - NODE_RADIUS)])
    spec.add_key(name="running", qpos=spec.key("laid").qpos, qvel=np.concatenate([spins, (pace * way).ravel()]))


_FASTEST, _TIGHTEST, _MOST_YAW = 2.0, 200.0, 0.5  # ranges of the sliders: m/s, N/mm2, degrees
_SPEED_GAIN, _DRIVE_FORCE = 2e4, 200.0  # [N s/m] and [N] at the rim: the drive accelerates the machine at 1-2 m/s2
_YAW_TIME = 0.05  # [s]: a pulley that jumped would leave the belt that it carries
_YAW_STIFFNESS = 1e9  # [N m/rad]: a moment of 100 N m turns the pulley by 1e-7 rad


def _add_actuators(spec: mujoco.MjSpec, scene: SceneLayout) -> None:
    """Sliders in the units of the command line (m/s, N/mm2, degrees) that add to the case's own values."""
    case, tension = scene.case, float(scene.case.settings.tension) / N_PER_MM2

    def add(name: str, target: str, gear: float, least: float, most: float) -> mujoco.MjsActuator:
        made = spec.add_actuator(name=name, target=target, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        made.gear[0] = gear
        made.ctrllimited, made.ctrlrange = True, [least, most]
        return made

    speed = add("speed", "head-spin", rim_radius(scene), -_FASTEST, _FASTEST)
    speed.set_to_velocity(kv=_SPEED_GAIN)
    speed.biasprm[0] = _SPEED_GAIN * scene.options.run_speed * float(np.sign(float(case.settings.direction)))
    speed.forcelimited, speed.forcerange = True, [-_DRIVE_FORCE, _DRIVE_FORCE]
    add("tension", "tail-slide", 2.0 * float(case.belt.area) * N_PER_MM2, -tension, _TIGHTEST).set_to_motor()
    for name in ("tail", "head"):
        torque = spec.joint(f"{name}-yaw").stiffness[0] * DEGREE  # [N m]: the joint's spring turns by a degree
        add(f"{name}_yaw", f"{name}-yaw", torque, -_MOST_YAW, _MOST_YAW).set_to_motor()


RAY = 0.3  # [m] from the middle of the machine to a ray's beginning, and from a level span to one above it


def _add_sensors(spec: mujoco.MjSpec, scene: SceneLayout) -> None:
    """Rays to the edges at each of the points 1-4 and to the flags at mid-span; joints; loads on the axles."""
    kind, site, joint = mujoco.mjtSensor, mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_JOINT
    loop: LaidLoop = scene.loop
    head, tail = loop.radius_head, loop.radius_tail

    def ray(body: mujoco.MjsBody, name: str, pos: list[float], quat: list[float]) -> None:
        body.add_site(name=name, pos=pos, quat=quat, size=[5e-3] * 3, group=4)
        spec.add_sensor(name=name, type=kind.mjSENS_RANGEFINDER, objtype=site, objname=name, intprm=[1, 0, 0])

    middle = 0.25 * float(scene.case.belt.width) + 0.5 * float(scene.mesh.line_y[0])  # of what sticks out of the nodes
    turn = math.sqrt(0.5)
    for point, station, z in ((1, "tail", tail), (2, "tail", -tail), (3, "head", -head), (4, "head", head)):
        for side, way in (("left", 1.0), ("right", -1.0)):
            ray(spec.body(f"{station}-carriage"), f"edge-{point}-{side}", [0, way * RAY, z], [turn, way * turn, 0, 0])
    x, level = 0.5 * float(scene.case.rig.centre_distance), 0.5 * (head + tail)
    for span, z, quat in (("upper", level + RAY, [0, 1, 0, 0]), ("lower", -level - lower_ray(scene), [1, 0, 0, 0])):
        for side, way in (("left", 1.0), ("right", -1.0)):
            ray(spec.worldbody, f"height-{span}-{side}", [x, way * middle, z], quat)
    for name in ("head-spin", "tail-spin", "tail-slide", "head-yaw", "tail-yaw"):
        spec.add_sensor(name=name, type=kind.mjSENS_JOINTPOS, objtype=joint, objname=name)
    for name in ("head", "tail"):
        spec.body(f"{name}-fork").add_site(name=f"{name}-axle", size=[5e-3] * 3, group=4)
        spec.add_sensor(name=f"{name}-axle-load", type=kind.mjSENS_FORCE, objtype=site, objname=f"{name}-axle")
        spec.add_sensor(name=f"{name}-axle-moment", type=kind.mjSENS_TORQUE, objtype=site, objname=f"{name}-axle")


def lower_ray(scene: SceneLayout) -> float:
    """Distance [m] from a level lower span down to the beginning of its rays, which the sagging belt does not reach."""
    lowest = float(scene.loop.z.min())
    return RAY + max(-lowest - scene.loop.radius_tail, 0.0)
