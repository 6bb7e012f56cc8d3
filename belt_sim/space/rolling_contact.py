"""The scene of a belt that MuJoCo's contacts alone carry, an MJCF that needs nothing of ours, and its run: nodes touch
pulleys with small spheres, and y is measured at the points 1-4 by two rays to edge flags, boxes that ride on the nodes
and end where the real belt's edge is."""

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TypeAlias

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves, Observer
from belt_sim.errors import CannotRepresent, InputError, SimulationError
from belt_sim.io import write_text
from belt_sim.jax_setup import in_float64, jit_float64
from belt_sim.scene_parts import SceneParts
from belt_sim.space import mujoco_interface as interface
from belt_sim.space.belt import ActiveFeatures, belt_arrays
from belt_sim.space.options import CONTACT_STIFFNESS, IMPEDANCE, Options
from belt_sim.space.run import SPEED, TAIL_X, TRAVEL_ROW, Recorder, YawPlan, notify_observers, reading
from belt_sim.space.scene import (
    HEAD_SPIN,
    HEAD_YAW,
    STATION_JOINTS,
    TAIL_SLIDE,
    TAIL_YAW,
    SceneLayout,
    build_scene,
    node_name,
    station_mass,
)
from belt_sim.space.scene_looks import furnish
from belt_sim.space.wrap import HEAD, TAIL
from belt_sim.units import DEGREE, N_PER_MM2

#: friction coefficient that stands for a belt that sticks: at 10 the end of a wrap slips by 1 % more of y
STICKING = 100.0
#: [m], of the spheres that touch the pulleys. They do not turn with the belt, so that their lowest point runs at its
#: speed: it lies at the pulley's radius, for corners of a loop of chords 25 mm long stand out by as much
NODE_RADIUS = 1.5e-4
_WIDTH = 1e-3  # [m]: the same impedance at any depth
CONTACT_DAMPING = 10.0  # of a contact, times step; less lets nodes rebound
_READY, _NO_WEIGHT = 5e-4, 1e-6  # [m] before touchdown, [N]


def build_contact(case: Case, belt: str, options: Options, parts: SceneParts) -> tuple[mujoco.MjSpec, SceneLayout]:
    """The scene and its specification, not yet compiled; options: fitted to the case. Raises CannotRepresent for parts
    without a rigid shape that a sphere can touch."""
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
    # a belt of the same section, weight and EI whose tension resists twist as the real one's tension and plate torsion
    # G b h^3 / 3 together do: lines of nodes have none of the latter; they come straight onto the circle
    strip, force = case.belt, float(case.tension_force)
    b, h, modulus = (float(v) for v in (strip.width, strip.thickness, strip.youngs_modulus))
    plate = modulus * b * h**3 / (6.0 * (1.0 + float(strip.poisson_ratio)))
    wider = math.sqrt(1.0 + 12.0 * plate / (force * b**2))
    like = replace(strip, width=b * wider, thickness=h / wider, youngs_modulus=modulus / wider**2)
    straight = lambda depth, *_: 0.0 * depth  # noqa: E731
    spec, scene = build_scene(replace(case, belt=like), belt, options, parts, path=straight, lean=parts.lean)
    scene = replace(scene, case=replace(case, rig=scene.case.rig))
    _dress_nodes(spec, scene)
    for name, radius in (("head", scene.loop.radius_head), ("tail", scene.loop.radius_tail)):
        _make_solid(spec, name, radius, scene)
    for k, guide in enumerate(parts.edge_guides):  # the belt's edge meets them
        geom = spec.geom(f"guide-{k}")
        geom.conaffinity, geom.friction, geom.priority = _FLAG_BIT | _USER, [0, 0, 0], 2
        geom.solref = [-guide.stiffness / scene.mesh.mass[0], -2.0 / options.step]
        geom.solimp = [0.5, 0.5, 1e-3, 0.5, 2.0]
    _drive(spec, scene)
    _add_sensors(spec, scene)
    furnish(spec, scene)
    spec.add_text(name=CASE, data="; ".join(f"{name} = {value}" for name, value in case_words(scene).items()))
    return spec, scene


