"""The decision, tested by tables: every threshold of the policy has a case on either side of it."""

from dataclasses import replace
from math import exp, log

import numpy as np
import pytest

from belt_sim.diagnosis.decide import (
    POLICY,
    EvidenceTable,
    LawEvidence,
    OtherModel,
    Policy,
    Row,
    UnknownEvidence,
    decide,
    explanations,
    log_evidence,
    needed_gain,
    occam,
    would_show,
)
from belt_sim.results.diagnosis import Verdict

CANDIDATES = 30
NO_COURSE = UnknownEvidence(ids=frozenset(), courses=np.zeros(60), laws=(), tried=7000.0)


def row(*ids: str, gain: float = 0.0, plausible: bool = True, rise: float = 0.0, sigmas: float = 3.0) -> Row:
    """Effects of one number each, whose best fit gains ``gain``; a number is known to a hundredth of what may be."""
    k = len(ids)
    return Row(
        ids=frozenset(ids),
        chi2=1000.0 - gain,
        gram=1e4 * np.eye(k),
        away=np.full(k, 0.01 * sigmas),
        sigma=np.ones(k),
        owner=ids,
        sized=np.ones(k, dtype=bool),
        plausible=plausible,
        held_out={"7 N/mm2": rise},
    )


def table(*rows: Row, **more) -> EvidenceTable:
    return EvidenceTable(candidates=CANDIDATES, inflation=1.0, damaged=False, rows=(row(), *rows), **more)


def unknown(evidence: float, *beside: str) -> UnknownEvidence:
    """A course at one of 60 places whose evidence is ``log_evidence`` more than none, all paid."""
    courses = np.full(60, -np.inf)
    courses[0] = evidence + POLICY.chance + log(60.0)
    return replace(NO_COURSE, ids=frozenset(beside), courses=courses)


def test_an_effect_is_named_once_nothing_is_improbable():
    one = row("crown")
    enough = needed_gain(one, table(one), POLICY) + 2.0 * log(1.0 / POLICY.alarm - 1.0)
    named = [decide(table(row("crown", gain=enough + more)), POLICY) for more in (-0.2, 0.2)]
    assert [d.verdict for d in named] == [Verdict.ADEQUATE, Verdict.EXPLAINED]
    assert named[1].named["crown"] == pytest.approx(1.0 - POLICY.alarm, abs=0.01)


def test_a_second_fault_must_earn_its_odds():
    one = row("crown", gain=100.0)
    both = row("crown", "taper")
    less = needed_gain(both, table(both), POLICY) - needed_gain(one, table(one), POLICY)
    sets = [decide(table(one, row("crown", "taper", gain=100.0 + less + more)), POLICY).named for more in (-1.0, 1.0)]
    assert [set(s) for s in sets] == [{"crown"}, {"crown", "taper"}]
    pairs = CANDIDATES * (CANDIDATES - 1) / 2
    assert less == pytest.approx(2.0 * (log(pairs / CANDIDATES) + log(POLICY.further) + _cost(both) - _cost(one)))


def _cost(r: Row) -> float:
    return occam(r, 1.0, POLICY)


def test_a_number_costs_what_the_readings_could_have_seen_of_it():
    """A Gaussian prior of one sigma, seen to a thousandth of it, costs log 1000 and half the square of the number."""
    grid = replace(row("weld"), gram=np.array([[1e6]]), away=np.array([1.5]), sized=np.array([False]))
    assert occam(grid, 1.0, POLICY) == pytest.approx(log(1000.0) + 0.5 * 1.5**2, rel=1e-5)


def test_a_scanned_number_pays_for_the_values_that_were_tried():
    plain = row("weld")
    assert occam(replace(plain, scanned=(12, 5)), 1.0, POLICY) - occam(plain, 1.0, POLICY) == pytest.approx(log(60.0))


def test_the_order_of_magnitude_of_a_size_costs_the_same_wherever_it_lies():
    """A size of ten sigma costs as much where the readings are ten times sharper: Lindley's paradox is none here."""
    sizes = [replace(row("crown"), gram=np.array([[g]]), away=np.array([10.0 / np.sqrt(g)])) for g in (1e4, 1e6)]
    assert occam(sizes[0], 1.0, POLICY) == pytest.approx(occam(sizes[1], 1.0, POLICY), abs=0.1)


def test_what_no_machine_has_and_what_predicts_worse_is_no_answer():
    held = [row("crown", gain=100.0, rise=POLICY.held_out + off) for off in (-0.1, 0.1)]
    verdicts = [decide(table(r), POLICY).verdict for r in (*held, row("crown", gain=100.0, plausible=False))]
    assert verdicts == [Verdict.EXPLAINED, Verdict.ADEQUATE, Verdict.ADEQUATE]
    refused = explanations(table(held[1]), POLICY)[-1]
    assert refused.refused
    assert refused.probability == 0.0


