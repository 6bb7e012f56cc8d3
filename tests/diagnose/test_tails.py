"""Tails of chi2 and of Gumbel's law are those of scipy's statistics."""

import numpy as np
import pytest
from scipy import stats

from belt_sim.diagnosis.numerics.tails import chi2_cdf, chi2_isf, chi2_logsf, chi2_sf, gumbel_fit, gumbel_isf, gumbel_sf


@pytest.mark.parametrize("numbers", [1, 2, 80])
def test_a_chi2_has_the_tails_of_scipy(numbers):
    x, p = np.array([0.0, 0.3, 7.0, 900.0]), np.array([1.0, 0.3, 1e-9])
    assert np.allclose(chi2_cdf(x, numbers), stats.chi2.cdf(x, numbers), rtol=1e-12, atol=0.0)
    assert np.allclose(chi2_sf(x, numbers), stats.chi2.sf(x, numbers), rtol=1e-12, atol=0.0)
    assert np.allclose(chi2_logsf(x, numbers), stats.chi2.logsf(x, numbers), rtol=1e-12, atol=0.0)
    assert np.allclose(chi2_isf(p, numbers), stats.chi2.isf(p, numbers), rtol=1e-12, atol=0.0)
    assert chi2_logsf(1e5, numbers) == -np.inf


@pytest.mark.parametrize("size", [1e-4, 1.0, 300.0])
def test_gumbels_law_is_fitted_as_scipy_does(size):
    largest = size * np.random.default_rng(1).gumbel(3.0, 0.7, 200)
    law = gumbel_fit(largest)
    assert np.allclose(law, stats.gumbel_r.fit(largest), rtol=1e-10)
    assert np.isclose(gumbel_isf(0.01, *law), stats.gumbel_r.isf(0.01, *law), rtol=1e-13)
    assert np.isclose(gumbel_sf(5.0 * size, *law), stats.gumbel_r.sf(5.0 * size, *law), rtol=1e-13)
