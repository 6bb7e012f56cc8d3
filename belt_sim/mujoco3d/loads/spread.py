"""Loads all along: the weight of a belt whose machine leans, a couple that rolls the upper span."""

from dataclasses import dataclass

import numpy as np

from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.mujoco_4 import Springs
from belt_sim.mujoco3d.state import State


@dataclass(frozen=True)
class Spread:
    """across [m/s2]: pull of the weight towards +y, on all nodes, of which the pulleys hold those that lie on them;
    roll [N]: couple per metre about +x on what is above the axes."""

    across: float
    roll: float
    mesh: Mesh

    def forces(self, state: State, springs: Springs) -> np.ndarray:
        """The couple as vertical forces on the outer lines."""
        mesh, forces = self.mesh, np.zeros_like(state.slides)
        forces[..., 1] = state.share * self.across * mesh.mass
        if self.roll:
            upper = (mesh.rest + state.slides)[..., 2].mean(axis=1) > 0.0
            lift = state.share * self.roll * mesh.chord / float(mesh.line_y[0] - mesh.line_y[-1])
            forces[upper, 0, 2] += lift
            forces[upper, -1, 2] -= lift
        return forces
