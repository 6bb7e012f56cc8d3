"""The belt as a surface: tilt of its cross-sections, and a ribbon of triangles in its colours."""

import numpy as np

from belt_sim.frame import Frame
from belt_sim.pictures.colours import DIVERGING, rgb

#: A cross-section narrower than this [m] is a rope's: it has no tilt.
ROPE_WIDTH = 1e-6


def tilt(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Angle of each cross-section against the horizontal [rad], positive where the edge at +y is higher.

    left, right: shape (n, 3) [m]. A rope (both edges one line) has no tilt: 0.
    """
    across = np.asarray(left, float) - np.asarray(right, float)
    width = np.linalg.norm(across, axis=-1)
    rope = width < ROPE_WIDTH
    return np.where(rope, 0.0, np.arcsin(np.clip(across[:, 2] / np.where(rope, 1.0, width), -1.0, 1.0)))


def mid_span_tilt(frame: Frame) -> tuple[float, float]:
    """Tilt of the upper and the lower cross-section nearest to mid-span [rad]."""
    x, z = (0.5 * (frame.left[:, k] + frame.right[:, k]) for k in (0, 2))
    angles = tilt(frame.left, frame.right)
    far = np.abs(x - 0.5 * frame.tail_x)
    middle = 0.5 * (frame.points[:, 2].max() + frame.points[:, 2].min())
    upper, lower = (np.argmin(np.where(side, far, np.inf)) for side in (z > middle, z <= middle))
    return float(angles[upper]), float(angles[lower])


def ribbon_triangles(stations: int) -> np.ndarray:
    """Triangles of a closed ribbon whose vertices are left[0..n-1], right[0..n-1]; shape (2 n, 3)."""
    here = np.arange(stations)
    after = (here + 1) % stations
    first = np.column_stack([here, after, here + stations])
    second = np.column_stack([after, after + stations, here + stations])
    return np.concatenate([first, second]).astype(np.uint32)


def tilt_colours(angles: np.ndarray, full: float) -> np.ndarray:
    """Colours (n, 3) [0..255] of tilts [rad]: blue at -full, near white at 0, red at +full."""
    at = np.clip(0.5 + 0.5 * np.asarray(angles) / full, 0.0, 1.0)
    stops = [p for p, _ in DIVERGING]
    channels = np.array([rgb(c) for _, c in DIVERGING], float)
    return np.stack([np.interp(at, stops, channels[:, k]) for k in range(3)], axis=-1).astype(np.uint8)
