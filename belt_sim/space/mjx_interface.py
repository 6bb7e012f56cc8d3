"""Every assumption about MuJoCo MJX 3.17 in one place, each with its own test in tests/space/test_mjx_interface.py.

MJX (its JAX implementation) takes no flex and no discrete integrator, and its tendons and equalities have dense
Jacobians. So a scene goes to MJX without these. MJX then supplies where bodies are, inertia, the springs and dampers of
joints, gravity and Coriolis forces, actuators, sensors, and the advance of a step from given accelerations.
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import mjx
from mujoco.mjx._src import scan

from belt_sim.case import Numbers as Array
from belt_sim.space.mujoco_interface import compile_model

T = TypeVar("T")


def plain_model(spec: mujoco.MjSpec, dt: float) -> mujoco.MjModel:
    """The compiled model of ``spec`` without flex, tendons, equalities and key frames, for steps of ``dt`` [s].

    The spec loses them for good. Key frames and sizes of geoms are part of what JAX compiles for: the former go and the
    latter, only seen, are rounded to 0.1 mm, so that cases share what is compiled.
    MJX's own implicit damping is off: the belt's step has the damping already.
    """
    for elements in (spec.flexes, spec.tendons, spec.equalities, spec.keys):
        for element in list(elements):
            spec.delete(element)
    for geom in spec.geoms:
        geom.size = np.round(geom.size, 4)
    model = compile_model(spec)
    model.opt.timestep = dt
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    return model


def to_mjx(model: mujoco.MjModel, qpos: np.ndarray) -> tuple[mjx.Model, mjx.Data]:
    """The model and its data at rest at ``qpos``, on JAX.

    MJX commits them to a device. The results of a step would be committed as well, unlike a command or the data before
    the first step, and ``jax.jit`` would compile everything once more for them. So they are returned uncommitted.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    tied = mjx.put_model(model, impl="jax"), mjx.put_data(model, data, impl="jax")
    return jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)), tied)


def compute_multibody(m: mjx.Model, d: mjx.Data) -> mjx.Data:
    """The data with what MJX computes of its position and velocity: xpos, inertia, qfrc_passive, qfrc_bias."""
    for stage in (mjx.kinematics, mjx.com_pos, mjx.crb, mjx.com_vel, mjx.passive, mjx.rne):
        d = stage(m, d)
    return d


def apply_actuators(m: mjx.Model, d: mjx.Data) -> mjx.Data:
    """The data with qfrc_actuator of its controls; unchanged where the scene has no actuator."""
    if not m.nu:
        return d
    d = mjx.transmission(m, mjx.com_pos(m, mjx.kinematics(m, d)))
    d = d.tree_replace({"_impl.actuator_velocity": d._impl.actuator_moment @ d.qvel})
    return mjx.fwd_actuation(m, d)


def read_sensors(m: mjx.Model, d: mjx.Data) -> mjx.Data:
    """The data with sensordata of its positions and velocities; unchanged where the scene has no sensor."""
    if not m.nsensor:
        return d
    d = mjx.com_vel(m, mjx.com_pos(m, mjx.kinematics(m, d)))
    return mjx.sensor_vel(m, mjx.sensor_pos(m, d))


def node_masses(m: mjx.Model, d: mjx.Data) -> Array:
    """The mass matrix of ``multibody`` times ones: of slides that stand square to each other, their masses [kg]."""
    return mjx.mul_m(m, d, jnp.ones(m.nv))


def advance(m: mjx.Model, d: mjx.Data, qacc: Array) -> mjx.Data:
    """The data a step later under given accelerations: qvel + h qacc, then qpos + h qvel, time + h."""
    return mjx.euler(m, d.replace(qacc=qacc))


def stack_cases(trees: Sequence[T]) -> tuple[T, Any]:
    """Cases of one structure as one: leaves that differ stacked on a first axis, and the in_axes for jax.vmap.

    MJX keeps some fields as part of the structure, so cases must come from one compiled scene.
    """
    parts = [jax.tree.flatten(tree) for tree in trees]
    structure = parts[0][1]
    leaves, axes = [], []
    for some in zip(*(leaves for leaves, _ in parts), strict=True):
        first = np.asarray(some[0])
        same = all(leaf is some[0] or np.array_equal(first, leaf, equal_nan=True) for leaf in some[1:])
        leaves.append(some[0] if same else np.stack([np.asarray(leaf) for leaf in some]))
        axes.append(None if same else 0)
    return jax.tree.unflatten(structure, leaves), jax.tree.unflatten(structure, axes)


def _once_a_model(function: Callable[[mjx.Model], np.ndarray]) -> Callable[[mjx.Model], np.ndarray]:
    memory: dict[int, tuple[Any, np.ndarray]] = {}

    def lookup(m: mjx.Model) -> np.ndarray:
        kinds = m.jnt_type
        if id(kinds) not in memory or memory[id(kinds)][0] is not kinds:
            memory.clear()
            memory[id(kinds)] = kinds, function(m)
        return memory[id(kinds)][1]

    return lookup


#: MJX asks for the body of every coordinate once a body, in Python: 195 s of tracing on the full rig
SLOW = "_q_bodyid"
if hasattr(scan, SLOW):
    setattr(scan, SLOW, _once_a_model(getattr(scan, SLOW)))