def test_something_unknown_is_told_where_it_is_likelier():
    crown = row("crown", gain=100.0)
    worth = 0.5 * 100.0 - 0.5 * needed_gain(crown, table(crown), POLICY)
    for more, verdict in ((-1.0, Verdict.EXPLAINED), (1.0, Verdict.NONE_KNOWN)):
        seen = unknown(worth + log(POLICY.unknown) + more)
        assert decide(table(crown, unknown=(seen,)), POLICY).verdict is verdict


def test_what_only_adds_to_readings_is_named_beside_the_unknown_and_nothing_else_is():
    both = row("crown", gain=100.0), row("sensor_drift", gain=100.0)
    seen = tuple(unknown(80.0, *r.ids) for r in both)
    additive = frozenset({"sensor_drift"})
    verdicts = [decide(table(r, unknown=(b,), additive=additive), POLICY) for r, b in zip(both, seen, strict=True)]
    assert [d.verdict for d in verdicts] == [Verdict.NONE_KNOWN, Verdict.PARTLY]
    assert set(verdicts[1].named) == additive


def test_the_best_of_many_laws_pays_for_their_number():
    law = LawEvidence(gain=60.0, cost=0.0, sizes=1)
    few, many = (log_evidence(replace(NO_COURSE, laws=(law,), tried=n), 1.0, POLICY) for n in (100.0, 10000.0))
    assert few - many == pytest.approx(log(100.0), abs=0.05)


def test_sets_that_hold_95_percent_are_told_and_no_more():
    rows = [row(n, gain=100.0 - 2.0 * behind) for n, behind in (("a", 0.0), ("b", 1.0), ("c", 2.0), ("d", 5.0))]
    decision = decide(table(*rows), POLICY)
    shares = np.exp(-np.array([0.0, 1.0, 2.0, 5.0]))
    assert decision.named["a"] == pytest.approx(shares[0] / shares.sum(), rel=1e-6)
    assert decision.confusable == {"a": (("b",), ("c",))}
    assert shares[:3].sum() / shares.sum() > POLICY.credible > shares[:2].sum() / shares.sum()


def test_a_pair_in_the_place_of_a_pair_is_told_of_both_members():
    """A tail yaw offset with a taper is a pair of tapers on a stiff span."""
    decision = decide(table(row("a", "b", gain=200.0), row("c", "d", gain=199.0)), POLICY)
    assert decision.confusable == {"a": (("c", "d"),), "b": (("c", "d"),)}


@pytest.mark.parametrize(
    ("named", "alike"),
    [
        (("crown", "tension_bias"), ("crown", "tension_bias")),
        (("taper", "tension_bias"), ("tension_bias",)),
        (("crown", "taper"), ()),
    ],
)
def test_an_error_of_the_load_cell_may_be_one_change_of_the_span(named, alike):
    decision = decide(table(row(*named, gain=200.0)), POLICY)
    assert decision.like_one_change_of_the_span(POLICY) == alike


def test_another_base_model_is_told_of_instead_of_effects():
    other = OtherModel(name="model=strip", chi2=900.0)
    decision = decide(table(row("crown", gain=100.0), other_models=(other,)), POLICY)
    assert (decision.verdict, decision.instead) == (Verdict.NONE_KNOWN, "model=strip")
    assert decide(table(row("crown", gain=140.0), other_models=(other,)), POLICY).verdict is Verdict.EXPLAINED


def test_a_law_is_sought_where_the_linear_range_cannot_tell_it_from_effects():
    """Effects that gain 2000 are in doubt by 100 nats where something unknown does without one of them."""
    pair = row("crown", "taper", gain=2000.0)
    worth = explanations(table(pair), POLICY)[0].log_posterior + log(POLICY.unknown)
    asked = []
    for behind in (99.0, 101.0):
        asked_of = table(pair, unknown=(unknown(worth - behind), unknown(-7.0, "crown", "taper")))
        decision = decide(asked_of, POLICY)
        assert decision.verdict is Verdict.EXPLAINED
        asked.append(decision.suspects_something_unknown(asked_of, POLICY))
    assert asked == [True, False]


