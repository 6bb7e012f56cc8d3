"""What is told beside a chosen effect: the likeliest in its place, and sets of one effect more that come near."""

from types import SimpleNamespace

import numpy as np
import pytest
from linear_bench import SPREAD, WHITE, linear_bench

from belt_sim.diagnosis.answer.confusable import HELD, PERHAPS, probabilities, rivals
from belt_sim.diagnosis.choice.chance import Chance
from belt_sim.diagnosis.choice.decide import ODDS
from belt_sim.diagnosis.choice.larger import larger
from belt_sim.diagnosis.choice.refits import Refits
from belt_sim.diagnosis.fits.around import Around
from belt_sim.diagnosis.left_over.null import NullGains
from belt_sim.diagnosis.left_over.openset import OpenSet

CLEAN = OpenSet((), {}, {}, {})
THRESHOLD = 10.0


def trial(ids: str, score: float, *, plausible: bool = True):
    fit = SimpleNamespace(ids=tuple(ids), chi2=-score)
    return SimpleNamespace(id=" + ".join(ids), score=score, plausible=plausible, fit=fit)


def selection(singles, sets=(), inflation=1.0):
    """Where "a" alone is chosen; scores of what could stand in its place, and of sets of one effect more."""
    score = singles["a"].score
    return SimpleNamespace(
        swaps={"a": list(singles.values())}, larger=sets, chosen=SimpleNamespace(ids=("a",), chi2=-score),
        gain=score + THRESHOLD, threshold=lambda name: THRESHOLD,
        null=SimpleNamespace(inflation=lambda name: inflation),
    )  # fmt: skip


def others(scores, sets=None, inflation=1.0):
    singles = {i: trial(i, s) for i, s in scores.items()}
    found = rivals(selection(singles, [trial(i, s) for i, s in (sets or {}).items()], inflation))
    assert {r.effect for r in found} <= {"a"}
    return [r.other for r in found]


def test_those_are_told_that_hold_enough_of_the_probability():
    """Weights 1, 0.37, 0.14, 0.01 of 1.51: the first three hold 99 %, the first two 90 %."""
    assert others({"a": 100.0, "b": 98.0, "c": 96.0, "d": 91.0}) == ["b", "c"]
    assert others({"a": 100.0, "d": 93.0}) == []  # 97 % without it
    assert np.exp(-3.5) / (1.0 + np.exp(-3.5)) < 1.0 - HELD


def test_more_are_told_where_noise_levels_are_uncertain():
    assert others({"a": 100.0, "d": 93.0}, inflation=2.0) == ["d"]


def test_a_set_of_one_effect_more_is_told_where_it_nearly_pays_for_itself():
    near, far = 100.0 - PERHAPS + 0.1, 100.0 - PERHAPS - 0.1
    assert others({"a": 100.0}, {"ab": near, "cd": near, "ae": far, "ef": far}) == ["a + b", "c + d"]
    assert others({"a": 100.0}, {"ab": 100.0 - 1.9 * PERHAPS}, inflation=2.0) == ["a + b"]


def test_a_pair_in_its_place_takes_probability_from_a_name_and_one_with_it_does_not():
    singles = {"a": trial("a", 100.0)}
    alone = probabilities(selection(singles), CLEAN, beside=True)["a"]
    with_it = probabilities(selection(singles, [trial("ab", 98.0)]), CLEAN, beside=True)["a"]
    without = probabilities(selection(singles, [trial("bc", 98.0)]), CLEAN, beside=True)["a"]
    impossible = probabilities(selection(singles, [trial("bc", 98.0, plausible=False)]), CLEAN, beside=True)["a"]
    assert alone == with_it == impossible
    assert without == pytest.approx(alone / (1.0 + np.exp(-1.0 - 0.5 * ODDS)))


def test_a_pair_that_one_look_alike_stands_for_is_fitted_and_compared():
    """The readings follow b and c; a is nearly their sum, and d, e are nothing like them."""
    rng = np.random.default_rng(7)
    b, c, d, e, other = WHITE.white * rng.normal(size=(5, len(SPREAD), 1, 40))
    shapes = {"a": b + c + 0.1 * other, "b": b, "c": c, "d": d, "e": e}
    bench = linear_bench(SPREAD, y=1.5 * (b + c), shapes=shapes)
    base = bench.fit([bench.start((), bench.forward.null())])[0]
    by_chance = np.random.default_rng(3).chisquare(1, 500)
    null = NullGains(dict.fromkeys(shapes, by_chance), dict.fromkeys(shapes, 1))
    near = Around(base, dict(enumerate(shapes.values())), {})
    refits = Refits(bench, null, null.critical(list(shapes), 0.01), Chance({}), near, fits={frozenset(): base})
    sets = {t.id: t for t in larger(refits, ("a",))}
    assert set(sets) == {"b + c", *"bcde"}  # and each beside a, though nobody had tried these
    assert [set(sets[i].fit.ids) for i in "bcde"] == [{"a", i} for i in "bcde"]
    known = np.stack([b.ravel(), c.ravel()], axis=1)
    left = bench.metric.chi2(bench.fitted.y - np.reshape(known @ [1.5, 1.5], bench.fitted.y.shape))
    assert sets["b + c"].gain == pytest.approx(base.chi2 - left, abs=0.05)
    assert sets["b + c"].threshold == pytest.approx(2.0 * refits.threshold("b"))
    assert larger(refits, ()) == []
