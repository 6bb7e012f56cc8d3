"""The path on which stations come onto a pulley's circle and leave it (why there is one: wrap/touchdown.py)."""

import math

import numpy as np

_SINKING = 4  # chords, at most


def sinking(chord: float, radius: float) -> int:
    """Chords along which a station sinks; with two more at either end of half a wrap some stay on the circle."""
    return min(max(int(0.5 * math.pi * radius / chord) - 3, 1), _SINKING)


def lift(depth: np.ndarray, chord: float, radius: float) -> np.ndarray:
    """Height above the circle [m] of stations that lie ``depth`` [m] behind the place where the belt meets the pulley.

    Straight up to half a chord, then a cubic to 0 with the slope of either side.
    """
    along = sinking(chord, radius)
    straight = radius / np.cos(np.minimum(depth, 0.5 * chord) / radius) - radius
    t = _sunk(depth, chord, radius)
    left = (1.0 - t) * (1.0 - t)
    return straight * left * (1.0 + 2.0 * t) + (0.5 * chord**2 / radius * along) * t * left


def fading(depth: np.ndarray, chord: float, radius: float) -> np.ndarray:
    """From 1 on the straight part of the path to 0 on the circle, with level ends."""
    t = _sunk(depth, chord, radius)
    return (1.0 - t) * (1.0 - t) * (1.0 + 2.0 * t)


def _sunk(depth: np.ndarray, chord: float, radius: float) -> np.ndarray:
    """Share of the way from the straight part of the path to the circle."""
    return np.minimum(np.maximum((depth / chord - 0.5) / sinking(chord, radius), 0.0), 1.0)


def apart(chord, across, r1: np.ndarray, r2: np.ndarray) -> np.ndarray:
    """Angle [rad] between places ``chord`` [m] from another, at radii r1, r2 and ``across`` [m] along the axis."""
    return apart_flat(chord**2 - across**2, r1, r2)


def apart_flat(flat: np.ndarray, r1: np.ndarray, r2: np.ndarray) -> np.ndarray:
    """The same for chords whose square, without what goes along the axis, is ``flat`` [m2]."""
    return 2.0 * np.arcsin(np.sqrt((flat - (r1 - r2) ** 2) / (4.0 * r1 * r2)))
