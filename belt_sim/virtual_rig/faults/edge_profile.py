"""The belt's edge is not straight: y + e(m) - e(m when the yaw was applied), m the part of the belt.

e = sum over k of (cosk cos + sink sin)(2 pi k m / belt length), m counted backwards from what was at point 4 at
travel 0. The last term: y = 0 is where the point was when the yaw was applied. Forty harmonics, drawn with the
spectrum of a measured edge: amplitudes that fall like k^-1.27 about 0.57 mm for the first.
"""

from dataclasses import dataclass, make_dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size

HARMONICS, DECAY = 40, 1.27
FIRST = 4e-4  # [m]: of the cosine and of the sine, together 0.57 mm
STEEPEST = 1e-2  # [m]: amplitude times harmonic, that is 3 mm/m of slope on a belt of 20 m
_FIELDS = [(f"{kind}{k}", float, 0.0) for k in range(1, HARMONICS + 1) for kind in ("cos", "sin")]
_Harmonics = make_dataclass("_Harmonics", _FIELDS, bases=(Fault,), frozen=True, kw_only=True)


@dataclass(frozen=True, kw_only=True)
class EdgeProfile(_Harmonics):  # type: ignore[misc,valid-type]
    id = "edge_profile"
    sizes = {
        name: Size(unit="m", typical=FIRST / int(name[3:]) ** DECAY, limit=STEEPEST / int(name[3:]))
        for name, *_ in _FIELDS
    }
    lot = 14
    mixed = True

    def edge(self, place, s, line):
        phase = -2 * np.pi * line.passing(place, s) / line.belt_length
        there = [k for k in range(1, HARMONICS + 1) if np.any(self._of(k)[0]) or np.any(self._of(k)[1])]
        return sum((self._of(k)[0] * np.cos(k * phase) + self._of(k)[1] * np.sin(k * phase) for k in there), 0.0)

    def _of(self, k: int):
        return getattr(self, f"cos{k}"), getattr(self, f"sin{k}")
