"""Runs of the 3D belt on JAX: one case, or a batch of cases of one mesh at once."""

import math
from collections.abc import Sequence
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.mjx.belt import Belt, Shape, belt_of
from belt_sim.mjx.measure import reading
from belt_sim.mjx.plan import Plan, plan_of
from belt_sim.mjx.step import Command, State, step
from belt_sim.mjx.wrap import Wrap
from belt_sim.mujoco3d.machine.scene import Scene, lay_out
from belt_sim.mujoco3d.mesh.grid import Grid
from belt_sim.mujoco3d.mesh.membrane import Membrane
from belt_sim.mujoco3d.options import Options
from belt_sim.mujoco3d.run.fitted import fitted
from belt_sim.mujoco3d.state import Pose
from belt_sim.mujoco3d.wrap.contact import laid_wraps
from belt_sim.scene_parts import SceneParts

_BELTS = {"grid": Grid, "flex": Membrane}


def laid(scene: Scene) -> State:
    """The belt laid round the pulleys, at rest, before its run-in."""
    mesh, parts, sign = scene.mesh, scene.parts, float(np.sign(float(scene.case.settings.direction)))
    places = ((0.0, parts.head), (scene.loop.centre_distance, parts.tail))
    poses = [
        Pose(np.array([x, 0.0, 0.0]), surface.axes(0.0, 0.0), -sign * scene.early / surface.radius)
        for x, surface in places
    ]
    wraps = laid_wraps(
        mesh, scene.loop, mesh.laid - mesh.rest, (poses[0], poses[1]), (parts.head.radius, parts.tail.radius)
    )
    both = Wrap(
        first=np.array([w.first for w in wraps]),
        last=np.array([w.last for w in wraps]),
        r=np.stack([w.r.T for w in wraps]),
        y=np.stack([w.y.T for w in wraps]),
        angle=np.stack([w.angle.T for w in wraps]),
        lifted=np.stack([w.lifted for w in wraps]),
        tangent=np.stack([w.tangent for w in wraps]),
        slip=np.zeros((2, mesh.across, mesh.stations, 2)),
    )
    return State(
        nodes=np.moveaxis(mesh.laid, 0, -1),
        wraps=both,
        tail_x=np.array(scene.loop.centre_distance),
        tail_spin=np.array(poses[1].spin),
        tension=np.array(float(scene.case.tension_force)),
        travel=np.array(-scene.early),
        residual=np.array(0.0),
    )


@partial(jax.jit, static_argnums=0)
def marched(shape: Shape, belt: Belt, state: State, commands: Command) -> jnp.ndarray:
    """Rows of mean readings, shape (rows, 17 + 3): readings, x of the tail pulley [m], travel [m], residual [N]."""

    def one(state: State, command: Command):
        state = step(shape, belt, state, command)
        read = reading(shape, belt, state.nodes, state.wraps, state.tail_x, command.share)
        return state, jnp.concatenate([read, jnp.stack([state.tail_x, state.travel, state.residual])])

    def row(state: State, commands: Command):
        state, reads = jax.lax.scan(one, state, commands)
        return state, jnp.concatenate([reads[:, :-2].mean(axis=0), reads[-1, -2:-1], reads[:, -1:].max(axis=0)])

    return jax.lax.scan(row, state, commands)[1]
