"""Edge guides in a run: rollers beside the spans that push the belt's edge back, and never pull."""

from dataclasses import dataclass, field

import numpy as np

from belt_sim.mujoco3d.contact import Contact
from belt_sim.scene_parts import EdgeGuide


@dataclass
class Guides:
    """Springs on the lateral slides of free nodes near a roller, in the solver's metric like those of landed ones.

    A roller takes hold of the stations within one chord of it, by a share that falls linearly with the distance, so
    that stations come and go without a jolt. pressed: stations that felt a roller in the last step.
    """

    guides: tuple[EdgeGuide, ...]
    contact: Contact
    pressed: np.ndarray = field(default_factory=lambda: np.empty(0, int))

    def apply(self) -> None:
        """Before a step: a node y beyond its place gets a spring that pushes the edge back to the roller's face."""
        if not self.guides:
            return
        contact, mesh = self.contact, self.contact.scene.mesh
        held = np.zeros(mesh.stations, bool)
        for wrap in contact.wraps:
            held[wrap.stations] = True
        contact.stiffness[self.pressed[~held[self.pressed]], :, 1] = 0.0
        places = (mesh.rest + contact.slides).mean(axis=1)
        stiffness, push = np.zeros((2, mesh.stations))
        for guide in self.guides:
            near = np.clip(1.0 - np.abs(places[:, 0] - guide.x) / mesh.chord, 0.0, 1.0)
            near[held | ((places[:, 2] > 0.0) != (guide.span == "upper"))] = 0.0
            beyond = guide.side * places[:, 1] - guide.gap
            stiff = guide.stiffness * near * (beyond > 0.0)
            stiffness += stiff
            push -= stiff * guide.side * beyond
        self.pressed = k = np.flatnonzero(stiffness)
        share = mesh.line_stiffness / mesh.line_stiffness.sum()
        contact.stiffness[k, :, 1] = stiffness[k, None] * share
        contact.spring[k, :, 1] = contact.slides[k, :, 1] + (push[k] / stiffness[k])[:, None]
