"""A pulley by itself, with stations on it, for tests of the laws of contact."""

import numpy as np

from belt_sim.mujoco3d.belt import SurfaceArrays
from belt_sim.mujoco3d.loop import sink_chords
from belt_sim.mujoco3d.wrap import PoseArrays, WrapArrays, anchor_places


def surface(radius: float, chord: float, extra: float = 0.0, **shape: float) -> SurfaceArrays:
    """A plain cylinder but for ``shape``; radius, extra, chord [m]."""
    plain = dict.fromkeys(SurfaceArrays._fields, 0.0)
    numbers = {"radius": radius, "extra": extra, "sink_chords": float(sink_chords(chord, radius))}
    return SurfaceArrays(**plain | numbers | shape)


def empty_wrap(first: int, last: int, stations: int, lines: int = 2) -> WrapArrays:
    """Anchors not yet placed."""
    return WrapArrays(first, last, *np.zeros((3, lines, stations)), np.zeros(stations), np.zeros(2))


def pose(axes: np.ndarray | None = None, spin: float = 0.0) -> PoseArrays:
    """A pulley at the origin."""
    return PoseArrays(np.zeros(3), np.eye(3) if axes is None else axes, spin)


def places(wrap: WrapArrays, at: PoseArrays) -> np.ndarray:
    """Of the anchors of the held stations [m], (m, 3, held)."""
    k = np.arange(wrap.first, wrap.last + 1) % wrap.r.shape[-1]
    turned = wrap.angle[:, k] + at.spin
    return anchor_places(wrap.r[:, k], wrap.y[:, k], turned, at.axes[..., None], at.centre[:, None])