def test_a_search_raises_the_rows_of_its_law_alone_and_the_more_the_law_gains():
    """What leaving a search out rests on."""
    pair, asked = row("crown", "taper", gain=2000.0), []
    for gain in (0.0, 500.0, 1000.0, 2000.0, 4000.0):
        law = LawEvidence(gain=gain, cost=26.0, sizes=2)
        found = explanations(
            table(pair, unknown=(replace(NO_COURSE, laws=(law,)), unknown(3.0, "crown", "taper"))), POLICY
        )
        asked.append({(e.effects, e.unknown): e.log_posterior for e in found})
    lifted = [odds.pop(((), True)) for odds in asked]
    assert lifted == sorted(lifted)
    assert lifted[-1] > lifted[0] + 1000.0
    assert all(odds == asked[0] for odds in asked)


def test_no_law_is_sought_for_a_row_that_the_search_cannot_change():
    """A law is fitted beside nothing or beside effects that only add to the readings: a row with another effect stays
    as it is, however close it comes."""
    whole, alone = row("bow", "camber", "crown", "taper", gain=2000.0), row("crown", gain=1000.0)
    best, other = explanations(table(whole, alone), POLICY)[:2]
    behind = best.log_posterior - other.log_posterior + log(POLICY.unknown * POLICY.further) - 5.0
    for additive, law in ((frozenset(), False), (frozenset(["crown"]), True)):
        known = unknown(behind, "crown"), unknown(-7.0, "bow", "camber", "crown", "taper")
        asked_of = table(whole, alone, unknown=known, additive=additive)
        decision = decide(asked_of, POLICY)
        assert decision.probability_of_unknown < POLICY.alarm
        assert decision.suspects_something_unknown(asked_of, POLICY) is law


def test_no_law_is_sought_that_could_not_win_if_it_were_as_good_as_the_effects():
    """One effect pays less for one number than a law does for its form."""
    one, near = row("crown", gain=2000.0), unknown(970.0)
    for seen, sought in ((-7.0, False), (20.0, True)):
        asked_of = table(one, unknown=(near, unknown(seen, "crown")), additive=frozenset())
        decision = decide(asked_of, POLICY)
        if seen < 0.0:  # else something unknown is likely beside it
            assert decision.probability_of_unknown < POLICY.alarm
        assert decision.suspects_something_unknown(asked_of, POLICY) is sought


def test_a_law_that_cannot_reach_the_alarm_is_not_worth_a_march():
    """Effects that gain 2000 and leave noise: no law explains more, and one that explains 200 less is far behind."""
    pair, beside = row("crown", "taper", gain=2000.0), replace(NO_COURSE, ids=frozenset(["crown", "taper"]))
    asked_of = table(pair, unknown=(NO_COURSE, beside))
    decision = decide(asked_of, POLICY)
    assert decision.most_of_a_law(asked_of, frozenset()) == 2000.0
    law = LawEvidence(gain=2000.0, cost=0.0, sizes=1)
    worth = [
        decision.could_change(asked_of, frozenset(), [replace(law, gain=law.gain - less)], POLICY)
        for less in (0.0, 200.0)
    ]
    assert worth == [True, False]


def test_a_law_may_explain_what_is_seen_beside_the_effects():
    """A free input, which has 30 nats of evidence before it pays for its choice, or a law, less what its form costs."""
    pair = row("crown", "taper", gain=2000.0)
    nothing = replace(NO_COURSE, ids=pair.ids)
    law = LawEvidence(gain=70.0, cost=6.0, sizes=1)
    for seen, most in (
        ((NO_COURSE, nothing), 2000.0),
        ((NO_COURSE, replace(nothing, courses=np.array([30.0, 0.0]))), 2060.0),
        ((NO_COURSE, replace(nothing, laws=(law,))), 2064.0),
        ((NO_COURSE,), row().chi2),
    ):
        asked_of = table(pair, unknown=seen)
        assert decide(asked_of, POLICY).most_of_a_law(asked_of, frozenset()) == most


@pytest.mark.parametrize(
    ("effects", "inflation", "near", "beside", "cost"),
    [
        (("crown", "taper"), 1.5, 1996.0, 20.0, 3.0),
        (("crown", "taper"), 1.5, 1990.0, 25.0, 6.0),
        (("crown", "taper"), 1.2, 1990.0, 20.0, 6.0),
        (("crown", "taper"), 2.0, 1996.0, 30.0, 6.0),
        (("crown",), 1.0, 1940.0, 30.0, 3.0),
    ],
)
def test_a_law_that_would_win_by_what_it_explains_beside_the_effects_is_sought(effects, inflation, near, beside, cost):
    """A law is seen beside effects, too weak to be told; in their place it explains what they do and this."""
    known = row(*effects, gain=2000.0)
    law = LawEvidence(gain=near, cost=cost, sizes=1)
    rest = replace(NO_COURSE, ids=known.ids, laws=(replace(law, gain=beside),))
    asked_of = replace(table(known, unknown=(replace(NO_COURSE, laws=(law,)), rest)), inflation=inflation)
    decision = decide(asked_of, POLICY)
    assert decision.verdict is Verdict.EXPLAINED
    assert decision.probability_of_unknown < POLICY.alarm
    assert decision.suspects_something_unknown(asked_of, POLICY)
    in_march = replace(law, gain=2000.0 + beside)
    assert decision.could_change(asked_of, frozenset(), [in_march], POLICY)
    found = replace(asked_of, unknown=(replace(NO_COURSE, laws=(law, in_march)), rest))
    assert decision.most_probable_unknown(asked_of, frozenset(), POLICY) >= decide(found, POLICY).probability_of_unknown


