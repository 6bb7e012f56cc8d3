"""The decision on products of columns and readings is the decision on refits; by chance it seldom names anything."""

import numpy as np
import pytest
from linear_bench import SPREAD, WHITE, linear_bench

from belt_sim.diagnosis.choice.chance import chance_of
from belt_sim.diagnosis.choice.decide import decide
from belt_sim.diagnosis.choice.projected import Projected, Range
from belt_sim.diagnosis.choice.refits import Refits
from belt_sim.diagnosis.choice.rehearsal import _Products, rehearse
from belt_sim.diagnosis.fits.around import around
from belt_sim.diagnosis.left_over.null import NullGains, null_gains
from belt_sim.diagnosis.left_over.openset import open_tests

COUNT, REPLICATES = 40, 1000
CLOSE = 0.1  # in chi2: a refit stops when a round gains less than 0.02


def columns():
    """Three effects; b is half of a."""
    rng = np.random.default_rng(1)
    a, other, c = WHITE.white * rng.normal(size=(3, len(SPREAD), 1, COUNT))
    return {"a": a, "b": 0.5 * a + 0.5 * other, "c": c}


def bench_with(sizes, seed=2):
    shapes = columns()
    noise = WHITE.white * np.random.default_rng(seed).normal(size=(len(SPREAD), 1, COUNT))
    y = noise + sum(size * shapes[n] for n, size in sizes.items())
    return linear_bench(SPREAD, y=y, shapes=shapes)


def null_of(names):
    rng = np.random.default_rng(3)
    return NullGains({n: rng.chisquare(1, 2000) for n in names}, dict.fromkeys(names, 1))


def both(bench):
    """Evidence from refits and from products, about the base fit."""
    names = list("abc")
    base = bench.fit([bench.start((), np.zeros(3))])[0]
    null = null_of(names)
    critical = null.critical(names, 0.025)
    refits = Refits(bench, null, critical, chance_of(bench, 0.0 * bench.samples.y, 4), fits={frozenset(): base})
    products = _Products(bench, around(bench, base, names))
    white = base.residual.reshape(len(SPREAD), -1)
    bare = products._centred(bench.samples.y[None])[0]
    shared = Range(
        forward=bench.forward, places=products.places, positions=products.positions, gram=products.gram,
        raw=products.raw, out=products.out, thresholds={n: refits.threshold(n) for n in names},
        noise={n: WHITE.white**2 * products.raw[o].sum(axis=0) for n, o in products.out.items()},
    )  # fmt: skip
    moments, raw = (np.einsum("rm,krm->rk", x, y) for x, y in ((white, products.white), (bare, products.lateral)))
    return refits, Projected(shared, moments, raw)


@pytest.mark.parametrize("sizes", [{}, {"a": 1.0}, {"b": 2.0, "c": -1.0}])
def test_products_say_what_refits_say(monkeypatch, sizes):
    monkeypatch.setattr(Refits, "moved", lambda self, ids: self)  # a sum of shapes has no nuisances to move
    refits, projected = both(bench_with(sizes))
    sets = [("a",), ("b",), ("a", "b"), ("b", "c")]
    np.testing.assert_allclose(projected.gains(sets), refits.gains(sets), atol=CLOSE)
    for ids in sets:
        assert projected.plausible(ids) == refits.plausible(ids)
        assert projected.worse(ids, ()) == refits.worse(ids, ())
    assert set(decide(projected).ids) == set(decide(refits).ids) == set(sizes)


def test_by_chance_the_whole_procedure_seldom_finds_anything():
    bench = bench_with({})
    names = list("abc")
    base = bench.fit([bench.start((), np.zeros(3))])[0]
    near = around(bench, base, names)
    shapes = {n: near.shapes(bench, n) for n in names}
    null = null_gains(bench, shapes, base.slopes, base.values, count=REPLICATES, seed=7)
    found = rehearse(
        bench, near, null, null.critical(names, 0.025),
        open_tests(bench, base, bootstraps=REPLICATES, seed=5), count=REPLICATES, seed=6,
    )  # fmt: skip
    assert found.count == REPLICATES
    assert found.named + found.unknown > 0
    assert found.rate < 0.06  # 4 % aimed at, and three sigma of a thousand