def story(scene: SceneLayout) -> str:
    """What stands at the top of the MJCF."""
    case, options = scene.case, scene.options
    tension, yaw = float(case.settings.tension) / N_PER_MM2, float(case.settings.yaw.last()) / DEGREE
    width, thickness = float(case.belt.width), float(case.belt.thickness)
    apart, lower = 2.0 * float(scene.mesh.line_y[0]), lower_ray(scene) - CLEAR_OF_BELT  # flags rise with their nodes
    return f""" A steel belt on two pulleys, carried and tracked by MuJoCo's contacts alone. Units are SI.
     python -m mujoco.viewer with this file, play: the belt, at {tension:g} N/mm2, starts to run at
     {options.run_speed:.3g} m/s and tracks, for its tail pulley is yawed by {yaw:g} degrees. Sliders add to it:
     speed [m/s], tension [N/mm2], tail_yaw and head_yaw [degrees]; sensors show the sums. Key frames: "laid" (the
     same at rest) and "running".
     y at the points 1 (upper end at the tail pulley), 2 (lower, tail), 3 (lower, head) and 4 (upper, head):
     (edge-N-right - edge-N-left) / 2. Of a span's middle, by height-upper-..., height-lower-...: tilt = upper
     (right - left) / {apart:.6g}, lower (left - right) / {apart:.6g}; sag = upper mean - {RAY + CLEAR_OF_BELT:.6g},
     lower {lower:.6g} - mean. Bending stress [N/m2] of the edge at y > 0 at a pulley, mean of
     both spans: {-3.0 / (width**2 * thickness):.6g} times the z of its axle-moment. """


#: the text in which a scene carries the settings that it was made of
CASE = "belt_sim case"


def case_words(scene: SceneLayout) -> dict[str, str]:
    """The settings that a scene stands for, by their names on the command line and in its units."""
    case, options = scene.case, scene.options
    words: dict[str, float | str] = {"model": f"mujoco_{scene.kind}"}
    words |= {"tension": float(case.settings.tension) / N_PER_MM2, "direction": float(case.settings.direction)}
    words |= {"friction": scene.parts.friction}
    words |= {f"rig.{k}": float(v) for k, v in asdict(case.rig).items() if v is not None}
    words |= {f"belt.{k}": float(v) for k, v in asdict(case.belt).items()}
    words |= {"model.dx": options.dx, "model.dt": options.step, "model.belt_speed": options.run_speed}
    for name in ("head", "tail"):
        shape = vars(getattr(scene.parts, name)).items()
        words |= {f"effects ({name} pulley's {k})": v for k, v in shape if k != "radius"}
    words |= {"effects (guide rollers)": len(scene.parts.edge_guides), "effects (lean)": scene.parts.lean}
    words |= {name: float(getattr(case.settings, name).last()) / DEGREE for name in ("yaw", "yaw_head")}
    return {k: v if isinstance(v, str) else f"{v:.9g}" for k, v in words.items()}


#: what meets what: nodes meet pulleys; nodes, pulleys and flags meet what a user adds, whose bits are 1 and 1
_NODE, _PULLEY, _FLAG_BIT, _USER = 8, 2, 4, 1
CLEAR_OF_BELT = -4e-3  # [m], minus half the height of an edge flag, where rays at heights end
_FLAGS_OVERLAP = 1.04  # length of an edge flag over a chord: the corners on a pulley would let a ray through
_FIRST_LINE = 16  # bit of line 0 where every line of nodes meets a shell of its own
#: of flags; [s] of contacts with them: were they as stiff as the nodes', steps between flags would stop a roller
_FLAG_FRICTION, _FLAG_TIME = 0.2, 0.01
_COLOURS = {"node": (0.75, 0.78, 0.82, 1.0), "flag": (0.2, 0.45, 0.8, 1.0)}


