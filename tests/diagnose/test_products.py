"""What chance gives candidates by products of columns is what least squares on whitened readings say."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_bench import SPREAD, WHITE

from belt_sim.diagnosis.fits.alternatives import Alternatives
from belt_sim.diagnosis.left_over.null import _Tried
from belt_sim.diagnosis.noise.metric import metric_of
from belt_sim.diagnosis.noise.noise import Levels
from belt_sim.diagnosis.numerics.products import FAINT
from belt_sim.diagnosis.readings.samples import Samples

EXACT = 1e-10
COUNT = 50
SIGNALS = (
    replace(WHITE, wander_sd=3e-5, wander_length=3.0),
    replace(WHITE, name="y4", at="point_4", wander_sd=1e-5, wander_length=5.0),
)
LEVELS = [
    Levels(),
    Levels(white=1.4, wander=0.6),
    Levels(white=(0.5, 2.0), wander=(3.0, 0.4), length=(3.0, 0.5)),
    Levels(white=(1.0, 2.0), wander=(2.0, 0.4), length=(3.0, 0.5)),
]


@pytest.fixture(scope="module")
def laid_out():
    """Samples of two signals with blanks, nuisances, and families of columns: (samples, shapes, shared, families)."""
    rng = np.random.default_rng(1)
    travel = np.sort(rng.uniform(0.0, 30.0, (len(SPREAD), COUNT)), axis=1)
    y = np.zeros((len(SPREAD), len(SIGNALS), COUNT))
    y[1, 0, 10:20], y[3] = np.nan, np.nan
    samples = Samples(
        runs=SPREAD, signals=SIGNALS, cases=None, travel=travel, time=travel, y=y, yaw_at=np.zeros(len(SPREAD)),
        per_bin=np.where(np.arange(len(SPREAD)) % 2, 4.0, 1.0),
    )  # fmt: skip

    def rows(k, size=3e-5):
        return size * rng.normal(size=(k, *y.shape)).cumsum(axis=-1)

    current = rows(2)
    only = rows(2)
    only[:, 1:] = 0.0
    families = {
        "current": current,
        "one": rows(1),
        "three": rows(3),
        "same": 2.0 * current[:1] - current[1:],
        "half": np.concatenate([current[:1], rows(1)]),
        "run": only,
        "unseen": rows(1, 1e-12),
    }
    return samples, rows(5), rows(2), families


def dense(laid_out, errors, levels) -> dict[str, tuple[float, int]]:
    """Gain and rank of every family beside "current" by orthonormal rows of whitened columns."""
    samples, shapes, shared, families = laid_out
    metric = metric_of(samples, levels, shapes, shared)
    inside, residual, found = _basis(metric.whiten(families["current"])), metric.whiten(errors), {}
    for name, columns in families.items():
        white = metric.whiten(columns)
        rows = _basis(white - (white @ inside.T) @ inside)
        found[name] = float(np.sum((rows @ residual) ** 2)), len(rows)
    return found


def _basis(rows):
    size = np.linalg.norm(rows, axis=1)
    scaled = rows[size > FAINT] / size[size > FAINT, None]
    if not len(scaled):
        return scaled
    _, strength, directions = np.linalg.svd(scaled, full_matrices=False)
    return directions[strength > 1e-6 * strength[0]]


@pytest.fixture(scope="module", params=LEVELS)
def bench(request, laid_out):
    """A workbench as far as chance asks it, at some noise levels."""
    samples, shapes, shared, _ = laid_out
    return SimpleNamespace(metric=metric_of(samples, request.param, shapes, shared), levels=request.param)


def test_gains_are_those_of_least_squares_on_whitened_readings(bench, laid_out):
    samples, _, _, families = laid_out
    errors = 1e-4 * np.random.default_rng(2).normal(size=(3, *samples.y.shape))
    tried = _Tried(bench, families, families["current"])
    wanted = [dense(laid_out, e, bench.levels) for e in errors]
    found = dict(tried.gains(errors))
    for name in families:
        np.testing.assert_allclose(found[name], [[w[name][0] for w in wanted]], rtol=EXACT, atol=EXACT)
        assert tried.ranks[name] == [wanted[0][name][1]]


def test_columns_of_a_family_may_be_fitted_in_sets(bench, laid_out):
    """Every point of a grid is a family of its own."""
    samples, _, _, families = laid_out
    errors = 1e-4 * np.random.default_rng(4).normal(size=(3, *samples.y.shape))
    points = Alternatives(families["three"], (np.array([2, 0]), np.array([1, 2])))
    apart = {k: families["three"][list(c)] for k, c in enumerate(points.choices)}
    (_, together), *_ = _Tried(bench, {"three": points}, families["current"]).gains(errors)
    for k, (_, alone) in enumerate(_Tried(bench, apart, families["current"]).gains(errors)):
        np.testing.assert_allclose(together[k], alone[0], rtol=EXACT)


def test_readings_need_not_be_whitened(bench, laid_out):
    samples, _, _, families = laid_out
    errors = 1e-4 * np.random.default_rng(3).normal(size=(2, *samples.y.shape))
    white = bench.metric.whiten(families["three"])
    products = bench.metric.back(white).reshape(3, -1) @ errors.reshape(2, -1).T
    wanted = white @ bench.metric.whiten(errors).T
    np.testing.assert_allclose(products, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())
