"""Landed stations are held on the pulleys by stiff springs in the solver's metric, instead of contacts.

Every node rides on three slides. While its station lies on a pulley, the slides' springs (jnt_stiffness) hold it at
an anchor that turns with the pulley (qpos_spring). Under MuJoCo's discrete integrator a joint spring is implicit, so
it may be as stiff as 1e13 N/m: no penetration, no creep, no chatter, no cone.
"""

from dataclasses import dataclass, field

import numpy as np

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
    shape (n, m), valid for held stations only; lifted [m], shape (n,): how much higher than touchdown.py's path a
    station has been caught; tangent [rad], shape (2,): where the belt meets the pulley, at ``first`` and at ``last``,
    from the top towards +x and not turning; way [m], shape (n, m, 2): how far the nodes slid in the
    last step, along the axis, along the turn.
    """

    surface: PulleySurface
    extra_radius: float
    first: int
    last: int
    r: np.ndarray
    y: np.ndarray
    angle: np.ndarray
    lifted: np.ndarray
    tangent: np.ndarray
    way: np.ndarray
    stations: np.ndarray = field(default_factory=lambda: np.empty(0, int))

    @staticmethod
    def empty(surface: PulleySurface, extra_radius: float, n: int, m: int) -> "Wrap":
        """extra_radius [m]: how much wider the circle of the stations is than the pulley."""
        r, y, angle = np.zeros((3, n, m))
        return Wrap(surface, extra_radius, 0, -1, r, y, angle, np.zeros(n), np.zeros(2), np.zeros((n, m, 2)))

    def renumber(self) -> None:
        """Recompute ``stations`` after first or last changed."""
        self.stations = np.arange(self.first, self.last + 1) % self.r.shape[0]

    def radius_at(self, y, angle):
        """Radius of a station's circle [m] at y [m] and material angle [rad]."""
        return self.surface.radius_at(y, angle) + self.extra_radius

    def place(self, pose: Pose) -> np.ndarray:
        """World positions of the held nodes' anchors [m], shape (held, m, 3)."""
        k = self.stations
        turned = self.angle[k] + pose.spin
        local = np.stack([self.r[k] * np.sin(turned), self.y[k], self.r[k] * np.cos(turned)], axis=-1)
        return local @ pose.axes.T + pose.centre

    @property
    def sliding(self) -> np.ndarray:
        """Which held nodes slid in the last step, shape (held, m)."""
        return self.way[self.stations].any(axis=-1)

    def slide(self, way: np.ndarray) -> None:
        """Move the held nodes' anchors on the surface by ``way`` [m], shape (held, m, 2)."""
        k = self.stations
        self.way[k] = way
        before = self.radius_at(self.y[k], self.angle[k])
        self.y[k] += way[..., 0]
        self.angle[k] += way[..., 1] / self.r[k]
        self.r[k] += self.radius_at(self.y[k], self.angle[k]) - before

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