def _dress_nodes(spec: mujoco.MjSpec, scene: SceneLayout) -> None:
    """Spheres on all nodes that meet the pulleys (class "node"; what the pulleys say of contact does not count), and
    flags that rays, guides and a user's bodies meet (class "flag"): each line's reach halfway to the next, the outer
    lines' to the belt's real edge.

    A contact that began where a sphere has sunk in would begin at a depth of up to a step's fall, 0.1 mm, which
    stretches the chord behind it by several times the belt's strain. So contacts stand ready before touchdown, through
    a gap (an adhesion of no weight keeps them active there), and may be as stiff as the largest impedance allows.
    """
    mesh, dt, friction = scene.mesh, scene.options.step, scene.parts.friction
    node, flag = spec.add_default("node", spec.default), spec.add_default("flag", spec.default)
    touch, seen = node.geom, flag.geom
    touch.contype, touch.conaffinity, touch.condim, touch.priority = _NODE, _PULLEY | _USER, 3, 1
    touch.friction = [friction if math.isfinite(friction) else STICKING, 0.0, 0.0]
    touch.solref = [-CONTACT_STIFFNESS / dt**2, -CONTACT_DAMPING / dt]
    touch.solimp = [IMPEDANCE, IMPEDANCE, _WIDTH, 0.5, 2.0]
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
            if scene.parts.tapered:
                sphere.conaffinity = (_FIRST_LINE << j) | _USER
            size = [0.5 * _FLAGS_OVERLAP * scene.loop.chord, 0.5 * (ends[j] - ends[j + 1]), -CLEAR_OF_BELT]
            body.add_geom(flag, pos=[0.0, 0.5 * (ends[j] + ends[j + 1]) - mesh.line_y[j], 0.0], size=size)


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
    elif scene.parts.tapered:
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

_FASTEST, _TIGHTEST, _MOST_YAW = 2.0, 200.0, 0.5  # ranges of the sliders: m/s, N/mm2, degrees
_SPEED_GAIN, _DRIVE_FORCE = 2e4, 200.0  # [N s/m] and [N] at the rim: the drive accelerates the machine at 1-2 m/s2
_YAW_TIME = 0.05  # [s]: a pulley that jumped would leave the belt that it carries
_YAW_STIFFNESS = 1e9  # [N m/rad]: a moment of 100 N m turns the pulley by 1e-7 rad
_SOFT = 100.0  # [N/m], of the spring that gives the tail pulley its nominal pull, over metres


