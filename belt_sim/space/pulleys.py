"""The pulleys: where they are, how they are driven, and how the belt loads them."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from belt_sim.case import Numbers as Array
from belt_sim.jax_setup import jit_float64
from belt_sim.space.belt import BeltArrays
from belt_sim.space.machine import HEAD_SPIN, HEAD_YAW, STATION_JOINTS, TAIL_SLIDE, TAIL_SPIN, TAIL_YAW, SceneLayout
from belt_sim.space.options import COMPLIANCE_TIME, TAIL_DAMPING_RATIO
from belt_sim.space.run import Command
from belt_sim.space.wrap import (
    HEAD,
    TAIL,
    BeltOnPulley,
    PoseArrays,
    WrapArrays,
    axes_of,
    cylinder_coordinates,
    land_stations,
    radius_at,
    release_stations,
    update_tangents,
)


def laid_poses(scene: SceneLayout) -> PoseArrays:
    """Both pulleys aligned, and turned back by what comes before travel 0, so that they have turned by 0 there."""
    sign, radius = (
        float(np.sign(float(scene.case.settings.direction))),
        [scene.parts.head.radius, scene.parts.tail.radius],
    )
    centre = np.array([[0.0, 0.0, 0.0], [scene.loop.centre_distance, 0.0, 0.0]])
    return PoseArrays(centre, np.stack([np.eye(3)] * 2), -sign * scene.early / np.array(radius), np.zeros(2))


def lay_pulleys(scene: SceneLayout, belt: BeltArrays) -> BeltOnPulley:
    """The belt laid round head and tail at rest, before its run-in; the pulleys are plain cylinders so far."""
    mesh, ends = scene.mesh, []
    for laid in (scene.loop.on_head, scene.loop.on_tail):
        on = np.flatnonzero(laid)
        jump = np.flatnonzero(np.diff(on) > 1)  # where the numbers begin anew on the pulley
        ends.append((on[jump[0] + 1] - mesh.stations, on[jump[0]]) if len(jump) else (on[0], on[-1]))
    (first, last), (r, y, angle) = np.array(ends).T, np.zeros((3, 2, mesh.lines, mesh.stations))
    wraps = WrapArrays(first, last, r, y, angle, np.zeros((2, mesh.stations)), np.zeros((2, 2)))
    layer = None if belt.fibres is None else np.zeros((2, 2, mesh.lines, 2))
    pulleys = BeltOnPulley(wraps, belt.surfaces, laid_poses(scene), layer)
    return jax.tree.map(np.asarray, _anchor_laid(belt, pulleys, np.moveaxis(mesh.laid, 0, -1)))


@jit_float64
def _anchor_laid(belt: BeltArrays, pulleys: BeltOnPulley, nodes: Array) -> BeltOnPulley:
    """With the stations anchored where their nodes are, at their mean height, then landed or released."""

    def anchor(pulley: BeltOnPulley) -> WrapArrays:
        r, y, angle = cylinder_coordinates(nodes, pulley.pose)
        circle = radius_at(pulley.surface, 0.0, y)
        wrap = pulley.wrap._replace(r=circle + (r - circle).mean(axis=0), y=y, angle=angle)
        return update_tangents(wrap, pulley.pose, nodes, 1.0)

    pulleys = pulleys._replace(wrap=jax.vmap(anchor)(pulleys))
    return release_stations(belt, land_stations(belt, pulleys, (pulleys.pose, nodes), nodes, 0.0, 0.0))


def pose_of(
    belt: BeltArrays, command: Command, tail: Array, turned: Array | None = None, askew: Array | float = 1.0
) -> PoseArrays:
    """Where the pulleys are, with the tail pulley at x [m] and spin [rad] ``tail``.

    turned [rad], (2,): yaw by which they give way; askew [1]: share of the wobble.
    """
    rolled = belt.shape.sign * command.travel / belt.surfaces.radius
    yaw = command.yaw if turned is None else command.yaw + turned
    axes = jax.vmap(axes_of, in_axes=(0, 0, None, 0, None))(belt.surfaces, yaw, command.share, rolled, askew)
    centre, spin = jnp.zeros((2, 3)).at[TAIL, 0].set(tail[0]), jnp.stack([rolled[HEAD], tail[1]])
    return PoseArrays(centre, axes, spin, command.share * belt.surfaces.bow)


def belt_loads(pulleys: BeltOnPulley, nodes: Array, pull: Array) -> Array:
    """Force along x [N], moment about the axis and about z [N m] that the belt does to head and tail, (2, 3).

    nodes [m], pull [N], (m, 3, n): of belt and weight.
    """
    n = nodes.shape[-1]

    def of_one(pulley: BeltOnPulley) -> Array:
        wrap, _, pose, _ = pulley
        held = (np.arange(n) - wrap.first) % n <= (wrap.last - wrap.first) % n
        arms, forces = nodes - pose.centre[:, None], jnp.where(held, pull, 0.0)
        t = jnp.einsum("mik,mjk->ij", arms, forces)
        moment = jnp.stack([t[1, 2] - t[2, 1], t[2, 0] - t[0, 2], t[0, 1] - t[1, 0]])
        return jnp.stack([forces[:, 0].sum(), moment @ pose.axes[:, 1], moment[2]])

    return jax.vmap(of_one)(pulleys)


class TailPulley(NamedTuple):
    """The tail pulley: mass [kg] on its slide, inertia [kg m2] about its axis, drags [N s/m], [N m s] on deviations
    from steady motion, radius [m], x [m] of its slide's zero."""

    mass: Array
    inertia: Array
    slide_drag: Array
    spin_drag: Array
    radius: Array
    x: Array

    @staticmethod
    def from_scene(scene: SceneLayout, model: mujoco.MjModel, masses: np.ndarray, armature: np.ndarray) -> "TailPulley":
        """With the inertia that the compiled pulleys have; masses [kg]: of the bodies; armature: of the joints."""
        bodies = [model.body(f"tail-{name}").id for name in ("carriage", "fork", "pulley")]
        mass, radius = float(masses[bodies].sum()), scene.parts.tail.radius
        stiffness = 2.0 * scene.mesh.line_stiffness.sum() / float(scene.case.rig.span_length)
        drag = 2.0 * TAIL_DAMPING_RATIO * (stiffness * mass) ** 0.5
        inertia = float(armature[TAIL_SPIN] + model.body_inertia[bodies[-1], 1])
        return TailPulley(mass, inertia, drag, drag * radius**2, radius, float(scene.case.rig.centre_distance))

    def forces(
        self, belt: BeltArrays, on_tail: Array, rates: Array, command: Command, dt: Array
    ) -> tuple[Array, Array]:
        """Force [N] on the slide and moment [N m] about the axis; the rim is to go steadily with the belt.

        on_tail: force [N] and moment [N m] by the belt; rates [m/s], [rad/s]: of slide and spin.
        """
        rim = belt.shape.sign * (command.speed - command.acceleration * dt)
        slide = belt.load + on_tail[0] - self.slide_drag * rates[0]
        moment = on_tail[1] + self.inertia * belt.shape.sign * command.acceleration / self.radius
        return (1.0 - belt.slide_fixed) * slide, moment - self.spin_drag * (rates[1] - rim / self.radius)

    def advance(
        self, belt: BeltArrays, joints: Array, loads: Array, turned: Array | None, command: Command, dt: Array,
        actuators: Array | float = 0.0,
    ) -> tuple[Array, Array, Array | None]:  # fmt: skip
        """Joints [rad, m] of both pulleys, their rates and forces on them [N m, N] in the coming step, (3, 5); x [m]
        and spin [rad] of the tail pulley at its end; yaw [rad] by which the pulleys then give way, None = they do not.

        joints, (2, 5): and rates, before; loads: of ``belt_loads``; turned: yaw by which they have given way;
        actuators: forces that act besides, (5,). Slide and spin of the tail are integrated; the rest is commanded, and
        the rate of a commanded joint is set instead.
        """
        q, v = joints
        if turned is not None:  # it follows the belt's moment on a pulley
            turned += (belt.surfaces.yaw_compliance * loads[:, 2] - turned) * jnp.minimum(dt / COMPLIANCE_TIME, 1.0)
        yaw = command.yaw if turned is None else command.yaw + turned
        slide, moment = self.forces(belt, loads[TAIL], (v[TAIL_SLIDE], v[TAIL_SPIN]), command, dt)
        on_joints = actuators + jnp.zeros(STATION_JOINTS).at[TAIL_SLIDE].set(slide).at[TAIL_SPIN].set(moment)
        loose = 1.0 - belt.slide_fixed
        sliding = loose * v[TAIL_SLIDE]
        spin = belt.shape.sign * command.travel / belt.surfaces.radius[HEAD]
        rates = jnp.zeros(STATION_JOINTS).at[HEAD_SPIN].set((spin - q[HEAD_SPIN]) / dt)
        rates = rates.at[TAIL_SLIDE].set(sliding).at[TAIL_SPIN].set(v[TAIL_SPIN])
        x = self.x + q[TAIL_SLIDE] + dt * (sliding + loose * dt * on_joints[TAIL_SLIDE] / self.mass)
        turns = q[TAIL_SPIN] + dt * (v[TAIL_SPIN] + dt * on_joints[TAIL_SPIN] / self.inertia)
        q = q.at[HEAD_YAW].set(yaw[HEAD]).at[TAIL_YAW].set(yaw[TAIL])
        return jnp.stack([q, rates, on_joints]), jnp.stack([x, turns]), turned
