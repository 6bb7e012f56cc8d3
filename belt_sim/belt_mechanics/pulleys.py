"""The pulleys: where they are, how the belt is laid on them and loads them, and the readings taken there."""

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.belt_mechanics.belt import BatchShape, BeltArrays, SurfaceArrays
from belt_sim.belt_mechanics.elastic import strains
from belt_sim.belt_mechanics.wrap import HEAD, TAIL, PoseArrays, WrapArrays, axes_of, depth, spin_derivative
from belt_sim.jax_setup import Numbers as Array
from belt_sim.mujoco3d import state as mujoco3d
from belt_sim.mujoco3d.machine import SceneLayout
from belt_sim.mujoco3d.options import AXIS_STATIONS, RUNUP_LINKS
from belt_sim.mujoco3d.wrap import lay_wraps


def lay_belt(scene: SceneLayout) -> tuple[Array, WrapArrays, PoseArrays]:
    """The belt laid round the pulleys, at rest, before its run-in: nodes [m], (m, 3, n), wraps and poses of both."""
    mesh, parts, sign = scene.mesh, scene.parts, float(np.sign(float(scene.case.settings.direction)))
    places = ((0.0, parts.head), (scene.loop.centre_distance, parts.tail))
    poses = [
        mujoco3d.Pose(np.array([x, 0.0, 0.0]), surface.axes(0.0, 0.0, askew=0.0), -sign * scene.early / surface.radius)
        for x, surface in places
    ]
    wraps = lay_wraps(
        mesh, scene.loop, mesh.laid - mesh.rest, (poses[0], poses[1]), (parts.head.radius, parts.tail.radius)
    )
    both = WrapArrays(
        first=np.array([w.first for w in wraps]),
        last=np.array([w.last for w in wraps]),
        r=np.stack([w.r.T for w in wraps]),
        y=np.stack([w.y.T for w in wraps]),
        angle=np.stack([w.angle.T for w in wraps]),
        landing_lift=np.stack([w.landing_lift for w in wraps]),
        tangent=np.stack([w.tangent for w in wraps]),
    )
    poses_of_both = PoseArrays(*(np.stack([getattr(p, f) for p in poses]) for f in PoseArrays._fields))
    return np.moveaxis(mesh.laid, 0, -1), both, poses_of_both


def pose_of(
    shape: BatchShape,
    belt: BeltArrays,
    travel: Array,
    yaw: Array,
    share: Array,
    tail: Array,
    turned: Array | None = None,
    askew: Array | float = 1.0,
) -> PoseArrays:
    """Where the pulleys are, with the tail pulley at x [m] and spin [rad] ``tail``.

    yaw [rad], (2,): commanded; share [1]: of what else turns them; turned [rad], (2,): by which they give way;
    askew [1]: share of the wobble.
    """
    rolled = shape.sign * travel / belt.surfaces.radius
    yaw = yaw if turned is None else yaw + turned
    axes = jax.vmap(axes_of, in_axes=(0, 0, None, 0, None))(belt.surfaces, yaw, share, rolled, askew)
    return PoseArrays(jnp.zeros((2, 3)).at[TAIL, 0].set(tail[0]), axes, jnp.stack([rolled[HEAD], tail[1]]))


def depth_at_ends(shape: BatchShape, wraps: WrapArrays, belt: BeltArrays, pose: PoseArrays) -> Array:
    """How far the outermost stations lie behind the tangent points [m], by pulley and end (2, 2)."""

    def one(wrap: WrapArrays, surface: SurfaceArrays, pose: PoseArrays) -> Array:
        ends = [k % shape.stations for k in (wrap.first, wrap.last)]
        middle = [0.5 * (wrap.angle[0, k] + wrap.angle[-1, k]) for k in ends]
        return jnp.stack([depth(wrap, surface, pose, a, end) for end, a in enumerate(middle)])

    return jax.vmap(one)(wraps, belt.surfaces, pose)


def tail_derivatives(shape: BatchShape, wraps: WrapArrays, pose: PoseArrays) -> Array:
    """How the tail's outermost stations move with its slide and its spin, (2, 3 m, 2)."""
    wrap, at = (jax.tree.map(lambda v: v[TAIL], tree) for tree in (wraps, pose))
    along = jnp.tile(jnp.array([1.0, 0.0, 0.0]), shape.lines)
    ends = [spin_derivative(wrap, at, k % shape.stations).ravel() for k in (wrap.first, wrap.last)]
    return jnp.stack([jnp.stack([along, turned], axis=1) for turned in ends])


