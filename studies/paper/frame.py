"""The paper's coordinates: x from the tail pulley (point 1) to the head pulley, y to its left (paper eq. 7, 13-15).

The package counts x from the head pulley. Half a turn about z takes the one into the other: x -> a - x, y -> -y, and
angles stay. So a yaw of -0.042 degrees moves the belt towards +y here.
"""

from typing import Any

import numpy as np

from belt_sim.si import MM, MM_PER_M


def y_mm(y: Any) -> np.ndarray:
    """Lateral position of the package [m] -> of the paper [mm]."""
    return -np.asarray(y, float) / MM


def rate_mm_per_m(rate: Any) -> Any:
    """Drift dy/ds of the package [m/m] -> of the paper [mm per m of travel]."""
    return -np.asarray(rate, float) / MM_PER_M


def x_m(x: Any, centre_distance: float) -> np.ndarray:
    """Place along the machine, from the head pulley [m] -> from the tail pulley [m]."""
    return centre_distance - np.asarray(x, float)
