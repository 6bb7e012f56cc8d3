"""A law that runs away in the march is fitted from where it keeps the belt on its pulleys."""

from types import SimpleNamespace

import numpy as np
import pytest

from belt_sim.discovery.selection import RUNAWAY_READING, _start_on_pulleys

READ = 2e-3


def bench(limit):
    """A march that overflows beyond a size of ``limit``, with a shape number that is none of the law's sizes."""

    def values(vector):
        return np.full((1, 1, 4), READ if abs(vector[0, 0]) < limit else np.inf)

    return SimpleNamespace(fitted=SimpleNamespace(y=np.full((1, 1, 4), READ)), forward=SimpleNamespace(values=values))


@pytest.mark.parametrize(("limit", "kept"), [(10.0, 4.0), (3.0, 2.0), (0.3, 0.25)])
def test_sizes_are_halved_until_the_march_stays(limit, kept):
    found = _start_on_pulleys(bench(limit), np.array([4.0, 7.0]), [0])
    assert found.tolist() == [kept, 7.0]
    assert RUNAWAY_READING > 1.0


def test_what_is_no_number_is_no_march_that_stays():
    broken = bench(1.0)
    broken.forward.values = lambda v: np.full((1, 1, 4), np.nan if abs(v[0, 0]) > 1.0 else 0.0)
    assert _start_on_pulleys(broken, np.array([4.0]), [0]).tolist() == [1.0]


def test_no_law_is_small_enough_for_a_belt_that_runs_away_by_itself():
    """Infinities that reach a decomposition of the shapes would never come back."""
    broken = bench(0.0)
    assert _start_on_pulleys(broken, np.array([4.0, 7.0]), [0]) is None
