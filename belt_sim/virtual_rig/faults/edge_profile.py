"""The belt's edge is not straight: y + e(m) - e(m when the yaw was applied), m the part of the belt.

e = sum over k of (cosk cos + sink sin)(2 pi k m / belt length), m counted backwards from what was at point 4 at
travel 0. The last term: y = 0 is where the point was when the yaw was applied.
"""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class EdgeProfile(Fault):
    id = "edge_profile"
    sizes = {f"{kind}{k}": Size(unit="m", typical=2e-4 / k, limit=1e-2) for k in (1, 2, 3) for kind in ("cos", "sin")}
    lot = 14
    mixed = True
    cos1: float = 0.0
    sin1: float = 0.0
    cos2: float = 0.0
    sin2: float = 0.0
    cos3: float = 0.0
    sin3: float = 0.0

    def read(self, value, place, s, line):
        if not place.startswith("point_"):
            return value
        return value + self._edge(place, s, line) - self._edge(place, line.yaw_at + 0 * s, line)

    def _edge(self, place, s, line):
        phase = -2 * np.pi * line.passing(place, s) / line.belt_length
        return sum(
            getattr(self, f"cos{k}") * np.cos(k * phase) + getattr(self, f"sin{k}") * np.sin(k * phase)
            for k in (1, 2, 3)
        )
