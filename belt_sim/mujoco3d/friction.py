"""Coulomb friction of landed nodes: sticking, or sliding with the force that friction leaves."""

import math
from dataclasses import dataclass, field

import numpy as np

from belt_sim.mujoco3d.hold import Pose, Wrap, cylinder_coordinates

_LANDING_STEPS = 2  # a station sticks, and so do its neighbours, while its landing jolts it


@dataclass
class Friction:
    """A return mapping on the holding force of every landed node.

    friction [1] (inf = sticking); hold_stiffness [N/m] of a sticking node, slip_stiffness [N/m] of a sliding one: the
    surplus drag of a node that slides at v is slip_stiffness dt v; slip [m]: lateral way the belt has slid on the head
    and the tail pulley, mean over the wrap.
    """

    friction: float
    hold_stiffness: float
    slip_stiffness: float
    slip: np.ndarray = field(default_factory=lambda: np.zeros(2))

    @property
    def sticks(self) -> bool:
        return math.isinf(self.friction)

    def apply(self, wrap: Wrap, pose: Pose, which: int, points, parts, surplus, stiffness) -> None:
        """Let nodes slide whose tangential force exceeds friction x pressure, and stick again when it falls below.

        points [m], shape (held, m, 3): where the nodes are; parts [N], same shape: the holding forces outwards,
        along the axis, along the turn; surplus [N]: what they carry beyond the true force; stiffness: view of the
        springs' stiffness, shape (n, m, 3). A sliding node is pushed by the pressure p of the last step and by
        friction p, on a soft spring from where it was: wrap.push.
        """
        k = wrap.stations
        held, parts = parts, parts - surplus
        pressure = np.maximum(parts[..., 0], 0.0)
        shear = np.hypot(parts[..., 1], parts[..., 2])
        wrap.held_for[k] += 1
        jolted = wrap.held_for[k] <= _LANDING_STEPS
        jolted[1:] |= jolted[:-1]
        jolted[:-1] |= jolted[1:]
        slides = (shear > self.friction * pressure) & ~jolted[:, None]
        slid = wrap.sliding[k]
        r, y, angle = cylinder_coordinates(points, pose)
        self.slip[which] += np.where(slid & slides, y - wrap.y[k], 0.0).mean()
        if not (slides.any() or slid.any()):
            return
        push = surplus.copy()
        push[..., 0] += pressure
        share = self.friction * pressure / np.maximum(shear, 1e-12)
        push[..., 1:] += parts[..., 1:] * share[..., None]
        stops = slid & ~slides
        touched = slides | slid
        holding = np.where(stops, self.hold_stiffness, self.slip_stiffness)
        place = [
            np.where(stops, r + held[..., 0] / holding, wrap.radius_at(y, angle)),
            np.where(stops, y + held[..., 1] / holding, y),
            np.where(stops, angle + held[..., 2] / (holding * r), angle),
        ]
        for anchors, new in zip((wrap.r, wrap.y, wrap.angle), place, strict=True):
            anchors[k] = np.where(touched, new, anchors[k])
        wrap.push[k] = np.where(slides[..., None], push / self.slip_stiffness, 0.0)
        wrap.sliding[k] = slides
        stiffness[k] = np.where(slides, self.slip_stiffness, self.hold_stiffness)[..., None]
