"""What a step of a run reads and writes: where the pulleys are, what is held on them, the whole.

Landed stations are held on the pulleys by stiff springs in the solver's metric, instead of contacts. Every node rides
on three slides. While its station lies on a pulley, springs on the slides hold it at an anchor that turns with the
pulley. Under MuJoCo's discrete integrator a joint spring is implicit, so it may be as stiff as 1e13 N/m: no
penetration, no creep, no chatter, no cone.
"""

from dataclasses import dataclass, field

import numpy as np

from belt_sim.mujoco3d.mujoco_4 import Motion
from belt_sim.scene_parts import PulleySurface

HEAD, TAIL = 0, 1


@dataclass
class Pose:
    """Where a pulley is: centre [m], shape (3,); axes, shape (3, 3), pulley frame to world; spin [rad]."""

    centre: np.ndarray
    axes: np.ndarray
    spin: float


@dataclass
class Wrap:
    """The stations that lie on one pulley: consecutive numbers first..last (modulo n), and their anchors.

    anchors are cylinder coordinates in the spinning pulley: r, y [m] and angle [rad] from the top towards +x,
    shape (n, m), valid for held stations only; lifted [m], shape (n,): how much higher than the path of touchdown.py a
    station has been caught; tangent [rad], shape (2,): where the belt meets the pulley, at ``first`` and at ``last``,
    from the top towards +x and not turning; slip_increment [m], shape (n, m, 2): how far the nodes slid in the last
    step, along the axis, along the turn; followed [rad]: spin of the pulley that the anchors were last put on;
    layer [m], shape (2, m, 2): how far outwards and into the pulley the bending layer displaces the lines of nodes
    where the belt meets the pulley, at ``first`` and at ``last`` (wrap.py); the anchors are those without it.
    """

    surface: PulleySurface
    extra_radius: float
    first: int
    last: int
    r: np.ndarray
    y: np.ndarray
    angle: np.ndarray
    landing_lift: np.ndarray
    tangent: np.ndarray
    slip_increment: np.ndarray
    anchored_spin: float
    layer: np.ndarray
    stations: np.ndarray = field(default_factory=lambda: np.empty(0, int))

    @staticmethod
    def empty(surface: PulleySurface, extra_radius: float, n: int, m: int, spin: float = 0.0) -> "Wrap":
        """extra_radius [m]: how much wider the circle of the stations is than the pulley; spin [rad]: of the pulley."""
        r, y, angle = np.zeros((3, n, m))
        slip, layer = np.zeros((n, m, 2)), np.zeros((2, m, 2))
        return Wrap(surface, extra_radius, 0, -1, r, y, angle, np.zeros(n), np.zeros(2), slip, spin, layer)

    def renumber(self) -> None:
        """Recompute ``stations`` after first or last changed."""
        self.stations = np.arange(self.first, self.last + 1) % self.r.shape[0]

    def radius_at(self, y):
        """Radius of a station's circle [m] at y [m]."""
        return self.surface.radius_at(y) + self.extra_radius

    def place(self, pose: Pose) -> np.ndarray:
        """World positions of the held nodes' anchors [m], shape (held, m, 3)."""
        k = self.stations
        turned = self.angle[k] + pose.spin
        local = np.stack([self.r[k] * np.sin(turned), self.y[k], self.r[k] * np.cos(turned)], axis=-1)
        return local @ pose.axes.T + pose.centre

    def lay_anew(self, pose: Pose, rolled: float) -> None:
        """The axis has rolled by a small angle [rad] under a belt at rest, which does not go with it: where a cant
        begins to act, the belt has been laid straight on the canted pulley."""
        k = self.stations
        before = self.radius_at(self.y[k])
        self.y[k] += rolled * self.r[k] * np.cos(self.angle[k] + pose.spin)
        self.r[k] += self.radius_at(self.y[k]) - before

    @property
    def sliding(self) -> np.ndarray:
        """Which held nodes slid in the last step, shape (held, m)."""
        return self.slip_increment[self.stations].any(axis=-1)

    def slip(self, increment: np.ndarray) -> None:
        """Move the held nodes' anchors on the surface by a slip increment [m], shape (held, m, 2)."""
        k = self.stations
        self.slip_increment[k] = increment
        before = self.radius_at(self.y[k])
        self.y[k] += increment[..., 0]
        self.angle[k] += increment[..., 1] / self.r[k]
        self.r[k] += self.radius_at(self.y[k]) - before

    def components(self, pose: Pose, vectors: np.ndarray) -> np.ndarray:
        """Parts of world vectors at the held anchors: outwards, along the axis, along the turn; shape (held, m, 3)."""
        turned = self.angle[self.stations] + pose.spin
        sin, cos = np.sin(turned), np.cos(turned)
        local = vectors @ pose.axes
        x, z = local[..., 0], local[..., 2]
        return np.stack([x * sin + z * cos, local[..., 1], x * cos - z * sin], axis=-1)


def cylinder_coordinates(points: np.ndarray, pose: Pose) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """r, y [m] and material angle [rad] of world points, shape (..., 3), in the spinning pulley."""
    local = (points - pose.centre) @ pose.axes
    return (
        np.hypot(local[..., 0], local[..., 2]),
        local[..., 1],
        np.arctan2(local[..., 0], local[..., 2]) - pose.spin,
    )


@dataclass
class RunState(Motion):
    """The belt and the machine at one instant; of arrays of two the first is the head pulley's.

    joints, joint_rates: of the pulleys, in the order of scene.HEAD_YAW ..., as MuJoCo integrates them;
    poses: where the pulleys carry the belt; wraps: the stations on them;
    loads, shape (2, 3): force along x [N], moment about the axis and about z [N m] that the belt does to a pulley;
    yaw [rad], shape (2,): commanded; given_way [rad], shape (2,): yaw by compliance; share: how much of yaw offsets,
    cants and camber acts; slip [m], shape (2,): how far the belt has slid sideways, mean over the wrap;
    waits: the pulley on which the belt did not slide in the last step, because both take turns (-1 = neither);
    led, kink_slope: of a limp belt (rope.py), stations at the run-offs when they were last put on their lines,
    and slope of y there counted against the travel, shape (2, m); met, turned, aside: of a limp belt at its run-ups,
    outermost stations and yaw [rad] of the last step, and how much further than the span the pulley has taken the
    station [m], shape (2,);
    time [s]; travel [m], speed [m/s]: of the belt.
    """

    poses: tuple[Pose, Pose]
    wraps: tuple[Wrap, Wrap]
    travel: float
    loads: np.ndarray = field(default_factory=lambda: np.zeros((2, 3)))
    yaw: np.ndarray = field(default_factory=lambda: np.zeros(2))
    compliance_yaw: np.ndarray = field(default_factory=lambda: np.zeros(2))
    slip: np.ndarray = field(default_factory=lambda: np.zeros(2))
    run_off_stations: list[int] = field(default_factory=list)
    kink_slope: np.ndarray = field(default_factory=lambda: np.zeros((2, 1)))
    run_up_stations: list[int] = field(default_factory=list)
    run_up_yaw: np.ndarray = field(default_factory=lambda: np.zeros(2))
    run_up_offset: np.ndarray = field(default_factory=lambda: np.zeros(2))
    share: float = 0.0
    waiting_pulley: int = -1
    speed: float = 0.0
    time: float = 0.0