def _drive(spec: mujoco.MjSpec, scene: SceneLayout) -> None:
    """Let the model's default state be the laid belt under its tension; key frame ``running``: at its speed. Sliders in
    the units of the command line add to the case's own values.

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
    rim = scene.loop.radius_head - NODE_RADIUS  # [m]
    spins = np.array([0.0, pace / rim, 0.0, 0.0, pace / (scene.loop.radius_tail - NODE_RADIUS)])
    spec.add_key(name="running", qpos=spec.key("laid").qpos, qvel=np.concatenate([spins, (pace * way).ravel()]))

    loose = float(case.settings.tension) / N_PER_MM2
    torque = {name: spec.joint(f"{name}-yaw").stiffness[0] * DEGREE for name in ("tail", "head")}  # [N m] a degree
    for name, target, gear, least, most in (
        ("speed", "head-spin", rim, -_FASTEST, _FASTEST),
        ("tension", "tail-slide", 2.0 * float(case.belt.area) * N_PER_MM2, -loose, _TIGHTEST),
        ("tail_yaw", "tail-yaw", torque["tail"], -_MOST_YAW, _MOST_YAW),
        ("head_yaw", "head-yaw", torque["head"], -_MOST_YAW, _MOST_YAW),
    ):
        slider = spec.add_actuator(name=name, target=target, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        slider.gear[0], slider.ctrllimited, slider.ctrlrange = gear, True, [least, most]
        if name != "speed":
            slider.set_to_motor()
            continue
        slider.set_to_velocity(kv=_SPEED_GAIN)
        slider.biasprm[0] = _SPEED_GAIN * pace
        slider.forcelimited, slider.forcerange = True, [-_DRIVE_FORCE, _DRIVE_FORCE]


RAY = 0.3  # [m] from the middle of the machine to a ray's beginning, and from a level span to one above it


def _add_sensors(spec: mujoco.MjSpec, scene: SceneLayout) -> None:
    """Rays to the edges at each of the points 1-4 and to the flags at mid-span; joints; loads on the axles."""
    kind, site, joint = mujoco.mjtSensor, mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_JOINT
    head, tail, turn = scene.loop.radius_head, scene.loop.radius_tail, math.sqrt(0.5)
    middle = 0.25 * float(scene.case.belt.width) + 0.5 * float(scene.mesh.line_y[0])  # of what sticks out of the nodes
    x, level, rays = 0.5 * float(scene.case.rig.centre_distance), 0.5 * (head + tail), []
    for point, station, z in ((1, "tail", tail), (2, "tail", -tail), (3, "head", -head), (4, "head", head)):
        for side, way in (("left", 1.0), ("right", -1.0)):
            at, turned = [0, way * RAY, z], [turn, way * turn, 0, 0]
            rays.append((spec.body(f"{station}-carriage"), f"edge-{point}-{side}", at, turned))
    for span, z, quat in (("upper", level + RAY, [0, 1, 0, 0]), ("lower", -level - lower_ray(scene), [1, 0, 0, 0])):
        for side, way in (("left", 1.0), ("right", -1.0)):
            rays.append((spec.worldbody, f"height-{span}-{side}", [x, way * middle, z], [*map(float, quat)]))
    for body, name, at, turned in rays:
        body.add_site(name=name, pos=at, quat=turned, size=[5e-3] * 3, group=4)
        spec.add_sensor(name=name, type=kind.mjSENS_RANGEFINDER, objtype=site, objname=name, intprm=[1, 0, 0])
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


# A run of such a scene.

Edited: TypeAlias = mujoco.MjSpec | str | Path  # the path of an MJCF
_ACTUATORS = ("speed", "tension", "tail_yaw", "head_yaw")
_JOINTS = ("head-yaw", "head-spin", "tail-slide", "tail-yaw", "tail-spin")  # in the order of HEAD_YAW ...


class ContactRun:
    """A scene under way in plain MuJoCo."""

    def __init__(
        self, case: Case, belt: str, options: Options, parts: SceneParts, scene_path: Path | None = None,
        edited: Edited | None = None,
    ) -> None:  # fmt: skip
        """Build the scene (and write its MJCF): the belt laid round the pulleys, at its speed, ``scene.early`` before
        travel 0; edited: the scene that is run instead. Raises InputError for one that was made with other settings
        (yaw may differ), or that lacks the case's joints, nodes, actuators or key frame."""
        if parts.sets_in or parts.head.taper or parts.tail.taper:
            raise CannotRepresent(
                "model.contact = mujoco: taper, yaw_offset, cant and lean would act before travel 0 already; "
                "write them with belt-sim scene, or use model.contact=held"
            )
        spec, scene = build_contact(case, belt, options, parts)
        yaws = case.settings.yaw_head, case.settings.yaw
        self.mounted = np.array([float(yaw.last()) for yaw in yaws])  # [rad], where the sliders are at 0
        shown = str(edited) if isinstance(edited, str | Path) else ""
        try:
            if edited is not None:
                spec = edited if isinstance(edited, mujoco.MjSpec) else mujoco.MjSpec.from_file(str(edited))
            model = interface.compile_model(spec)
        except ValueError as error:
            remedy = f"give an MJCF that belt-sim scene wrote ({' '.join(str(error).split())})"
            raise InputError("model.scene", shown, "", remedy) from error
        if edited is not None:
            texts = [text.data for text in spec.texts if text.name == CASE]
            if not texts:
                remedy = f'it has no text "{CASE}"; edit a scene that belt-sim scene wrote'
                raise InputError("model.scene", shown, "", remedy)
            made = dict(entry.split(" = ") for entry in texts[0].split("; "))
            for name, value in case_words(scene).items():
                if name not in ("yaw", "yaw_head") and value != made.get(name):
                    there = f"the scene was made with {made.get(name, 'nothing')}"
                    raise InputError(name, value, "", f"{there}: give that, or write a scene with {value}")
            self.mounted = np.array([float(made["yaw_head"]), float(made["yaw"])]) * DEGREE
        if scene_path is not None:
            write_text(scene_path, interface.mjcf(spec, story(scene)))
        stations, lines, kinds = range(scene.mesh.stations), range(scene.mesh.lines), mujoco.mjtObj
        joints = [*_JOINTS, *(f"{node_name(i, j)}-{axis}" for i in stations for j in lines for axis in "xyz")]
        numbers = []
        for what, kind, names in (("joint", kinds.mjOBJ_JOINT, joints), ("actuator", kinds.mjOBJ_ACTUATOR, _ACTUATORS),
                                  ("key frame", kinds.mjOBJ_KEY, ("running",))):  # fmt: skip
            for name in names:
                numbers.append(mujoco.mj_name2id(model, kind, name))
                if numbers[-1] < 0:
                    remedy = "edit a scene that belt-sim scene made with the same settings, and leave its names"
                    raise InputError("model.scene", f"{shown} has no {what} {name}".strip(), "", remedy)
        of_joints = np.array(numbers[: len(joints)])  # wherever an edited scene has them
        self._places, self._rates = model.jnt_qposadr[of_joints], model.jnt_dofadr[of_joints]
        self.scene, self.model, self.data = scene, model, mujoco.MjData(model)
        # [m] of belt a turn of 1 rad
        self.rim = float(np.sign(float(case.settings.direction))) * (scene.loop.radius_head - NODE_RADIUS)
        # steps are made while the belt runs, within yaw_time: friction of contacts creeps at rest
        self.plan = YawPlan(case.settings, step_over=options.yaw_time * options.run_speed)
        self.travel, self.speed = -scene.early, 0.0
        mujoco.mj_resetDataKeyframe(model, self.data, numbers[-1])
        self.data.qpos[self._places[[HEAD_YAW, TAIL_YAW]]] = self.plan.angles(-scene.early, -math.inf)
        self.arrays = in_float64(belt_arrays)(scene, ActiveFeatures())

    def go(self, travel: float, observers: Sequence[Observer] = ()) -> Curves:
        """Run in, then ``travel`` [m]."""
        recorder, steps = Recorder(self.scene, observers, {"tail_x": TAIL_X, "steps": 20, "belt_speed": SPEED}), 0
        data = self.data
        watched = notify_observers(observers, self.scene.case, travel, recorder.curves, self.model, data)
        with watched, interface.silence_expected_warnings():
            while self.travel < travel + 0.5 * self.scene.options.sample:
                yaw = self.plan.angles(self.travel, -math.inf)  # the sliders are where the case wants them here
                data.actuator("head_yaw").ctrl, data.actuator("tail_yaw").ctrl = (yaw - self.mounted) / DEGREE
                interface.make_step(self.model, data)
                self.speed = data.qvel[self._rates[HEAD_SPIN]] * self.rim
                self.travel = data.qpos[self._places[HEAD_SPIN]] * self.rim - self.scene.early
                if self.travel >= recorder.next_reading and (self.speed != 0.0 or not recorder.table):
                    read, *at = self._read(steps, yaw)
                    if not recorder.table:
                        recorder.add(np.where(np.arange(len(read)) == TRAVEL_ROW, 0.0, read), *at)
                    read[-1] += 1
                    recorder.add(read, *at)
                steps += 1
            recorder.show(*self._read(steps, yaw), last=True)
        return recorder.curves()

    def _read(self, steps: int, yaw: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
        """What the recorder is told after so many steps: MuJoCo's contacts say nothing of which stations they hold."""
        mesh, qpos = self.scene.mesh, self.data.qpos[self._places]
        slides = qpos[STATION_JOINTS:].reshape(mesh.rest.shape)
        tail_x = float(self.scene.case.rig.centre_distance) + float(qpos[TAIL_SLIDE])
        x, found = (mesh.rest + slides).mean(axis=1)[:, 0], []
        for on in map(np.flatnonzero, (x <= 0.0, x >= tail_x)):  # consecutive numbers, modulo those of all stations
            if not len(on):
                where = "no node lies on a pulley: the belt has run off"
                raise SimulationError(f"{where}; turn the yaw back earlier or raise the tension")
            first = on[(np.argmax(np.diff(on, append=on[0] + mesh.stations)) + 1) % len(on)]
            found.append((first, first + len(on) - 1))
        ends = np.array(found)
        if ends[TAIL, 0] < ends[HEAD, 1]:  # the upper span runs from head to tail
            ends[TAIL] += mesh.stations
        read = np.asarray(_reading(self.arrays, np.moveaxis(mesh.rest + slides, 0, -1), *ends.T, tail_x, 0.0))
        return np.concatenate([read, [self.travel, self.speed, steps]]), slides, self.data.time, yaw


_reading = jit_float64(reading)
