"""Beside an unknown that may be anything smooth, only what is not smooth stays."""

from dataclasses import replace

import numpy as np
import pytest
from linear_bench import SPREAD, WHITE, linear_bench

from belt_sim.diagnosis.left_over.beside import _Seen, _solved, members_that_stay, unknown_columns
from belt_sim.diagnosis.left_over.openset import OpenSet

COUNT, THRESHOLD = 40, 10.0
NOTHING_SEEN = OpenSet((), {}, {}, {})


def test_a_slow_effect_goes_and_a_sharp_one_stays():
    s = np.linspace(0.0, 1.0, COUNT)
    signs = np.array([np.sign(r.yaw) for r in SPREAD])[:, None, None]
    drift = WHITE.white * np.ones((len(SPREAD), 1, 1)) * s
    sharp = WHITE.white * signs * np.where(np.arange(COUNT) % 7 == 0, 1.0, 0.0)
    noise = WHITE.white * np.random.default_rng(1).normal(size=(len(SPREAD), 1, COUNT))
    bench = linear_bench(SPREAD, y=8.0 * drift + 5.0 * sharp + noise, shapes={"drift": drift, "sharp": sharp})
    fit = bench.fit([bench.start(("drift", "sharp"), np.zeros(2))])[0]
    stays = members_that_stay(bench, fit, unknown_columns(bench, NOTHING_SEEN), lambda name: THRESHOLD)
    assert stays is not None
    assert stays.ids == ("sharp",)
    u = np.sqrt(stays.covariance[0, 0])
    assert abs(stays.vector[1] - 5.0) < 4.0 * u
    assert stays.vector[0] == 0.0
    everything = members_that_stay(bench, fit, np.empty((0, *bench.samples.y.shape)), lambda name: THRESHOLD)
    assert everything is not None
    assert everything.ids == ("drift", "sharp")


def test_effects_that_stand_in_for_each_other_both_go():
    """Either would explain what is there; one of them is not named because the other was struck out first."""
    sharp = WHITE.white * (np.arange(COUNT) % 7 == 0) * np.ones((len(SPREAD), 1, 1))
    alike = sharp + 0.1 * WHITE.white * (np.arange(COUNT) % 5 == 0)
    noise = WHITE.white * np.random.default_rng(2).normal(size=(len(SPREAD), 1, COUNT))
    bench = linear_bench(SPREAD, y=8.0 * sharp + noise, shapes={"one": sharp, "other": alike})
    columns = unknown_columns(bench, NOTHING_SEEN)
    for ids, left in ((("one",), ("one",)), (("one", "other"), None)):
        fit = bench.fit([bench.start(ids, np.zeros(2))])[0]
        stays = members_that_stay(bench, fit, columns, lambda name: 10.0 * THRESHOLD)
        assert (stays and stays.ids) == left


def test_what_is_just_needed_does_not_stay():
    sharp = WHITE.white * (np.arange(COUNT) % 7 == 0) * np.ones((len(SPREAD), 1, 1))
    bench = linear_bench(SPREAD, y=1.0 * sharp, shapes={"sharp": sharp})
    fit = bench.fit([bench.start(("sharp",), np.zeros(1))])[0]
    seen = fit.chi2 + float(np.sum(fit.columns**2))  # what it explains when nothing else is there
    nothing = np.empty((0, *bench.samples.y.shape))
    assert members_that_stay(bench, fit, nothing, lambda name: seen / 1.5) is None
    assert members_that_stay(bench, fit, nothing, lambda name: seen / 4.0) is not None


def test_an_effect_that_is_not_linear_is_taken_as_it_was_fitted():
    """Its derivatives miss most of what it does; beside columns that do the same nothing of it is needed."""
    sharp = WHITE.white * (np.arange(COUNT) % 7 == 0) * np.ones((len(SPREAD), 1, 1))
    bench = linear_bench(SPREAD, y=8.0 * sharp, shapes={"steep": sharp})
    fit = bench.fit([bench.start(("steep",), np.zeros(1))])[0]
    steep = replace(fit, columns=5.0 * fit.columns, slopes=5.0 * fit.slopes)  # as of a stop that is touched
    nothing = np.empty((0, *bench.samples.y.shape))
    stays = members_that_stay(bench, steep, nothing, lambda name: THRESHOLD)
    assert stays is not None
    assert stays.vector == fit.vector
    assert members_that_stay(bench, steep, sharp[None], lambda name: THRESHOLD) is None


def test_a_number_that_the_unknown_hides_stays_as_it_was_fitted():
    """A trace of it is left beside the unknown; free, it would be as large as noise makes it."""
    sharp, trace = np.eye(COUNT)[:2]
    target = 5.0 * sharp + 1.0 * trace
    seen = {"edge": _Seen(np.stack([sharp, 1e-3 * trace]), np.ones(2), np.array([4.0, 2.0]))}
    chi2, numbers = _solved(seen, ("edge",), target)
    assert numbers["edge"] == pytest.approx([5.0, 2.0])
    assert chi2 == pytest.approx((1.0 - 2e-3) ** 2)