def yaw_moments(shape: BatchShape, wraps: WrapArrays, pose: PoseArrays, nodes: Array, pull: Array) -> Array:
    """Moments about z [N m] that the belt does to head and tail, (2,); nodes [m], pull [N], (m, 3, n)."""

    def one(wrap: WrapArrays, pose: PoseArrays) -> Array:
        count = (wrap.last - wrap.first) % shape.stations
        held = (jnp.arange(shape.stations) - wrap.first) % shape.stations <= count
        arms = nodes - pose.centre[:, None]
        return jnp.where(held, arms[:, 0] * pull[:, 1] - arms[:, 1] * pull[:, 0], 0.0).sum()

    return jax.vmap(one)(wraps, pose)


def reading(
    shape: BatchShape, belt: BeltArrays, places: Array, wraps: WrapArrays, tail_x: Array, share: Array
) -> Array:
    """y of points 1-4 [m], angles [rad], entry moments [N m], slack-edge stresses [Pa], tilts [rad], sags [m], tension
    [N]; shape (17,), in the order of recording.py. places [m], shape (m, 3, n)."""
    first, last, n = wraps.first, wraps.last, shape.stations
    zero = jnp.zeros_like(tail_x)
    points = ((first[TAIL], tail_x), (last[TAIL], tail_x), (first[HEAD], zero), (last[HEAD], zero))
    found = [_at_axis(shape, belt, places, station, x) for station, x in points]
    runups = (first[TAIL], first[HEAD]) if shape.sign > 0 else (last[HEAD], last[TAIL])
    begins = [s - RUNUP_LINKS - 1 if shape.sign > 0 else s + 1 for s in runups]
    forces = [_section_forces(shape, belt, places, s, share) for s in begins]
    edges = [t / belt.area - 6.0 * jnp.abs(m) / (belt.area * belt.width) for t, m in forces]
    # before the belt has gone round the numbers of the head's wrap lie below the tail's
    lower_head = first[HEAD] + n * jnp.rint((last[TAIL] - first[HEAD]) / n + 0.5).astype(int)
    middles = [((last[HEAD] + first[TAIL]) // 2) % n, ((last[TAIL] + lower_head) // 2) % n]
    across = [places[0, :, k] - places[-1, :, k] for k in middles]
    heights = [places[:, 2, k].mean() for k in middles]
    return jnp.stack(
        [
            *(y for y, _ in found),
            *(shape.sign * slope for _, slope in found),
            *(moment for _, moment in forces),
            *edges,
            *(jnp.arctan2(a[2], a[1]) for a in across),
            belt.level - heights[0],
            -belt.level - heights[1],
            forces[0][0],
        ]
    )


def _at_axis(shape: BatchShape, belt: BeltArrays, places: Array, station: Array, x: Array) -> tuple[Array, Array]:
    k = (station - AXIS_STATIONS + jnp.arange(2 * AXIS_STATIONS + 1)) % shape.stations
    centre = places[:, :, k].mean(axis=0)
    ahead = centre[0] - x
    crosses = ahead[1:-2] * ahead[2:-1] <= 0.0
    i = 1 + jnp.where(crosses.any(), jnp.argmax(crosses), AXIS_STATIONS - 1)
    share = ahead[i] / (ahead[i] - ahead[i + 1])
    y = centre[1, i] + share * (centre[1, i + 1] - centre[1, i])
    return y, (centre[1, i + 2] - centre[1, i - 1]) / (3.0 * belt.chord)


def _section_forces(
    shape: BatchShape, belt: BeltArrays, places: Array, first: Array, share: Array
) -> tuple[Array, Array]:
    k = (first + jnp.arange(RUNUP_LINKS + 1)) % shape.stations
    strain = strains(belt.ties, places, k, share)
    if shape.lines == 1:
        return belt.stiffness[0] * strain[0], jnp.zeros(())
    weight = belt.stiffness * belt.line_y
    return belt.stiffness @ strain, -belt.bending * (weight @ strain) / (weight @ belt.line_y)
