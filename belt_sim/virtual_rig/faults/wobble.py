"""The tail pulley sits askew on its shaft: its axis describes a cone of half angle beta_1 about the bearings' axis.

Put the cylinder's axis through the pulley's middle, turned from the shaft's by beta_1 towards the material angle q
(from the shaft's +y, seen along it). A generator at the material angle a then stands R + beta_1 y cos(a - q) from the
shaft. Where the belt runs up, a falls by s/R; the belt beside, y further out, is wound up on that much more radius and
gets ahead: per metre it turns back by the radius's slope over R. Nothing else happens: the surface turns in itself.

Before travel 0 the belt ran straight round the cylinder, that is along the shaft's wave.
"""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import TAIL, Fault, Size


@dataclass(frozen=True, kw_only=True)
class Wobble(Fault):
    """Seen from above the axis swings by beta_1 cos(s/R + phase): the slope of the radius is a quarter turn late."""

    id = "wobble"
    sizes = {"beta_1": Size(unit="rad", typical=1e-3, limit=2e-3)}
    lot = 6
    beta_1: float = 0.0
    phase: float = 0.0

    def turn(self, s, line, y, kappa):
        slope = self.beta_1 * np.cos(s / line.tail_radius + self.phase - np.pi / 2)
        return slope / line.tail_radius * TAIL

    def before(self, s, line):
        """What has the slope -y'' = turn and no more: y' = -alpha."""
        at = s / line.tail_radius + self.phase
        none = 0.0 * at
        return np.stack([-self.beta_1 * line.tail_radius * np.sin(at), self.beta_1 * np.cos(at), none, none])

    def scene(self, parts, case):
        """The scene counts the pulley's turn from head to tail on top, the fault along the travel."""
        phase = self.phase * float(case.settings.direction)
        return parts.with_pulley("tail", wobble=self.beta_1, wobble_phase=phase) if self.beta_1 else parts

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"phase": float(rng.uniform(0.0, 2 * np.pi))}

    @classmethod
    def shapes(cls, plan):
        return {"phase": 0.0}, {"phase": np.pi / 2}
