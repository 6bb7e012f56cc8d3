"""Forces and couples at places of the spans: skewed idlers, scrapers."""

from dataclasses import dataclass

import numpy as np

from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.mujoco_4 import Springs
from belt_sim.mujoco3d.state import State
from belt_sim.scene_parts import Push


@dataclass(frozen=True)
class Pushes:
    """Stations within one chord of a place take its load, by a share that falls linearly with the distance."""

    pushes: tuple[Push, ...]
    mesh: Mesh

    def forces(self, state: State, springs: Springs) -> np.ndarray:
        """Forces over the lines as the belt's stiffness is, couples as forces along the belt that grow with y."""
        mesh, forces = self.mesh, np.zeros_like(state.slides)
        middle = (mesh.rest + state.slides).mean(axis=1)
        line = mesh.line_stiffness / mesh.line_stiffness.sum()
        arm = line * mesh.line_y / max(float(line @ mesh.line_y**2), 1e-12)
        ahead = np.roll(middle, -1, axis=0) - np.roll(middle, 1, axis=0)
        ahead *= np.sign(ahead[:, :1]) / np.linalg.norm(ahead, axis=1)[:, None]
        for push in self.pushes:
            near = np.clip(1.0 - np.abs(middle[:, 0] - push.x) / mesh.chord, 0.0, 1.0)
            near[(middle[:, 2] > 0.0) != (push.span == "upper")] = 0.0
            near *= state.share / near.sum()
            forces[..., 1] += near[:, None] * (push.across * line)
            forces += near[:, None, None] * (push.along * line - push.couple * arm)[:, None] * ahead[:, None]
        return forces
