"""The two pulleys during a run: commanded yaw, driven head, tail pulley free on its slide and its axis."""

from dataclasses import dataclass

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.mujoco3d.machine.yaw import Clock, YawPlan, yaw_now
from belt_sim.mujoco3d.options import Options
from belt_sim.mujoco3d.scene import HEAD_SPIN, HEAD_YAW, TAIL_SLIDE, TAIL_SPIN, TAIL_YAW, Scene
from belt_sim.mujoco3d.wrap.hold import HEAD, TAIL, Pose

_DAMPING_RATIO = 1.0  # of the tail pulley against the stretch of both spans; it acts on deviations from steady motion
_COMPLIANCE_LAG = 0.02  # [s], of a pulley that gives way to the belt's moment


@dataclass
class Machine:
    """Pulley coordinates at the end of the coming step; MuJoCo integrates slide and tail spin, the rest is commanded.

    poses: head and tail; yaw [rad]: head, tail; given_way [rad]: yaw by compliance; load [N]: force on the slide;
    slide_mass [kg], spin_inertia [kg m2], slide_drag [N s/m], spin_drag [N m s]; slide_speed [m/s]: of a tail pulley
    that is moved, 0 = fixed; None when it follows the forces; lead [m/s]: how much faster than the belt the tail
    pulley's rim steadily goes, against which spin_drag works.
    """

    case: Case
    scene: Scene
    plans: tuple[YawPlan, YawPlan]
    poses: tuple[Pose, Pose]
    yaw: np.ndarray
    given_way: np.ndarray
    load: float
    slide_mass: float
    spin_inertia: float
    slide_drag: float
    spin_drag: float
    share: float = 0.0
    slide_speed: float | None = None
    lead: float = 0.0

    @staticmethod
    def begin(case: Case, scene: Scene, options: Options) -> "Machine":
        """Both pulleys aligned, turned back by what comes before travel 0, so that they have turned by 0 there."""
        settings, mesh = case.settings, scene.mesh
        turned = -float(settings.direction) * scene.early
        parts = scene.parts
        poses = (
            Pose(np.zeros(3), parts.head.axes(0.0, 0.0), turned / parts.head.radius),
            Pose(
                np.array([scene.loop.centre_distance, 0.0, 0.0]),
                parts.tail.axes(0.0, 0.0),
                turned / parts.tail.radius,
            ),
        )
        model = scene.model
        tail_bodies = [model.body(f"tail-{name}").id for name in ("carriage", "fork", "pulley")]
        mass = float(model.body_mass[tail_bodies].sum())
        inertia = float(model.dof_armature[TAIL_SPIN] + model.body_inertia[tail_bodies[-1], 1])
        stiffness = 2.0 * mesh.line_stiffness.sum() / float(case.rig.span_length)
        drag = 2.0 * _DAMPING_RATIO * (stiffness * mass) ** 0.5
        return Machine(
            case=case,
            scene=scene,
            plans=(YawPlan(settings.yaw_head), YawPlan(settings.yaw)),
            poses=poses,
            yaw=np.zeros(2),
            given_way=np.zeros(2),
            load=2.0 * float(case.tension_force),
            slide_mass=mass,
            spin_inertia=inertia,
            slide_drag=drag,
            spin_drag=drag * parts.tail.radius**2,
        )

    def stops(self, until: float) -> list[float]:
        """Travels at which the belt stands still for a yaw step [m]."""
        parts = self.scene.parts
        changes = any(s.yaw_offset or s.cant for s in (parts.head, parts.tail)) or parts.camber is not None
        return sorted({s for plan in self.plans for s in plan.stops(until)} | ({0.0} if changes else set()))

    def put(self, data: mujoco.MjData) -> None:
        """Write the pulleys' coordinates into MuJoCo's state."""
        data.qpos[[HEAD_YAW, TAIL_YAW]] = self.yaw
        data.qpos[HEAD_SPIN], data.qpos[TAIL_SPIN] = (pose.spin for pose in self.poses)

    def command(self, clock: Clock) -> None:
        """Yaw for the coming step; yaw offsets, cants and camber come in while the belt stands at travel 0."""
        starting = clock.paused_since is not None and clock.done < 0.0
        self.share = 0.0 if clock.travel < 0.0 else clock.step_share() if starting else 1.0
        self.yaw[:] = [yaw_now(plan, clock) for plan in self.plans]

    def before(
        self, data: mujoco.MjData, loads, head_spin: float, speed: float, acceleration: float, dt: float
    ) -> None:
        """Move the poses to the end of the coming step and set what MuJoCo needs to get there.

        loads: force along x, moment about the axis and about z that the belt does to each pulley; head_spin [rad] at
        the end of the step; speed, acceleration of the belt along the direction of travel.
        """
        head, tail = self.poses
        sign = float(self.case.settings.direction)
        radius = tail.axes is not None and self.scene.parts.tail.radius
        data.qvel[HEAD_SPIN] = (head_spin - head.spin) / dt
        head.spin = head_spin
        slide_force = self.load + loads[TAIL][0] - self.slide_drag * data.qvel[TAIL_SLIDE]
        spin_error = data.qvel[TAIL_SPIN] - (sign * (speed - acceleration * dt) + self.lead) / radius
        spin_moment = loads[TAIL][1] + self.spin_inertia * sign * acceleration / radius - self.spin_drag * spin_error
        if self.slide_speed is not None:
            slide_force, data.qvel[TAIL_SLIDE] = 0.0, self.slide_speed
        data.qfrc_applied[TAIL_SLIDE], data.qfrc_applied[TAIL_SPIN] = slide_force, spin_moment
        tail.centre[0] += dt * (data.qvel[TAIL_SLIDE] + dt * slide_force / self.slide_mass)
        tail.spin += dt * (data.qvel[TAIL_SPIN] + dt * spin_moment / self.spin_inertia)
        self._turn(data, loads, dt)

    def _turn(self, data: mujoco.MjData, loads, dt: float) -> None:
        parts = self.scene.parts
        compliance = np.array([parts.head.yaw_compliance, parts.tail.yaw_compliance])
        moments = np.array([loads[HEAD][2], loads[TAIL][2]])
        self.given_way += (compliance * moments - self.given_way) * min(dt / _COMPLIANCE_LAG, 1.0)
        turned = self.yaw + self.given_way
        for pose, surface, yaw in zip(self.poses, (parts.head, parts.tail), turned, strict=True):
            pose.axes = surface.axes(float(yaw), self.share)
        data.qpos[HEAD_YAW], data.qpos[TAIL_YAW] = turned
        data.qvel[[HEAD_YAW, TAIL_YAW]] = 0.0
        self.scene.model.eq_data[0, 0] = turned[HEAD]

    def read(self, data: mujoco.MjData) -> None:
        """Take over what MuJoCo integrated: the tail pulley's slide and spin."""
        tail = self.poses[TAIL]
        tail.centre[0] = float(self.case.rig.centre_distance) + data.qpos[TAIL_SLIDE]
        tail.spin = float(data.qpos[TAIL_SPIN])
