"""Uncertainties of fitted numbers: those of an SVD, those of the scatter, and none where nothing is known."""

from dataclasses import replace

import numpy as np
import pytest
from linear_bench import SPREAD, WHITE, linear_bench, with_readings

import belt_sim as bs
from belt_sim.diagnosis.linear_algebra import covariance_of, covariance_root
from belt_sim.units import DEGREE, N_PER_MM2
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Plan, grid

SHAPE = (len(SPREAD), 1, 40)


def fitted(shapes, y):
    """The fit of all shapes (k, R, S, n) to readings."""
    named = {f"e{k}": rows for k, rows in enumerate(shapes)}
    bench = with_readings(linear_bench(SPREAD, shapes=named), y)
    return bench.fit([bench.start(tuple(named), bench.forward.null())])[0]


def test_fifty_random_fits_have_the_uncertainties_of_an_svd():
    rng = np.random.default_rng(0)
    for _ in range(50):
        k = int(rng.integers(2, 7))
        shapes = WHITE.white * rng.standard_normal((k, *SHAPE)) * 10.0 ** rng.uniform(-1.0, 3.0, (k, 1, 1, 1))
        size = np.linalg.norm(shapes[0]) / np.linalg.norm(shapes[-1])
        shapes[-1] = shapes[0] + size * shapes[-1] * 10.0 ** rng.uniform(-4.0, 0.0)  # nearly alike
        fit = fitted(shapes, WHITE.white * rng.standard_normal(SHAPE))
        _, size, rows = np.linalg.svd(fit.columns.T, full_matrices=False)
        np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance)), np.linalg.norm(rows.T / size, axis=1), rtol=0.01)


def test_intervals_hold_the_truth_as_often_as_they_say():
    rng, hits = np.random.default_rng(1), []
    shapes = WHITE.white * rng.standard_normal((3, *SHAPE))
    shapes[2] += 3.0 * shapes[0]
    truth = np.array([2.0, -1.0, 0.5])
    for _ in range(400):
        fit = fitted(shapes, np.einsum("k,krsn->rsn", truth, shapes) + WHITE.white * rng.standard_normal(SHAPE))
        hits.append(np.abs(fit.vector[fit.free] - truth) < 1.96 * np.sqrt(np.diag(fit.covariance)))
    assert 0.93 < np.mean(hits) < 0.97


def test_what_no_reading_tells_apart_is_not_known_but_its_sum_is():
    column = np.random.default_rng(2).standard_normal(200)
    columns = np.stack([column, 2.0 * column])
    assert np.sqrt(np.diag(covariance_of(columns))).min() > 1e3 / np.linalg.norm(column)
    along = np.array([1.0, 2.0]) @ covariance_root(columns)
    assert np.linalg.norm(along) == pytest.approx(1.0 / np.linalg.norm(column), rel=1e-6)


@pytest.fixture(scope="module")
def one_run():
    """A campaign of one run that hides a taper of 20 ppm per m of width."""
    plan = Plan(runs=grid((10.0 * N_PER_MM2,), (-0.042 * DEGREE,), repeats=0), length=30.0, spacing=0.5)
    return make_campaign(hidden=[{"id": "taper", "kappa_t": 20e-6}], base="strip", seed=1, plan=plan)[0]


def test_a_fit_says_what_the_readings_cannot_separate(one_run):
    found = bs.fit(one_run, ["taper", "yaw_offset_tail"], "strip")
    said = str(found)
    assert set(found.unbound) == {"taper.kappa_t", "taper.kappa_t_head", "yaw_offset_tail.beta_0"}
    assert said.count("not bound by these readings") == 3
    assert "these readings cannot separate taper.kappa_t, taper.kappa_t_head, yaw_offset_tail.beta_0" in said
    assert found.u["taper.kappa_t"] > 20e-6  # pinv said 0.16e-6
    assert said.startswith("[[Fit Statistics]]")
    assert "    reduced chi-square = " in said
    assert said.index("[[Variables]]") < said.index("[[Left open]]")


def test_a_fit_tells_correlations_and_bounds(one_run):
    alone = bs.fit(one_run, ["taper"], "strip")
    assert not alone.unbound
    assert abs(alone.values["taper.kappa_t"] - 20e-6) < 4.0 * alone.u["taper.kappa_t"]
    assert np.allclose(np.diag(alone.correlation), 1.0)
    if abs(alone.correlation[0, 1]) > 0.9:
        assert "correlation" in str(alone)
    waves = {n: y + 1e-3 * np.sin(3.0 * one_run.runs[0].travel) for n, y in one_run.runs[0].signals.items()}
    odd = replace(one_run, runs=(replace(one_run.runs[0], signals=waves),))
    assert "rejected" in str(bs.fit(odd, ["taper"], "strip"))
