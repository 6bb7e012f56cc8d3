"""A pulley by itself, with stations on it, for tests of the laws of contact."""

from dataclasses import fields

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.jax_setup import in_float64
from belt_sim.space.belt import BatchShape, BeltArrays, SurfaceArrays
from belt_sim.space.scene import sink_chords
from belt_sim.space.wrap import PoseArrays, WrapArrays, anchor_places


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
    return PoseArrays(np.zeros(3), np.eye(3) if axes is None else axes, spin, 0.0)


def places(wrap: WrapArrays, at: PoseArrays) -> np.ndarray:
    """Of the anchors of the held stations [m], (m, 3, held)."""
    k = np.arange(wrap.first, wrap.last + 1) % wrap.r.shape[-1]
    turned = wrap.angle[:, k] + at.spin
    found = jax.jit(anchor_places)(wrap.r[:, k], wrap.y[:, k], turned, at.axes[..., None], at.centre[:, None], at.bow)
    return np.asarray(found)


def on_jax(tree):
    """With JAX's arrays; in float64 where that is on."""
    return jax.tree.map(jnp.asarray, tree)


def bare_belt(surfaces: list[SurfaceArrays], chord: float, stations: int, **numbers) -> BeltArrays:
    """Two lines of nodes on these pulleys, of which nothing else is known; numbers: fields of BeltArrays."""
    shape = BatchShape(stations=stations, lines=2, bonds=False, sign=numbers.pop("sign", 1), zone=6, longest_wrap=80,
                       canted=any(s.cant for s in surfaces))  # fmt: skip
    nothing = {f.name: 0.0 for f in fields(BeltArrays)} | dict.fromkeys(
        ("sliding_stiffness", "guides", "fibres", "loads")
    )
    both = jax.tree.map(lambda *of: np.array(of), *surfaces)
    return BeltArrays(**nothing | {"surfaces": both, "chord": chord, "mass": np.full(2, 0.1), "shape": shape} | numbers)


def both(*pulleys):
    """Pulleys, poses or wraps as one, with a leading axis."""
    return jax.tree.map(lambda *of: np.stack(of), *pulleys)


def carrying(state):
    """What a state of engine=native carries on, in the open."""
    return in_float64(state.unpack)(state.carried)


def stations_on(state, pulley):
    """Numbers of the stations that lie on a pulley in a state of engine=native."""
    wrap = carrying(state).pulleys.wrap
    return np.arange(int(wrap.first[pulley]), int(wrap.last[pulley]) + 1) % len(state.slides)
