"""The score as a pure function: what a verdict is, given a table of evidence written by hand."""

import json
from dataclasses import replace
from itertools import combinations
from math import comb, log

import numpy as np
import pytest

from belt_sim.results.verdict import Verdict
from studies.score.decide import credible, decide, evidence, free_size, occam, scores
from studies.score.policy import Policy
from studies.score.table import Beyond, Law, Row, Table
from studies.score.table_json import as_json, from_json

POLICY = Policy()
CANDIDATES = 30
KNOWN = 100.0  # one over the square of a number's sigma, in units of what is plausible
ROUNDED = 1e-6


def row(gains, held=-5.0, plausible=True, inverse=KNOWN):
    """A set of effects of one number each that do different things: effect -> chi2 gain."""
    size = np.sqrt(np.array([*gains.values()]) / inverse)
    return Row(
        ids=frozenset(gains),
        chi2=1000.0 - sum(gains.values()),
        gram=inverse * np.eye(len(gains)),
        away=size,
        sigma=np.ones(len(gains)),
        owner=tuple(gains),
        sized=np.ones(len(gains), dtype=bool),
        plausible=plausible,
        held_out={"10 N/mm2": held if gains else 0.0},
    )


def table(gains, *, beyond=(), inflation=1.0, **each):
    """All subsets of effects that do different things."""
    sets = [s for k in range(len(gains) + 1) for s in combinations(gains, k)]
    rows = tuple(row({i: gains[i] for i in s}, **each) if s else row({}) for s in sets)
    return Table(candidates=CANDIDATES, inflation=inflation, damaged=False, rows=rows, beyond=beyond)


def seen(course, beside=(), law=0.0):
    laws = (Law(words="a", gain=law, cost=3.0, sizes=1),)
    return Beyond(beside=frozenset(beside), courses=np.full(60, course), laws=laws, tried=7000.0)


def test_nothing_is_missing_unless_the_readings_move_the_odds():
    gains = [4.0, 9.0, 36.0, 144.0]  # d = 2, 3, 6 and 12
    found = [decide(table({"a": g}), POLICY) for g in gains]
    assert [d.verdict for d in found] == [Verdict.ADEQUATE, Verdict.ADEQUATE, Verdict.EXPLAINED, Verdict.EXPLAINED]
    alone = [d.probability[frozenset("a"), False] for d in found]
    assert alone == sorted(alone)
    assert found[-1].named["a"] > 0.99


def test_one_fault_more_has_to_pay_for_itself():
    assert set(decide(table({"a": 100.0, "b": 4.0}), POLICY).named) == {"a"}
    assert set(decide(table({"a": 100.0, "b": 60.0}), POLICY).named) == {"a", "b"}
    without = scores(table({"a": 100.0, "b": 60.0}), POLICY)
    cost = occam(row({"a": 100.0, "b": 60.0}), 1.0, POLICY) - occam(row({"a": 100.0}), 1.0, POLICY)
    more = without[frozenset("ab"), False] - without[frozenset("a"), False]
    assert more == pytest.approx(30.0 - cost - log(POLICY.further) - log(comb(CANDIDATES, 2) / CANDIDATES))


def test_look_alikes_share_the_probability_and_are_told():
    rows = (row({}), row({"a": 60.0}), row({"b": 58.0}), row({"c": 30.0}))
    found = decide(Table(candidates=CANDIDATES, inflation=1.0, damaged=False, rows=rows, beyond=()), POLICY)
    assert found.confusable == {"a": ("b",)}
    assert found.named["a"] == pytest.approx(1.0 / (1.0 + np.exp(-1.0)), abs=0.02)  # a likelihood ratio of e


def test_units_of_a_number_do_not_matter():
    one = row({"a": 40.0, "b": 20.0})
    other = replace(one, gram=one.gram / 1e6, away=one.away * 1e3, sigma=one.sigma * 1e3)
    assert occam(one, 1.0, POLICY) == pytest.approx(occam(other, 1.0, POLICY), rel=ROUNDED)


def test_what_a_number_costs_hardly_depends_on_what_is_plausible():
    """A Gaussian as wide as what is plausible would cost 4.6 nats more for a range a hundred times as wide."""
    narrow, wide = (occam(row({"a": 36.0}, inverse=k), 1.0, POLICY) for k in (1e3, 1e7))
    assert abs(wide - narrow) < 1.0


def test_an_unknown_wins_where_names_explain_less():
    assert decide(table({"a": 40.0}, beyond=(seen(5.0),)), POLICY).verdict is Verdict.EXPLAINED
    assert decide(table({"a": 40.0}, beyond=(seen(60.0),)), POLICY).verdict is Verdict.NONE_KNOWN
    assert decide(table({"a": 40.0}, beyond=(seen(0.0, law=140.0),)), POLICY).verdict is Verdict.NONE_KNOWN
    assert decide(table({}, beyond=(seen(3.0),)), POLICY).verdict is Verdict.ADEQUATE


def test_beside_an_unknown_only_what_adds_to_the_readings_keeps_its_name():
    both = table({"a": 200.0}, beyond=(seen(20.0), seen(60.0, "a")))
    assert decide(both, POLICY).verdict is Verdict.NONE_KNOWN
    found = decide(replace(both, steadfast=frozenset("a")), POLICY)
    assert found.verdict is Verdict.PARTLY
    assert set(found.named) == {"a"}


def test_what_predicts_worse_and_what_no_machine_has_is_not_named():
    assert decide(table({"a": 60.0}, held=POLICY.held_out + 0.1), POLICY).verdict is Verdict.ADEQUATE
    assert decide(table({"a": 60.0}, plausible=False), POLICY).verdict is Verdict.ADEQUATE


def test_nothing_is_said_of_damaged_data():
    assert decide(replace(table({"a": 60.0}), damaged=True), POLICY).verdict is Verdict.CANNOT_SAY


def test_uncertain_noise_makes_evidence_weaker():
    found = [scores(table({"a": 60.0}, inflation=t), POLICY)[frozenset("a"), False] for t in (1.0, 2.0)]
    assert found[1] < 0.6 * found[0]


def test_sizes_of_unknown_scale_cost_the_logarithm_of_what_they_gain():
    """One size: the evidence falls short of half the gain by log(sqrt(gain)) and the choice of a scale."""
    short = [0.5 * g - free_size(g, 1, POLICY) for g in (100.0, 10_000.0)]
    assert short[1] - short[0] == pytest.approx(log(10.0), abs=0.5)
    assert evidence(seen(0.0), 1.0, POLICY) < 0.0


def test_the_credible_set_is_the_smallest_that_holds_enough():
    share = {(frozenset(n), False): p for n, p in {"a": 0.6, "b": 0.3, "c": 0.06, "d": 0.04}.items()}
    assert credible(share, POLICY) == [frozenset("a"), frozenset("b"), frozenset("c")]


def test_a_kept_table_decides_the_same():
    one = replace(table({"a": 60.0, "b": 20.0}, beyond=(seen(3.0), seen(60.0, "a"))), steadfast=frozenset("a"))
    content = json.loads(json.dumps(as_json(one), allow_nan=False))
    assert decide(from_json(content), POLICY) == decide(one, POLICY)
