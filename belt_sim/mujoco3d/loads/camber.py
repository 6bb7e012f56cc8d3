"""Camber in a run: the belt is straight until travel 0, and curved by nature from then on."""

from dataclasses import dataclass

import numpy as np

from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.mujoco_4 import Solver


@dataclass(frozen=True)
class Camber:
    """straight, natural [m], shape (k,): the belt's rest lengths without and with camber."""

    straight: np.ndarray
    natural: np.ndarray

    @staticmethod
    def of(mesh: Mesh, solver: Solver) -> "Camber":
        """Of a model that was compiled with its camber."""
        stations, line = np.divmod(solver.tied_nodes(), mesh.across)
        along = mesh.chord * (stations[:, 0] != stations[:, 1])
        straight = np.hypot(along, np.diff(mesh.line_y[line], axis=1)[:, 0])
        return Camber(straight, solver.rest_lengths)

    def lengths(self, share: float) -> np.ndarray:
        """Rest lengths [m] when ``share`` (0..1) of the camber acts, shape (k,)."""
        return self.straight + share * (self.natural - self.straight)
