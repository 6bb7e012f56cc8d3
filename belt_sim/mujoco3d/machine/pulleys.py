"""The two pulleys: the head is driven, the tail is free on its slide and its axis, both are yawed as commanded."""

from dataclasses import dataclass

import numpy as np

from belt_sim.mujoco3d.constants import COMPLIANCE_TIME, TAIL_DAMPING_RATIO
from belt_sim.mujoco3d.machine.drive import Drive
from belt_sim.mujoco3d.machine.scene import HEAD_SPIN, HEAD_YAW, STATION_JOINTS, TAIL_SLIDE, TAIL_SPIN, TAIL_YAW, Scene
from belt_sim.mujoco3d.machine.yaw import smooth
from belt_sim.mujoco3d.mujoco_4 import Solver
from belt_sim.mujoco3d.state import TAIL, Pose, State


@dataclass(frozen=True)
class Pulleys:
    """MuJoCo integrates the tail pulley's slide and spin; the rest is commanded.

    sign: +1 or -1, direction of travel; load [N]: force on the slide; slide_mass [kg], spin_inertia [kg m2],
    slide_drag [N s/m], spin_drag [N m s]: of the tail pulley; fixed: its slide is (tensioning by length).
    """

    scene: Scene
    sign: float
    load: float
    slide_mass: float
    spin_inertia: float
    slide_drag: float
    spin_drag: float
    fixed: bool

    @staticmethod
    def of(scene: Scene, solver: Solver) -> "Pulleys":
        """With the inertia that the compiled pulleys have."""
        model, case = solver.model, scene.case
        tail_bodies = [model.body(f"tail-{name}").id for name in ("carriage", "fork", "pulley")]
        mass = float(model.body_mass[tail_bodies].sum())
        stiffness = 2.0 * scene.mesh.line_stiffness.sum() / float(case.rig.span_length)
        drag = 2.0 * TAIL_DAMPING_RATIO * (stiffness * mass) ** 0.5
        return Pulleys(
            scene=scene,
            sign=float(np.sign(float(case.settings.direction))),
            load=2.0 * float(case.tension_force),
            slide_mass=mass,
            spin_inertia=float(model.dof_armature[TAIL_SPIN] + model.body_inertia[tail_bodies[-1], 1]),
            slide_drag=drag,
            spin_drag=drag * scene.parts.tail.radius**2,
            fixed=scene.options.tensioning == "length",
        )

    def laid(self) -> tuple[Pose, Pose]:
        """Both aligned, and turned back by what comes before travel 0, so that they have turned by 0 there."""
        parts, turned = self.scene.parts, -self.sign * self.scene.early
        at = (np.zeros(3), np.array([self.scene.loop.centre_distance, 0.0, 0.0]))
        head, tail = (
            Pose(centre, surface.axes(0.0, 0.0, askew=0.0), turned / surface.radius)
            for centre, surface in zip(at, (parts.head, parts.tail), strict=True)
        )
        return head, tail

    def joints(self, poses: tuple[Pose, Pose]) -> np.ndarray:
        """Coordinates of aligned pulleys in these places, shape (5,)."""
        joints = np.zeros(STATION_JOINTS)
        joints[TAIL_SLIDE] = self.scene.loop.centre_distance - float(self.scene.case.rig.centre_distance)
        joints[HEAD_SPIN], joints[TAIL_SPIN] = (pose.spin for pose in poses)
        return joints

    def advance(self, state: State, drive: Drive, dt: float) -> np.ndarray:
        """Move the poses to where they will be at the end of the step, and say which forces bring the joints there.

        Returns forces [N or N m] on the joints, shape (5,); where a joint is commanded its rate is set instead.
        """
        (head, tail), rates, forces = state.poses, state.joint_rates, np.zeros(STATION_JOINTS)
        slide_speed = 0.0 if self.fixed else drive.slide_speed
        radius, spin = self.scene.parts.tail.radius, self.sign * drive.travel / self.scene.parts.head.radius
        rates[HEAD_SPIN] = (spin - head.spin) / dt
        head.spin = spin
        slide_force = self.load + state.loads[TAIL, 0] - self.slide_drag * rates[TAIL_SLIDE]
        rim = self.sign * (drive.speed - drive.acceleration * dt) + drive.lead
        spin_error = rates[TAIL_SPIN] - rim / radius
        driving = self.spin_inertia * self.sign * drive.acceleration / radius
        spin_moment = state.loads[TAIL, 1] + driving - self.spin_drag * spin_error
        if slide_speed is not None:
            slide_force, rates[TAIL_SLIDE] = 0.0, slide_speed
        forces[TAIL_SLIDE], forces[TAIL_SPIN] = slide_force, spin_moment
        tail.centre[0] += dt * (rates[TAIL_SLIDE] + dt * slide_force / self.slide_mass)
        tail.spin += dt * (rates[TAIL_SPIN] + dt * spin_moment / self.spin_inertia)
        self._turn(state, dt)
        return forces

    def _turn(self, state: State, dt: float) -> None:
        surfaces = (self.scene.parts.head, self.scene.parts.tail)
        compliance = np.array([surface.yaw_compliance for surface in surfaces])
        state.given_way += (compliance * state.loads[:, 2] - state.given_way) * min(dt / COMPLIANCE_TIME, 1.0)
        turned = state.yaw + state.given_way
        askew = smooth(state.time / max(0.5 * self.scene.options.settle, dt))
        for wrap, pose, surface, yaw in zip(state.wraps, state.poses, surfaces, turned, strict=True):
            level, pose.axes = pose.axes[2, 1], surface.axes(float(yaw), state.share, pose.spin, askew)
            if state.speed == 0.0 and state.travel >= 0.0:
                wrap.lay_anew(pose, pose.axes[2, 1] - level)
        state.joints[[HEAD_YAW, TAIL_YAW]] = turned
        state.joint_rates[[HEAD_YAW, TAIL_YAW]] = 0.0

    def read(self, state: State) -> None:
        """After a step: the tail pulley is where it was brought."""
        tail = state.poses[TAIL]
        tail.centre[0] = float(self.scene.case.rig.centre_distance) + state.joints[TAIL_SLIDE]
        tail.spin = float(state.joints[TAIL_SPIN])
