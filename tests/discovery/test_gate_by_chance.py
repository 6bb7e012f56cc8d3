"""What the test of generic laws takes for chance: noise as the readings have it, judged as they are."""

import numpy as np
from small_discovery import surveyed

from belt_sim.discovery.gate import FAR, errors_by_chance, judged, surprise

FACTOR = 2.0  # of a variance: beyond what two repeats leave open


def test_draws_are_judged_at_the_levels_at_which_the_readings_are():
    """Levels that two repeats show are good to a factor of two: read off each draw once more, some draws counted six
    times what they are, and a law had to explain a chi2 of 50 to 90.
    """
    survey = surveyed()
    size = np.mean(errors_by_chance(survey, 100, np.random.default_rng(0)) ** 2, axis=(1, 2))
    assert size.min() > 1.0 / FACTOR
    assert size.max() < FACTOR
    assert judged(survey, draws=40)[0].threshold < 40.0


def test_the_surprise_of_a_vast_gain_is_finite_and_grows():
    gains = np.array([1.0, FAR - 1.0, FAR, FAR + 1.0, 1e5])
    found = surprise(gains, 1)
    assert np.isfinite(found).all()
    assert (np.diff(found) > 0.0).all()
    assert found[3] - found[2] < 0.51  # no jump where the two meet
