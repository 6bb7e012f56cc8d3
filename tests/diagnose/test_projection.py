"""Projections in the eigenvectors of the wander say what least squares on whitened readings say."""

from dataclasses import replace

import numpy as np
import pytest
from linear_bench import SPREAD, WHITE

from belt_sim.diagnosis.metric import metric_of
from belt_sim.diagnosis.noise import Levels
from belt_sim.diagnosis.projection import FAINT, Projection
from belt_sim.diagnosis.samples import Samples

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


def test_gains_are_those_of_least_squares_at_any_noise_levels(laid_out):
    samples, _, _, families = laid_out
    errors = 1e-4 * np.random.default_rng(2).normal(size=(9, *samples.y.shape))
    levels = [LEVELS[k % len(LEVELS)] for k in range(len(errors))]
    left = Projection(*laid_out, beside="current").sums(errors, levels)
    wanted = [dense(laid_out, e, lv) for e, lv in zip(errors, levels, strict=True)]
    for name in families:
        gains, rank = left.gains(name)
        assert gains == pytest.approx([w[name][0] for w in wanted], rel=EXACT, abs=EXACT)
        assert list(rank[left.of]) == [w[name][1] for w in wanted]


def test_sums_are_products_of_what_is_whitened(laid_out):
    samples, shapes, shared, families = laid_out
    errors = 1e-4 * np.random.default_rng(3).normal(size=(2, *samples.y.shape))
    found = Projection(*laid_out).sums(errors, LEVELS[2:])
    ends = np.cumsum([0, *(len(f) for f in families.values())])
    for k, levels in enumerate(LEVELS[2:]):
        metric = metric_of(samples, levels, shapes, shared)
        columns = metric.whiten(np.concatenate(list(families.values())))
        gram, moments = columns @ columns.T, columns @ metric.whiten(errors[k])
        for name, a, b in zip(families, ends[:-1], ends[1:], strict=True):
            own = found.gram(name)[found.of[k]]
            np.testing.assert_allclose(own, gram[a:b, a:b], rtol=1e-9, atol=1e-9 * np.abs(gram).max())
        np.testing.assert_allclose(found.moments[k], moments, rtol=1e-9, atol=1e-9 * np.abs(moments).max())


def test_columns_of_a_family_may_be_fitted_in_sets(laid_out):
    """Two of three columns together are a family of two; no readings need be of the same levels."""
    samples, shapes, shared, families = laid_out
    errors = 1e-4 * np.random.default_rng(4).normal(size=(3, *samples.y.shape))
    sets = {"three": [np.array([2, 0]), np.array([1])]}
    apart = families | {"two": families["three"][[0, 2]], "last": families["three"][1:2]}
    left = Projection(*laid_out, beside="current", choices=sets).sums(errors, LEVELS[1:])
    right = Projection(samples, shapes, shared, apart, beside="current").sums(errors, LEVELS[1:])
    for which, name in enumerate(("two", "last")):
        gains, rank = left.gains("three", which)
        assert gains == pytest.approx(right.gains(name)[0], rel=EXACT)
        np.testing.assert_array_equal(rank, right.gains(name)[1])
