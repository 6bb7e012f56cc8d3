"""Edge guides: rollers beside the spans that push the belt's edge back, and never pull."""

from dataclasses import dataclass

import numpy as np

from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.mujoco_4 import Springs
from belt_sim.mujoco3d.state import State
from belt_sim.scene_parts import EdgeGuide


@dataclass(frozen=True)
class Guides:
    """Springs on the lateral slides of free nodes near a roller, in the solver's metric like those of landed ones.

    A roller takes hold of the stations within one chord of it, by a share that falls linearly with the distance, so
    that stations come and go without a jolt.
    """

    guides: tuple[EdgeGuide, ...]
    mesh: Mesh

    def press(self, state: State, springs: Springs) -> None:
        """A free node y beyond its place gets a spring that pushes the edge back to the roller's face."""
        if not self.guides:
            return
        mesh = self.mesh
        held = np.zeros(mesh.stations, bool)
        for wrap in state.wraps:
            held[wrap.stations] = True
        places = (mesh.rest + state.slides).mean(axis=1)
        stiffness, push = np.zeros((2, mesh.stations))
        for guide in self.guides:
            near = np.clip(1.0 - np.abs(places[:, 0] - guide.x) / mesh.chord, 0.0, 1.0)
            near[held | ((places[:, 2] > 0.0) != (guide.span == "upper"))] = 0.0
            beyond = guide.side * places[:, 1] - guide.gap
            stiff = guide.stiffness * near * (beyond > 0.0)
            stiffness += stiff
            push -= stiff * guide.side * beyond
        k = np.flatnonzero(stiffness)
        springs.stiffness[k, :, 1] = stiffness[k, None] * (mesh.line_stiffness / mesh.line_stiffness.sum())
        springs.rest[k, :, 1] = state.slides[k, :, 1] + (push[k] / stiffness[k])[:, None]
