"""Features of a curve that people read off: late rate, travel to the first tenth of a millimetre, overshoot."""

import numpy as np

from belt_sim import si
from belt_sim.curves import LATE_SHARE
from belt_sim.results.errors import Features

FIRST = 0.1 * si.MM  # and 0.1 mrad of a tilt
LEAST = 5  # samples


def features(travel: np.ndarray, y: np.ndarray) -> Features:
    """Features of one record [m or rad] against travel [m], both (n,).

    Overshoot is the largest distance beyond the line that the late record lies on, in the direction of motion.
    """
    keep = np.isfinite(y)
    travel, y = travel[keep], y[keep]
    if len(y) < LEAST:
        return Features()
    late = travel >= travel[-1] - LATE_SHARE * (travel[-1] - travel[0])
    slope, start = np.polyfit(travel[late], y[late], 1)
    beyond = (y - (start + slope * travel)) * np.sign(y[-1] if y[-1] != 0 else 1.0)
    moved = np.flatnonzero(np.abs(y) >= FIRST)
    return Features(
        late_rate=float(slope),
        first_move=float(travel[moved[0]]) if len(moved) else None,
        overshoot=float(max(beyond.max(), 0.0)),
    )
