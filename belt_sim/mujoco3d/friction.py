"""Coulomb friction of landed nodes: sticking, or a return mapping on the holding force."""

import math
from dataclasses import dataclass, field

import numpy as np

from belt_sim.mujoco3d.hold import Pose, Wrap, cylinder_coordinates


@dataclass
class Friction:
    """friction [1] (inf = sticking); hold_stiffness, slip_stiffness [N/m]; slip [m]: summed lateral slip per pulley."""

    friction: float
    hold_stiffness: float
    slip_stiffness: float
    slip: np.ndarray = field(default_factory=lambda: np.zeros(2))

    def apply(self, which: int, contact, wrap: Wrap, pose: Pose, force: np.ndarray, normals: np.ndarray) -> None:
        """Nodes whose tangential force exceeds friction x pressure slide on with that force; others stick."""
        if math.isinf(self.friction):
            return
        raise NotImplementedError
