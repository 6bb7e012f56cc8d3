"""The best step between sides is best, also where a free one leaves them at several numbers at once."""

import numpy as np
import pytest

from belt_sim.diagnosis.linear_algebra import bounded_step


def test_of_two_numbers_known_only_together_the_step_ends_in_their_valley():
    """The valley a + b = 1 passes between the sides; a free step goes far along it, and the corner lies off it."""
    columns = np.array([[10.0, 0.01, 0.0], [10.0, 0.0, 0.01]])
    system, low, high = columns @ columns.T, np.full(2, -2.0), np.full(2, 4.0)
    step = bounded_step(system, columns @ np.array([10.0, 0.09, -0.08]), low, high)
    assert step == pytest.approx([3.0, -2.0], abs=1e-3)


@pytest.mark.parametrize("seed", range(40))
def test_no_number_that_is_held_pulls_back_and_none_that_is_free_pulls(seed):
    rng = np.random.default_rng(seed)
    size = int(rng.integers(2, 9))
    columns = rng.normal(size=(size, size + 3))
    columns[1] = columns[0] + 0.1 * columns[1]
    system, along = columns @ columns.T, columns @ (5.0 * rng.normal(size=size + 3))
    low, high = -rng.exponential(size=size), rng.exponential(size=size)
    low[0], high[-1] = 0.0, np.inf
    step = bounded_step(system, along, low, high)
    pull = (along - system @ step) / np.sqrt(np.diag(system))
    assert ((low <= step) & (step <= high)).all()
    assert np.all(pull[step > low] > -2e-3)
    assert np.all(pull[step < high] < 2e-3)


def test_where_a_free_step_stays_between_the_sides_it_is_that():
    system, along = np.diag([2.0, 4.0]), np.array([1.0, -2.0])
    assert bounded_step(system, along, np.full(2, -1.0), np.full(2, 1.0)) == pytest.approx([0.5, -0.5])


def test_a_number_without_room_does_not_move():
    assert bounded_step(np.eye(2), np.ones(2), np.zeros(2), np.array([0.0, 5.0])) == pytest.approx([0.0, 1.0])
