"""The cosine and sine that a march sums are those of the library."""

import numpy as np

from belt_sim.effects.yaw import cos_sin
from belt_sim.jax_setup import in_float64


def test_cosine_and_sine_are_right_to_the_last_digits():
    angle = np.concatenate([np.linspace(-1e4, 1e4, 20001), np.arange(-40, 41) * np.pi / 4])
    cos, sin = (np.asarray(x) for x in in_float64(cos_sin)(angle))
    assert np.abs(cos - np.cos(angle)).max() < 5e-16
    assert np.abs(sin - np.sin(angle)).max() < 5e-16
