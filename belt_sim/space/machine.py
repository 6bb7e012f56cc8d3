"""A case as a scene: where the belt lies round the pulleys, and its MJCF.

The head pulley is driven, the tail pulley is free on its slide and its axis, both are yawed as commanded.
"""

import math
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.errors import CannotRepresent
from belt_sim.io import MODEL_FOLDER
from belt_sim.scene_parts import PulleySurface, SceneParts
from belt_sim.space.loop import LaidLoop, lay_loop, lift
from belt_sim.space.mesh import BELT_MODELS, Mesh
from belt_sim.space.mujoco_interface import set_solver
from belt_sim.space.options import RESIDUAL_TORSION, Options
from belt_sim.units import N_PER_MM2

STATION = MODEL_FOLDER / "pulley_station.xml"
#: the pulleys' joints in a scene; the nodes follow
HEAD_YAW, HEAD_SPIN, TAIL_SLIDE, TAIL_YAW, TAIL_SPIN = range(5)
STATION_JOINTS = 5
_STAGGER_MARGIN = 6.0  # 0.5 would be the limit of stability
_FACE_MARGIN = 1.5  # pulley face over belt width, only seen
_ROLLER = (0.02, 0.03)  # [m], radius and half height of an edge guide, only seen


@dataclass(frozen=True)
class SceneLayout:
    """What stands still in a run. case: with the gravity of its parts; kind: of belt, "rope", "grid" or "flex";
    early [m]: travel before travel 0."""

    case: Case
    kind: str
    options: Options
    parts: SceneParts
    mesh: Mesh
    loop: LaidLoop
    early: float


def lay_out(case: Case, belt: str, options: Options, parts: SceneParts, *, path=lift) -> SceneLayout:
    """The scene: the belt's nodes laid round the pulleys, which they come onto along ``path`` (loop.py)."""
    case = replace(case, rig=replace(case.rig, gravity=parts.gravity))
    loop, early = lay_loop(case, options.dx, path=path), options.run_in
    mesh = BELT_MODELS[belt].mesh(case, loop, options)
    if parts.camber is not None:
        if mesh.lines == 1:
            raise CannotRepresent(
                "camber: a rope of particles has no width that could be curved; use belt=flex or grid"
            )
        shift = float(np.sign(float(case.settings.direction))) * early  # each link lies where it does at travel 0
        middle = loop.chord * (np.arange(mesh.stations) + 0.5) + shift
        mesh = replace(mesh, curvature=parts.camber(middle % (loop.chord * mesh.stations)))
    if parts.residual:
        mesh = replace(mesh, residual=parts.residual / float(case.belt.youngs_modulus))
        # Strips of a membrane between three or more lines hold each other's width and shear, and twist 9-15 % too
        # easily. Steel edges carry pressure over some mm (studies/notes/shell.md), lines of nodes fold.
        tension, modulus = float(case.settings.tension), float(case.belt.youngs_modulus)
        what = f"effects = flatness: a residual stress of {mesh.residual * modulus / N_PER_MM2:.3g} N/mm2"
        if belt == "flex" and mesh.lines > 2:
            raise CannotRepresent(f"{what} needs model.across = 2 in a membrane; use that, or model=mujoco_grid")
        if RESIDUAL_TORSION * mesh.residual * modulus >= tension:
            shown = f"{tension / N_PER_MM2:g} N/mm2"
            raise CannotRepresent(f"{what} is too much for {shown}: the spans twist by themselves")
        if tension + modulus * mesh.residual_strain.min() <= 0.0:
            slack = f"makes a line of {mesh.lines} slack, which folds"
            raise CannotRepresent(f"{what} {slack}: give a smaller model.across")
    return SceneLayout(case, belt, options, parts, mesh, loop, early)


def build_scene(case: Case, belt: str, options: Options, parts: SceneParts) -> tuple[mujoco.MjSpec, SceneLayout]:
    """The scene, and its specification, not yet compiled."""
    spec, scene = begin_scene(case, belt, options, parts)
    set_solver(spec, options.step, parts.gravity, still="head-yaw")
    for guide in add_guides(spec, scene):  # only seen; what they do to the belt is ``belt.guide_forces``
        guide.contype = guide.conaffinity = 0
    return spec, scene


def add_guides(spec: mujoco.MjSpec, scene: SceneLayout) -> list[mujoco.MjsGeom]:
    """The geoms of the rollers beside the spans."""
    found, case = [], scene.case
    for k, guide in enumerate(scene.parts.edge_guides):
        level = float(case.rig.tail_radius) * (1.0 if guide.span == "upper" else -1.0)
        y = guide.side * (0.5 * float(case.belt.width) + guide.gap + _ROLLER[0])
        geom = spec.worldbody.add_geom(name=f"guide-{k}", pos=[guide.x, y, level], size=[*_ROLLER, 0.0])
        geom.type, geom.rgba, geom.group = mujoco.mjtGeom.mjGEOM_CYLINDER, [0.9, 0.6, 0.1, 1.0], 1
        found.append(geom)
    return found


def begin_scene(
    case: Case, belt: str, options: Options, parts: SceneParts, *, path=lift
) -> tuple[mujoco.MjSpec, SceneLayout]:
    """The belt laid round both pulleys (key frame "laid"), light, and cameras that see the whole machine from the side
    (sag) and from above; nothing that holds the belt there. path: as of ``lay_out``."""
    scene = lay_out(case, belt, options, parts, path=path)
    spec, length = mujoco.MjSpec(), float(scene.case.rig.centre_distance)
    spec.modelname = "belt on two pulleys"
    spec.stat.extent = 2.0
    spec.worldbody.add_light(pos=[0, -3, 4], dir=[0, 0.6, -0.8], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    far = length + 0.5
    spec.worldbody.add_camera(name="side", pos=[length / 2, -far, 0.2], xyaxes=[1, 0, 0, 0, 0, 1])
    spec.worldbody.add_camera(name="above", pos=[length / 2, 0, far], xyaxes=[1, 0, 0, 0, 1, 0])
    _add_station(spec, "head", 0.0, scene.parts.head, scene.loop.radius_head, scene)
    _add_station(spec, "tail", length, scene.parts.tail, scene.loop.radius_tail, scene)
    BELT_MODELS[belt].tie(spec, scene.mesh, scene.case, options)
    spec.add_key(name="laid", qpos=laid_coordinates(scene))
    return spec, scene


def laid_coordinates(scene: SceneLayout, head_spin: float = 0.0, tail_spin: float = 0.0) -> np.ndarray:
    """Coordinates of aligned pulleys of these spins [rad], shape (5,), and of the nodes laid round them."""
    joints = np.zeros(STATION_JOINTS)
    joints[TAIL_SLIDE] = scene.loop.centre_distance - float(scene.case.rig.centre_distance)
    joints[HEAD_SPIN], joints[TAIL_SPIN] = head_spin, tail_spin
    return np.concatenate([joints, (scene.mesh.laid - scene.mesh.rest).ravel()])


def _add_station(
    spec: mujoco.MjSpec, name: str, x: float, surface: PulleySurface, radius: float, scene: SceneLayout
) -> None:
    """Attach models/pulley_station.xml; the head does not slide."""
    station = mujoco.MjSpec.from_file(str(STATION))
    mass, width = station_mass(scene.case, scene.options), float(scene.case.belt.width)
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
    return max(options.tail_mass, _STAGGER_MARGIN * options.step**2 * stiffness)
