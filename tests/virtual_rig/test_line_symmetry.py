"""What the machine's symmetries demand."""

import numpy as np
import pytest
from virtual_bench import YAW, measured

BASES = ("beam_th2", "strip")


@pytest.mark.parametrize("base", BASES)
def test_zero_yaw_is_zero_motion(base):
    assert np.all(measured(base=base, yaw=0.0)[1] == 0.0)


@pytest.mark.parametrize("base", BASES)
def test_opposite_yaw_is_the_mirror_image(base):
    _, left = measured(base=base, yaw=-YAW)
    _, right = measured(base=base, yaw=YAW)
    assert np.all(left == -right)


@pytest.mark.parametrize("base", BASES)
def test_reversed_travel_exchanges_top_and_bottom(base):
    """Both spans hang alike: the reversed machine is the mirror image in height; the yaw keeps its sign."""
    _, forward = measured(base=base)
    _, backward = measured(base=base, direction=-1.0)
    assert np.all(backward == forward[[1, 0, 3, 2]])


@pytest.mark.parametrize("base", BASES)
def test_only_the_difference_of_the_yaws_makes_it_drift(base):
    _, tail = measured(base=base, yaw=YAW, length=400.0)
    _, head = measured(base=base, yaw=0.0, yaw_head=-YAW, length=400.0)
    assert np.ptp(tail[:, -1] - tail[:, 1200]) < 2e-6  # [m] all points drift alike
    np.testing.assert_allclose(head[:, -1] - head[:, 1200], tail[:, -1] - tail[:, 1200], rtol=2e-3)


@pytest.mark.parametrize("base", BASES)
def test_a_late_yaw_gives_the_same_curve_later(base):
    s, early = measured(base=base, spacing=0.25, length=30.0)
    t, late = measured(base=base, spacing=0.25, length=43.25, yaw_at=13.25)
    np.testing.assert_allclose(late[:, t >= 13.25], early, atol=2e-9)
    assert np.all(late[:, t < 13.25] == 0.0)
    assert len(s) == np.sum(t >= 13.25)
