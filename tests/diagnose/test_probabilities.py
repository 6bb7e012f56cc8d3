"""What probability a name gets: against its rivals, against nothing, against something unknown."""

from types import SimpleNamespace

import numpy as np
import pytest

from belt_sim.diagnosis.answer.confusable import IMITATED, UNSEEN, probabilities
from belt_sim.diagnosis.choice.decide import ODDS
from belt_sim.diagnosis.left_over.openset import OpenSet

CLEAN = OpenSet((), {}, {}, {})
THRESHOLD = 10.0


def probability(scores, *, inflation=1.0, beside=True, unknown=CLEAN):
    """Of "a", with the scores that each candidate has in its place."""
    trials = [SimpleNamespace(id=i, score=s, plausible=True) for i, s in scores.items()]
    selection = SimpleNamespace(
        swaps={"a": trials}, larger=(), chosen=SimpleNamespace(ids=("a",)), gain=scores["a"] + THRESHOLD,
        threshold=lambda name: THRESHOLD, null=SimpleNamespace(inflation=lambda name: inflation),
    )  # fmt: skip
    return probabilities(selection, unknown, beside=beside)["a"]


def test_likelihood_ratios_of_rivals():
    assert probability({"a": 100.0, "b": 100.0}) == pytest.approx((1.0 - UNSEEN) / 2.0)
    assert probability({"a": 100.0, "b": 96.0}) == pytest.approx((1.0 - UNSEEN) / (1.0 + np.exp(-2.0)))
    assert probability({"a": 1.0}) == pytest.approx((1.0 - UNSEEN) / (1.0 + np.exp(-0.5)))  # hardly more than chance


def test_a_difference_counts_for_less_where_noise_levels_are_uncertain():
    assert probability({"a": 100.0, "b": 96.0}, inflation=2.0) == pytest.approx((1.0 - UNSEEN) / (1.0 + np.exp(-1.0)))
    assert probability({"a": 100.0, "b": 96.0}, inflation=0.6) == probability({"a": 100.0, "b": 96.0})


def test_no_name_is_sure_beside_something_unknown():
    assert probability({"a": 100.0}, beside=False) == pytest.approx(1.0 - IMITATED)
    free = OpenSet(("run r1",), {}, {"run r1": 150.0}, {"run r1": 30.0})  # takes 120 beyond chance, the name 100
    assert probability({"a": 100.0}, beside=False, unknown=free) == pytest.approx(
        (1.0 - IMITATED) / (1.0 + np.exp(10.0))
    )


def test_a_name_beside_another_is_less_sure_of_what_chance_may_have_made():
    """Of machines with a fault one in ten has a second: a second name that beats chance by as much may be none."""
    trials = [SimpleNamespace(id="a", score=ODDS, plausible=True)]
    found = {}
    for ids in (("a",), ("b", "a"), ("b", "c", "a")):
        selection = SimpleNamespace(
            swaps={"a": trials}, larger=(), chosen=SimpleNamespace(ids=ids), gain=100.0,
            threshold=lambda name: THRESHOLD, null=SimpleNamespace(inflation=lambda name: 1.0),
        )  # fmt: skip
        found[len(ids)] = probabilities(selection, CLEAN, beside=True)["a"]
    assert found[1] == pytest.approx((1.0 - UNSEEN) / (1.0 + np.exp(-0.5 * ODDS)))
    assert found[2] == found[3] == pytest.approx((1.0 - UNSEEN) / 2.0)
