"""The readings of the open question on curves whose rates are known, and superposition of even effects."""

import numpy as np
import pytest

from studies.open_question import (
    EVEN,
    GRID,
    ODD,
    Curves,
    beams,
    common,
    faster_and_realistic,
    march,
    straightest,
    strip,
)

RATES = np.array([0.3e-3, 0.2e-3, 0.12e-3, 0.1e-3])  # [m/m] at 7, 10, 20, 40 N/mm2
ROUNDING = 1e-9  # [m]: of a march over 400 m


def swinging(record: float) -> Curves:
    """Straight lines of RATES that swing before ``record`` m and not after it."""
    swing = 1e-3 * np.sin(GRID) * (record > GRID)
    return Curves(RATES[:, None] * GRID + swing, RATES)


def test_the_straightest_stretch_of_a_settled_curve_has_its_steady_rate():
    np.testing.assert_allclose(straightest(swinging(50.0), 6.0, 100.0), RATES, rtol=1e-9)
    assert (abs(straightest(swinging(50.0), 6.0, 40.0) / RATES - 1.0) > 0.1).any()


def test_a_falling_curve_has_no_rate():
    assert np.isnan(straightest(Curves(-RATES[:, None] * GRID, -RATES), 6.0, 60.0)).all()


@pytest.mark.parametrize(("slack", "share"), [(1.3, 1.0), (1.1, 0.0)])
def test_windows_that_all_curves_share(slack, share):
    beam = beams()["beam_th2"].rate
    rates = np.array([slack, 2.0, 1.1 * beam[2] / beam[3], 1.0]) * beam[3]
    assert common(Curves(rates[:, None] * GRID, rates), 5.0, 60.0) == share
    assert faster_and_realistic(rates) == bool(share)


@pytest.mark.parametrize("candidate", EVEN, ids=lambda c: c.name)
def test_even_effects_superpose(candidate):
    """A run at three units is the run without plus three times the response of one unit."""
    response = march("strip", candidate.entry(1.0)).plus(strip(0.0), -1.0)
    np.testing.assert_allclose(
        march("strip", candidate.entry(3.0)).y, strip(0.0).plus(response, 3.0).y, atol=ROUNDING, rtol=1e-6
    )


@pytest.mark.parametrize(("sizes", "settings"), [odd[2:] for odd in ODD], ids=[odd[0] for odd in ODD])
def test_odd_causes_run_at_their_largest_size(sizes, settings):
    assert np.isfinite(march("strip", **settings(max(sizes))).y).all()
