"""A belt on MJX: its model, which stands still, its data, which move, and the commands of a run."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import mjx

from belt_sim.case import Case
from belt_sim.case import Numbers as Array
from belt_sim.jax_setup import in_float64
from belt_sim.scene_parts import SceneParts
from belt_sim.space.belt import ActiveFeatures, BatchShape, BeltArrays, active_features, belt_arrays
from belt_sim.space.machine import (
    HEAD_SPIN,
    STATION_JOINTS,
    TAIL_SPIN,
    SceneLayout,
    build_scene,
    laid_coordinates,
    lay_out,
    station_mass,
)
from belt_sim.space.mjx_interface import plain_model, to_mjx
from belt_sim.space.options import Options, fit_options
from belt_sim.space.pulleys import TailPulley, lay_pulleys
from belt_sim.space.run import ANGLES, EDGES, MOMENTS, POINTS, SAGS, TENSION, TILTS, Command
from belt_sim.space.wrap import BeltOnPulley


class MjxModel(NamedTuple):
    """What stands still in a run. mjx: MJX's model; belt: what its nodes are tied by; settle [s]: time over
    which a wobble sets in."""

    mjx: mjx.Model
    belt: BeltArrays
    tail: TailPulley
    settle: Array

    @property
    def dt(self) -> Array:
        """Duration of a step [s]."""
        return self.mjx.opt.timestep


class MjxData(NamedTuple):
    """What moves. mjx: MJX's data, which MuJoCo's renderer and viewer take through mjx.get_data; pulleys: head and
    tail; loads (2, 3): of ``belt_loads``;
    travel [m]: of the belt; compliance_yaw [rad], (2,): by which the pulleys give way, None if they do not;
    reading (20,): of the instruments, READING says what of."""

    mjx: mjx.Data
    pulleys: BeltOnPulley
    loads: Array
    travel: Array
    compliance_yaw: Array | None
    reading: Array


#: rows of a reading: y of points 1-4 [m], angles there [rad], entry moments [N m], slack-edge stresses [Pa], tilts
#: [rad], sags [m], tension [Pa], x of the tail pulley [m], travel [m], belt speed [m/s]
READING: dict[str, Any] = {
    "y": POINTS, "angle": ANGLES, "moment": MOMENTS, "edge_stress": EDGES, "tilt": TILTS, "sag": SAGS,
    "tension": TENSION, "tail_x": 17, "travel": 18, "speed": 19,
}  # fmt: skip


def command(model: MjxModel, data: MjxData, speed: Array, yaw: Array, drag: Array | float = 1.0) -> Command:
    """The command of a controller: belt speed [m/s] and yaw [rad], (2,): head, tail; drag [1/s]: across the travel."""
    before = data.reading[READING["speed"]]
    travel, one = data.travel + model.dt * speed, jnp.ones(())
    drags = jnp.stack([0.0 * one, drag * one])
    return Command(travel, yaw, one, one * speed, (speed - before) / model.dt, drags)


@dataclass(frozen=True)
class PreparedCase:
    """A case ready to be stepped: its scene, the model, and the belt laid round the pulleys at rest."""

    case: Case
    scene: SceneLayout
    model: MjxModel
    data: MjxData
    spec: mujoco.MjModel


@in_float64
def prepare(
    cases: Sequence[Case],
    *,
    belt: str = "flex",
    options: Options | None = None,
    parts: Sequence[SceneParts] | None = None,
    features: ActiveFeatures | None = None,
    edit: Callable[[mujoco.MjSpec], None] | None = None,
) -> list[PreparedCase]:
    """Cases of one mesh, ready to be stepped: one MJCF is compiled and handed to MJX, with each case's own numbers.

    belt: "flex" or "grid"; options: fitted to a case, or to be fitted; parts: the scenes as effects change them;
    features: in the batch, None = in these cases; edit: adds actuators and sensors to the scene before it is compiled.
    """
    options = options or Options()
    several = parts or [SceneParts.from_case(case, options.friction) for case in cases]
    features = features or active_features(several)
    own = [fit_options(options, c, "flex") for c in cases]  # the step is implicit in bonds across their direction, too
    spec, _ = build_scene(cases[0], belt, own[0], replace(several[0], edge_guides=()))
    if edit is not None:
        edit(spec)
    compiled = plain_model(spec, own[0].dt)
    shared_model, shared_data = to_mjx(compiled, compiled.qpos0)
    prepared = []
    for case, fitted, acting in zip(cases, own, several, strict=True):
        scene = lay_out(case, belt, fitted, acting)
        arrays = belt_arrays(scene, features)
        pulleys = lay_pulleys(scene, arrays)
        m = with_numbers_of(shared_model, scene, compiled)
        tail = TailPulley.from_scene(scene, compiled, np.asarray(m.body_mass), np.asarray(m.dof_armature))
        model = MjxModel(m, arrays, TailPulley(*map(np.array, tail)), np.array(max(fitted.settle, 1e-9)))
        data = MjxData(
            mjx=shared_data.replace(qpos=jnp.asarray(laid_coordinates(scene, *pulleys.pose.spin))),
            pulleys=pulleys,
            loads=np.outer([1.0, -1.0], [2.0 * float(case.tension_force), 0.0, 0.0]),
            travel=np.array(-scene.early),
            compliance_yaw=np.zeros(2) if features.gives_way else None,
            reading=np.zeros(20),
        )
        prepared.append(PreparedCase(scene.case, scene, model, data, compiled))
    return prepared


def with_numbers_of(m: mjx.Model, scene: SceneLayout, compiled: mujoco.MjModel) -> mjx.Model:
    """MJX's model with the masses, places, gravity and step of another scene of the same mesh."""
    mesh, case = scene.mesh, scene.case
    body_pos, body_mass, armature = np.array(m.body_pos), np.array(m.body_mass), np.array(m.dof_armature)
    first = m.nbody - mesh.stations * mesh.lines
    body_pos[first:] = mesh.rest.reshape(-1, 3)
    body_mass[first:] = np.broadcast_to(mesh.mass, mesh.rest.shape[:2]).ravel()
    mass = station_mass(case, scene.options)
    for name, spin, radius in (
        ("head", HEAD_SPIN, scene.loop.radius_head),
        ("tail", TAIL_SPIN, scene.loop.radius_tail),
    ):
        body_mass[compiled.body(f"{name}-carriage").id] = mass
        armature[spin] = mass * radius**2
    body_pos[compiled.body("tail-carriage").id, 0] = float(case.rig.centre_distance)
    gravity, dt = jnp.array([0.0, 0.0, -scene.parts.gravity]), jnp.array(float(scene.options.dt))
    return m.replace(  # arrays of JAX: those of NumPy are constants to MJX
        body_pos=jnp.asarray(body_pos),
        body_mass=jnp.asarray(body_mass),
        dof_armature=jnp.asarray(armature),
        opt=m.opt.replace(gravity=gravity, timestep=dt),
    )


def nodes_of(shape: BatchShape, flat: Array) -> Array:
    """Values by node (m, 3, n) of values by coordinate, those of the pulleys left out."""
    flat = flat[STATION_JOINTS:] if flat.shape[0] == STATION_JOINTS + 3 * shape.lines * shape.stations else flat
    return jnp.moveaxis(flat.reshape(shape.stations, shape.lines, 3), 0, -1)


def flat_of(base: Array, nodes: Array) -> Array:
    """Values by coordinate: those of the pulleys' joints (5,), then those of the nodes (m, 3, n)."""
    return jnp.concatenate([base, jnp.moveaxis(nodes, -1, 0).reshape(-1)])
