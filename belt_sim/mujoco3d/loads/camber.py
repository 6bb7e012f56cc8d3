"""Camber in a run: the belt is straight until travel 0, and curved by nature from then on."""

from dataclasses import dataclass

import numpy as np

from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.scene import Scene


@dataclass(frozen=True)
class Camber:
    """lengths: view of the model's rest lengths [m]; straight, natural: their values without and with camber."""

    lengths: np.ndarray
    straight: np.ndarray
    natural: np.ndarray

    @staticmethod
    def of(scene: Scene) -> "Camber | None":
        """None for a belt without camber."""
        if scene.parts.camber is None:
            return None
        model = scene.model
        if model.nflexedge:
            straight = _straight(scene.mesh, model.flex_edge)
            return Camber(model.flexedge_length0, straight, model.flexedge_length0.copy())
        ends = model.site_bodyid[model.wrap_objid].reshape(-1, 2) - model.body("node-0-0").id
        straight = np.repeat(_straight(scene.mesh, ends)[:, None], 2, axis=1)
        return Camber(model.tendon_lengthspring, straight, model.tendon_lengthspring.copy())

    def act(self, share: float) -> None:
        """Let ``share`` (0..1) of the camber act."""
        self.lengths[:] = self.straight + share * (self.natural - self.straight)


def _straight(mesh: Mesh, nodes: np.ndarray) -> np.ndarray:
    """Distances [m] of pairs of neighbouring nodes, shape (k, 2), in the straight stress-free belt."""
    stations, line = np.divmod(nodes, mesh.across)
    along = mesh.chord * (stations[:, 0] != stations[:, 1])
    return np.hypot(along, np.diff(mesh.line_y[line], axis=1)[:, 0])
