"""The pulleys: where they are, how the belt is laid on them, and how it moves and turns them."""

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.belt_mechanics.belt import Belt, Shape, Surfaces
from belt_sim.belt_mechanics.wrap import HEAD, TAIL, Pose, Wrap, axes_of, depth, turning
from belt_sim.mujoco3d import state as mujoco3d
from belt_sim.mujoco3d.machine.scene import Scene
from belt_sim.mujoco3d.wrap.contact import laid_wraps
from belt_sim.pytree import Numbers as Array


def laid(scene: Scene) -> tuple[Array, Wrap, Pose]:
    """The belt laid round the pulleys, at rest, before its run-in: nodes [m], (m, 3, n), wraps and poses of both."""
    mesh, parts, sign = scene.mesh, scene.parts, float(np.sign(float(scene.case.settings.direction)))
    places = ((0.0, parts.head), (scene.loop.centre_distance, parts.tail))
    poses = [
        mujoco3d.Pose(np.array([x, 0.0, 0.0]), surface.axes(0.0, 0.0, askew=0.0), -sign * scene.early / surface.radius)
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
    )
    poses_of_both = Pose(*(np.stack([getattr(p, f) for p in poses]) for f in Pose._fields))
    return np.moveaxis(mesh.laid, 0, -1), both, poses_of_both


def pose_of(
    shape: Shape,
    belt: Belt,
    travel: Array,
    yaw: Array,
    share: Array,
    tail: Array,
    turned: Array | None = None,
    askew: Array | float = 1.0,
) -> Pose:
    """Where the pulleys are, with the tail pulley at x [m] and spin [rad] ``tail``.

    yaw [rad], (2,): commanded; share [1]: of what else turns them; turned [rad], (2,): by which they give way;
    askew [1]: share of the wobble.
    """
    rolled = shape.sign * travel / belt.surfaces.radius
    yaw = yaw if turned is None else yaw + turned
    axes = jax.vmap(axes_of, in_axes=(0, 0, None, 0, None))(belt.surfaces, yaw, share, rolled, askew)
    return Pose(jnp.zeros((2, 3)).at[TAIL, 0].set(tail[0]), axes, jnp.stack([rolled[HEAD], tail[1]]))


def behind(shape: Shape, wraps: Wrap, belt: Belt, pose: Pose) -> Array:
    """How far the outermost stations lie behind the tangent points [m], by pulley and end (2, 2)."""

    def one(wrap: Wrap, surface: Surfaces, pose: Pose) -> Array:
        ends = [k % shape.stations for k in (wrap.first, wrap.last)]
        middle = [0.5 * (wrap.angle[0, k] + wrap.angle[-1, k]) for k in ends]
        return jnp.stack([depth(wrap, surface, pose, a, end) for end, a in enumerate(middle)])

    return jax.vmap(one)(wraps, belt.surfaces, pose)


def moves_of(shape: Shape, wraps: Wrap, pose: Pose) -> Array:
    """How the tail's outermost stations move with its slide and its spin, (2, 3 m, 2)."""
    wrap, at = (jax.tree.map(lambda v: v[TAIL], tree) for tree in (wraps, pose))
    along = jnp.tile(jnp.array([1.0, 0.0, 0.0]), shape.lines)
    ends = [turning(wrap, at, k % shape.stations).ravel() for k in (wrap.first, wrap.last)]
    return jnp.stack([jnp.stack([along, turned], axis=1) for turned in ends])


def moments(shape: Shape, wraps: Wrap, pose: Pose, nodes: Array, pull: Array) -> Array:
    """Moments about z [N m] that the belt does to head and tail, (2,); nodes [m], pull [N], (m, 3, n)."""

    def one(wrap: Wrap, pose: Pose) -> Array:
        count = (wrap.last - wrap.first) % shape.stations
        held = (jnp.arange(shape.stations) - wrap.first) % shape.stations <= count
        arms = nodes - pose.centre[:, None]
        return jnp.where(held, arms[:, 0] * pull[:, 1] - arms[:, 1] * pull[:, 0], 0.0).sum()

    return jax.vmap(one)(wraps, pose)
