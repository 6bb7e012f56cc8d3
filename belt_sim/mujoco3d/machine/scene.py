"""Case -> MJCF: two pulley stations and a belt, as a MuJoCo specification."""

import math
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.errors import CannotRepresent
from belt_sim.mujoco3d.machine.tensioning import Apart
from belt_sim.mujoco3d.mesh.belt import BeltModel, Mesh
from belt_sim.mujoco3d.mesh.loop import Loop, laid_loop
from belt_sim.mujoco3d.mesh.natural import curved
from belt_sim.mujoco3d.mesh.path import lift
from belt_sim.mujoco3d.mujoco_4 import make_factorised, set_solver
from belt_sim.mujoco3d.options import Options
from belt_sim.paths import MODELS
from belt_sim.scene_parts import EdgeGuide, PulleySurface, SceneParts

STATION = MODELS / "pulley_station.xml"
#: the pulleys' joints in a scene; the nodes follow
HEAD_YAW, HEAD_SPIN, TAIL_SLIDE, TAIL_YAW, TAIL_SPIN = range(5)
STATION_JOINTS = 5
_STAGGER_MARGIN = 6.0  # 0.5 would be the limit of stability
_FACE_MARGIN = 1.5  # pulley face over belt width, only seen
_ROLLER = (0.02, 0.03)  # [m], radius and half height of an edge guide, only seen


@dataclass(frozen=True)
class Scene:
    """What stands still in a run. case: with the gravity of its parts; early [m]: travel before travel 0; apart: how
    the pulleys move apart at its beginning."""

    case: Case
    options: Options
    parts: SceneParts
    mesh: Mesh
    loop: Loop
    early: float
    apart: Apart | None = None


def lay_out(case: Case, belt: BeltModel, options: Options, parts: SceneParts, *, path=lift) -> Scene:
    """The scene: the belt's nodes laid round the pulleys, which they come onto along ``path`` (mesh/loop.py)."""
    case = replace(case, rig=replace(case.rig, gravity=parts.gravity))
    loop, laid = laid_loop(case, options.dx, path=path), case
    apart = Apart.of(case, loop) if options.tensioning == "koller" else None
    if apart is not None:
        laid, loop = apart.slack, laid_loop(apart.slack, options.dx, len(loop.x), path=path)
    early = options.run_in + (apart.travel if apart else 0.0)
    mesh = _cambered(belt.mesh(laid, loop, options), loop, parts, laid, early)
    return Scene(case, options, parts, mesh, loop, early, apart)


def build(case: Case, belt: BeltModel, options: Options, parts: SceneParts) -> tuple[mujoco.MjSpec, Scene]:
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
    make_factorised(spec, "head-yaw")
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


def _cambered(mesh: Mesh, loop: Loop, parts: SceneParts, case: Case, early: float) -> Mesh:
    """The mesh with the natural curvature that the belt has where each link lies at travel 0."""
    if parts.camber is None:
        return mesh
    if mesh.across == 1:
        raise CannotRepresent("camber: a rope of particles has no width that could be curved; use belt=flex or grid")
    shift = float(np.sign(float(case.settings.direction))) * early
    middle = loop.chord * (np.arange(mesh.stations) + 0.5) + shift
    return curved(mesh, parts.camber(middle % (loop.chord * mesh.stations)))


def _draw_guide(spec: mujoco.MjSpec, name: str, guide: EdgeGuide, case: Case) -> None:
    """A standing roller, only seen; what it does to the belt is in loads/guides.py."""
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
