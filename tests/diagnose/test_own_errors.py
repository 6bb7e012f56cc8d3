"""Errors beside each run's own zero and settings: what nuisances make is taken off, what effects make is not."""

from dataclasses import replace

import numpy as np
import pytest
from linear_bench import SPREAD, linear_bench

from belt_sim.diagnosis.errors import ErrorsWithoutNuisances, errors_of
from belt_sim.diagnosis.noise import metric_of

COUNT, ZERO = 40, 1e-3  # a zero of a hundred times the noise


def bench_with_zeros(y):
    """One signal whose zero differs from run to run."""
    bench = linear_bench(SPREAD, y=y, shapes={"a": np.tile(np.linspace(0.0, 1e-4, COUNT), (len(SPREAD), 1, 1))})
    shapes = np.full((1, len(SPREAD), 1, COUNT), ZERO)
    return replace(bench, shapes=shapes, metric=metric_of(bench.samples, bench.levels, shapes, bench.shared))


@pytest.fixture(scope="module")
def drawn():
    """White noise as stated, and a zero of every run."""
    rng = np.random.default_rng(4)
    zeros = ZERO * rng.standard_normal((len(SPREAD), 1, 1))
    return zeros + 1e-5 * rng.standard_normal((len(SPREAD), 1, COUNT))


def test_a_perfect_model_leaves_the_floor(drawn):
    own = ErrorsWithoutNuisances(bench_with_zeros(drawn))
    left = own.remove_nuisances(drawn, np.ones(len(SPREAD), dtype=bool))
    assert own.floor == pytest.approx(1e-5 * np.sqrt(1.0 - 1.0 / COUNT), rel=1e-3)
    assert np.sqrt(np.mean(left**2)) == pytest.approx(own.floor, rel=4.0 / np.sqrt(2 * drawn.size))
    assert np.sqrt(np.mean(drawn**2)) > 20.0 * own.floor


def test_a_right_effect_takes_the_error_to_the_floor_whatever_the_zeros_are(drawn):
    """In plain rms the zeros hide it."""
    bench = bench_with_zeros(drawn + np.linspace(0.0, 1e-4, COUNT))
    base, found = (bench.fit([bench.start(ids, bench.forward.null())])[0] for ids in ((), ("a",)))
    error = errors_of(bench, base, bench, found)
    assert error.own.before > 2.5 * error.own.floor
    assert error.own.after == pytest.approx(error.own.floor, rel=0.2)
    assert error.held_out.after > 0.9 * error.held_out.before
