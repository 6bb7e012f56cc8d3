"""Draws of noise in which no slow part is seen neither blow up nor vanish in the test of generic laws."""

import numpy as np

from belt_sim.discovery.gate import FAR, MOST, _ratio, surprise


def test_slow_noise_over_what_is_believed_of_it():
    here = np.array([1.0, 1.0, 0.0])
    believed = np.array([[2.0, 0.0, 0.0], [0.5, 0.1, 1.0]])
    assert _ratio(here, believed).tolist() == [[0.5, MOST, 1.0], [2.0, MOST, 1.0]]


def test_the_surprise_of_a_vast_gain_is_finite_and_grows():
    gains = np.array([1.0, FAR - 1.0, FAR, FAR + 1.0, 1e5])
    found = surprise(gains, 1)
    assert np.isfinite(found).all()
    assert (np.diff(found) > 0.0).all()
    assert found[3] - found[2] < 0.51  # no jump where the two meet
