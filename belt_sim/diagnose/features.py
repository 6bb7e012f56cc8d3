"""Features of a curve that people read off: late rate, travel to the first tenth of a millimetre, overshoot."""

import numpy as np

from belt_sim import si
from belt_sim.curves import LATE_SHARE

FIRST = 0.1 * si.MM


def features(travel: np.ndarray, y: np.ndarray) -> dict[str, float | None]:
    """late_rate_mm_per_m, travel_to_first_0.1mm_m (None: never), overshoot_mm of one lateral record [m].

    Overshoot is the largest distance beyond the line that the late record lies on, in the direction of motion.
    """
    keep = np.isfinite(y)
    travel, y = travel[keep], y[keep]
    if len(y) < 5:
        return {"late_rate_mm_per_m": None, "travel_to_first_0.1mm_m": None, "overshoot_mm": None}
    late = travel >= travel[-1] - LATE_SHARE * (travel[-1] - travel[0])
    slope, start = np.polyfit(travel[late], y[late], 1)
    beyond = (y - (start + slope * travel)) * np.sign(y[-1] if y[-1] != 0 else 1.0)
    moved = np.flatnonzero(np.abs(y) >= FIRST)
    return {
        "late_rate_mm_per_m": float(slope / si.MM_PER_M),
        "travel_to_first_0.1mm_m": float(travel[moved[0]]) if len(moved) else None,
        "overshoot_mm": float(max(beyond.max(), 0.0) / si.MM),
    }