def test_readings_that_could_show_nothing_do_not_say_that_nothing_is_missing():
    verdicts = [decide(table(visible=frozenset(ids)), POLICY).verdict for ids in ("", "a")]
    assert verdicts == [Verdict.CANNOT_SAY, Verdict.ADEQUATE]


def test_an_effect_would_show_where_its_largest_size_is_told():
    one = row("crown")
    told = needed_gain(one, table(one), POLICY) + 2.0 * log(1.0 / POLICY.alarm - 1.0)
    sizes = [replace(one, gram=np.array([[told * f]]), away=np.zeros(1)) for f in (0.2, 5.0)]
    assert [would_show(r, table(r), POLICY) for r in sizes] == [False, True]


def test_damaged_data_name_nothing():
    assert decide(replace(table(row("crown", gain=100.0)), damaged=True), POLICY).verdict is Verdict.CANNOT_SAY


def test_uncertain_noise_makes_every_difference_count_less():
    sharp, blunt = (replace(table(row("crown", gain=30.0)), inflation=i) for i in (1.0, 2.0))
    assert decide(sharp, POLICY).verdict is Verdict.EXPLAINED
    assert decide(blunt, POLICY).verdict is Verdict.ADEQUATE


def test_probabilities_follow_from_the_columns():
    """log odds = likelihood - occam + unknown + prior: a pocket calculator will do."""
    crown, taper = row("crown", gain=20.0), row("taper", gain=16.0)
    found = explanations(table(crown, taper, unknown=(unknown(1.0),)), POLICY)
    odds = [e.likelihood - e.occam + e.unknown_evidence + e.prior for e in found]
    whole = sum(map(exp, odds))
    assert [e.probability for e in found] == pytest.approx([exp(o) / whole for o in odds])
    assert odds == sorted(odds, reverse=True)


@pytest.mark.parametrize("change", [{"further": 1e6}, {"unknown": 1e9}, {"alarm": 1e-9}, {"held_out": -1.0}])
def test_every_constant_moves_a_decision(change):
    """Guard: constants that could be changed grossly with all tests passing."""
    cases = [
        table(row("crown", gain=100.0), row("crown", "taper", gain=130.0)),
        table(row("crown", gain=24.0)),
        table(unknown=(unknown(8.0),)),
    ]
    before, after = (
        [(d.verdict, set(d.named)) for d in (decide(t, p) for t in cases)] for p in (POLICY, Policy(**change))
    )
    assert before != after


def test_effects_that_fit_alike_are_a_tie_and_a_likely_one_is_none():
    three = [row(name, gain=200.0) for name in ("taper", "idler_skew", "side_drag")]
    tie = decide(table(*three), POLICY)
    assert tie.verdict is Verdict.EXPLAINED
    assert sorted(t.effects for t in tie.tied(POLICY)) == [("idler_skew",), ("side_drag",), ("taper",)]
    likely = decide(table(row("taper", gain=220.0), *three[1:]), POLICY)
    assert likely.explanations[0].probability > POLICY.likely
    assert likely.tied(POLICY) == ()
    between = decide(table(row("taper", gain=203.0), *three[1:]), POLICY)  # likelier than not, and not likely
    assert 0.5 < between.named["taper"] < POLICY.likely
    assert len(between.tied(POLICY)) == 3


def test_an_effect_of_every_likely_explanation_is_told_beside_something_unknown():
    both = row("wobble", gain=900.0), row("wobble", "taper", gain=903.0)
    found = decide(table(*both, unknown=(unknown(60.0, "wobble"), unknown(60.0, "wobble", "taper"))), POLICY)
    assert found.tells_of_unknown
    assert found.in_every_explanation(POLICY) == ("wobble",)
    alone = decide(table(*both, unknown=(unknown(800.0), unknown(60.0, "wobble"))), POLICY)
    assert alone.in_every_explanation(POLICY) == ()
