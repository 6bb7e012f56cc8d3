"""Beside an effect that changes what noise is taken to be, others are judged by the chance there."""

from dataclasses import replace

import numpy as np
import pytest
from linear_bench import SPREAD, WHITE, linear_bench

from belt_sim.diagnosis.choice.chance import chance_of
from belt_sim.diagnosis.choice.recalibration import Recalibration
from belt_sim.diagnosis.choice.refits import Refits
from belt_sim.diagnosis.left_over.null import NullGains
from belt_sim.diagnosis.noise.noise import Levels

SWOLLEN = 9.0  # times the variance of noise, by which chance was judged before
LEVEL = 0.025


@pytest.fixture
def beside_a():
    """The readings follow a, and b by five sigma; thresholds were made where a passed for noise."""
    rng = np.random.default_rng(1)
    a, b, noise = WHITE.white * rng.normal(size=(3, len(SPREAD), 1, 40))
    b /= np.linalg.norm(b) / WHITE.white
    bench = linear_bench(SPREAD, y=30.0 * a + 5.0 * b + noise, shapes={"a": a, "b": b})
    null = NullGains({n: SWOLLEN * rng.chisquare(1, 500) for n in "ab"}, {"a": 1, "b": 1})
    return Refits(bench, null, null.critical(["a", "b"], LEVEL), chance_of(bench, bench.samples.y, 2))


def recalibrated(refits, white):
    return Recalibration(400, 3, LEVEL, Levels(white=white))(refits, ("a",))


def test_an_effect_that_shows_beside_another_is_not_judged_by_the_noise_without_that(beside_a):
    (b,) = beside_a.trials(("a",))
    assert not b.passes
    after = recalibrated(beside_a, white=3.0)
    (b,) = after.trials(("a",))
    assert b.passes
    assert 5.0 < after.threshold("b") < 10.0  # 5.0 at levels that are known, these are good to a third
    assert after.null.inflation("a") == beside_a.null.inflation("a")  # of what is there already nothing is asked
    assert after.recalibrated.levels == beside_a.bench.levels


def test_thresholds_stay_where_the_noise_does(beside_a):
    assert recalibrated(beside_a, white=1.2) is beside_a


def test_a_set_that_was_moved_to_brings_the_chance_beside_it(beside_a, monkeypatch):
    monkeypatch.setattr(type(beside_a.bench), "moved_to", lambda self, vector: self)  # no nuisances to move
    begun = replace(beside_a, recalibrated=Recalibration(400, 3, LEVEL, Levels(white=3.0)))
    assert begun.moved(("a",)).threshold("b") < 0.3 * begun.threshold("b")


def test_what_does_the_same_as_a_chosen_effect_may_stand_in_its_place(beside_a):
    """Guard: beside its twin it does nothing, and its threshold was once taken to be without end in its place too."""
    shape = beside_a.bench.forward.rows[0]
    b = beside_a.bench.forward.rows[1]
    bench = linear_bench(SPREAD, y=beside_a.bench.samples.y, shapes={"a": shape, "b": b, "twin": 2.0 * shape})
    by_chance = beside_a.null.gains["a"]
    null = NullGains(dict.fromkeys(("a", "b", "twin"), by_chance), dict.fromkeys(("a", "b", "twin"), 1))
    refits = Refits(bench, null, null.critical(["a", "b", "twin"], LEVEL), beside_a.chance)
    after = recalibrated(refits, white=3.0)
    assert after.threshold("twin") == pytest.approx(after.threshold("a"))
    assert after.threshold("b") < after.threshold("a")
