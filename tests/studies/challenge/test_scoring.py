"""Every outcome that a campaign can have, every figure that is counted from it, and what is published."""

import pytest
from scored import DIRT, facts, result, truth
from small_challenge import answer_of

from studies.challenge.report import reliability
from studies.challenge.score import error_removed, generator_place, pairs, score_case
from studies.challenge.targets import Share, confidently_wrong, targets


def aliased(name: str, other: str):
    answer = answer_of(name)
    answer["effects"][0]["confusable_with"] = [other]
    return answer


@pytest.mark.parametrize(
    ("hidden", "answer", "outcome"),
    [
        (truth("nothing"), answer_of(), "right"),
        (truth("nothing"), answer_of("taper"), "wrong"),
        (truth("nothing"), answer_of(verdict="none_known"), "wrong"),
        (truth("stated"), answer_of(), "right"),
        (truth("below_noise", "taper"), answer_of(), "right"),
        (truth("below_noise", "taper"), answer_of("taper"), "right"),
        (truth("below_noise", "taper"), answer_of("cant"), "wrong"),
        (truth("library", "taper"), answer_of("taper"), "right"),
        (truth("library", "taper"), answer_of("taper", verdict="partly"), "right"),
        (truth("library", "taper"), answer_of("taper", "cant", verdict="partly"), "beside"),
        (truth("library", "taper"), answer_of(), "missed"),
        (truth("library", "taper"), answer_of(verdict="none_known"), "unnamed"),
        (truth("library", "taper"), answer_of(verdict="cannot_say"), "wrong"),
        (truth("library", "taper"), aliased("cant", "taper"), "alias"),
        (truth("library", "taper"), answer_of("cant"), "wrong"),
        (truth("library", "taper", lookalikes=["cant"]), answer_of("cant"), "lookalike"),
        (truth("two", "taper", "cant"), answer_of("cant", "taper"), "right"),
        (truth("two", "taper", "cant"), answer_of("cant"), "part"),
        (truth("two", "taper", "cant"), answer_of("cant", "crown"), "wrong"),
        (truth("two", "taper", "cant"), aliased("crown", "cant + taper"), "part"),
        (truth("two", "taper", "cant"), aliased("cant", "cant + taper"), "part"),
        (truth("two", "taper", "cant"), aliased("cant", "taper"), "part"),
        (truth("two", "taper", "cant"), aliased("crown", "taper + slip"), "wrong"),
        (truth("library", "taper"), aliased("cant", "taper + slip"), "wrong"),
        (truth("library", "taper"), aliased("taper", "taper + slip"), "right"),
        (truth("outside", "creep", distance=10.0), answer_of(verdict="none_known"), "right"),
        (truth("outside", "creep", distance=10.0), answer_of("cant", verdict="partly"), "wrong"),
        (truth("outside", "creep", distance=10.0), answer_of("cant"), "wrong"),
        (truth("outside", "creep", distance=10.0), answer_of(), "missed"),
        (truth("dirty", dirty=DIRT), answer_of(verdict="cannot_say"), "right"),
        (truth("dirty", dirty=DIRT), answer_of(), "wrong"),
        (truth("dirty", dirty=DIRT), {"verdict": "crash", "effects": [], "sentence": "x"}, "crash"),
        (truth("library", "taper"), {"verdict": "crash", "effects": [], "sentence": "x"}, "crash"),
        (None, {"verdict": "crash", "effects": [], "sentence": "x"}, "crash"),
    ],
)
def test_outcomes(hidden, answer, outcome):
    assert facts(hidden, answer).outcome == outcome


def test_effects_that_stand_together_count_one_by_one():
    """Towards the size of a confusable set, and as names that may be false."""
    pair = facts(truth("two", "taper", "cant"), aliased("crown", "cant + taper"))
    assert pair.answer_set == {"crown", "cant", "taper"}
    assert not confidently_wrong(pair)
    assert confidently_wrong(facts(truth("library", "taper"), aliased("cant", "taper + slip")))


def test_advice_counts_by_what_it_promises():
    """Five sigma tell a pair apart in 97 of 100 campaigns; three do in seven of ten, however right they are."""
    kept = [(9.0, True), (5.0, True), (4.9, False), (3.1, True), (3.0, False)]
    results = [
        result(truth("library", "taper"), answer_of("taper"), advice={"resolved": r, "sigma_after": s}) for s, r in kept
    ]
    rows = [score_case(r) for r in results] + [facts(truth("library", "taper"), answer_of("taper"))]
    found = {t.name: (t.found.count, t.found.trials) for t in targets(rows) if "advice" in t.name}
    assert list(found.values()) == [(2, 2), (1, 3)]


def suspicion(run, signal):
    return {"run": run, "signal": signal, "kind": "dropout", "sentence": "", "severity": "look"}


def test_dirt_is_caught_where_it_is_and_not_elsewhere():
    seen = answer_of() | {"suspicions": [suspicion("r02", "y1")]}
    elsewhere = answer_of() | {"suspicions": [suspicion("r03", "y1")]}
    assert facts(truth("dirty", dirty=DIRT), seen).outcome == "right"
    assert facts(truth("dirty", dirty=DIRT), elsewhere).outcome == "wrong"


def test_confidence_is_counted_by_name_and_probability():
    beside = truth("library", "taper")
    assert confidently_wrong(facts(beside, answer_of("taper", "cant")))
    assert not confidently_wrong(facts(beside, answer_of("taper", "cant", probability=0.8)))
    assert not confidently_wrong(facts(beside, aliased("cant", "taper")))
    assert not confidently_wrong(facts(beside, answer_of(verdict="none_known")))


def estimated(low: float, high: float, verdict: str = "explained"):
    answer = answer_of("taper", verdict=verdict)
    answer["effects"][0]["parameters"] = {"a": {"interval_95": [low, high]}, "b": {"interval_95": [-1.0, 1.0]}}
    return answer


def test_intervals_are_held_against_the_true_values():
    hidden = truth("library", "taper")
    assert facts(hidden, estimated(1.9, 2.1)).covered == [True, True]
    assert facts(hidden, estimated(2.1, 2.3)).covered == [False, True]
    assert facts(hidden, estimated(1.9, 2.1, verdict="partly")).covered == []
    assert facts(truth("library", "cant"), estimated(1.9, 2.1)).covered == []


def error(before: float, after: float, floor: float = 0.1):
    return {"error": {"held_out": {"before_mm": before, "after_mm": after}, "noise_floor_mm": floor}}


def test_the_reducible_error_is_what_exceeds_the_floor():
    hidden = truth("library", "taper")
    assert facts(hidden, answer_of("taper") | error(1.1, 0.2)).removed == pytest.approx(0.9)
    assert facts(hidden, answer_of("taper") | error(1.1, 1.2)).removed == pytest.approx(-0.1)
    assert facts(hidden, answer_of("taper") | error(0.105, 0.1)).removed is None
    beside = {"before_mm": 0.5, "after_mm": 0.3, "noise_floor_mm": 0.1}
    told = error(1.1, 1.2)["error"] | {"beside_settings": beside}
    assert facts(hidden, answer_of("taper") | {"error": told}).removed == pytest.approx(0.5)


def test_the_reducible_error_is_what_exceeds_what_the_truth_leaves():
    told = error(1.1, 0.2)["error"]
    in_metres = {"held_out": {"before": 1.1e-3, "after": 0.2e-3}, "noise_floor": 1e-4}
    beside = told | {"beside_settings": {"before_mm": 0.5, "after_mm": 0.3, "noise_floor_mm": 0.1}}
    least = {"plain_mm": 0.2, "beside_settings_mm": 0.25}
    assert error_removed(told, least) == error_removed(in_metres, least) == pytest.approx(1.0)
    discovered = in_metres | {"own": {"before": 5e-4, "after": 3e-4, "floor": 1e-4}}
    assert error_removed(beside, least) == error_removed(discovered, least) == pytest.approx(0.8)
    assert error_removed(beside, {"crash": "ValueError"}) == error_removed(beside) == pytest.approx(0.5)
    assert error_removed(told, {"plain_mm": 1.05, "beside_settings_mm": 0.1}) is None


def discovery(formula: str, place: str, *rivals: str, found: bool = True, exponent: float = 0.0, sensors: int = 2):
    """As diagnosis.json has it."""
    law = {"formula": formula, "place": place, "exponent": {"value": exponent, "u": 0.1}}
    alike = [{"formula": r, "place": place} for r in rivals]
    places = [{"place": f"sensor_y{k + 1}"} for k in range(sensors)] + [{"place": "sensor_all"}] * (sensors > 1)
    said = {"sentence": "it creeps", "p": 0.001, "law": law, "rivals": alike, "places": places}
    return {"discovery": {"found": found} | said}


def test_what_a_discovered_law_removes_is_told_beside_settings_too():
    own = {"before": 0.5e-3, "after": 0.3e-3, "floor": 0.1e-3}
    told = {"held_out": {"before": 1.1e-3, "after": 1.2e-3}, "noise_floor": 0.9e-3, "own": own}
    said = discovery("(1.0 ± 0.1) × κ|κ|", "yaw of the head pulley")
    said["discovery"]["error"] = told
    hidden = truth("outside", "creep", distance=20.0, place="yaw_head", variable="curvature", form="power")
    assert facts(hidden, answer_of(verdict="none_known") | said).removed == pytest.approx(0.5)


def test_a_constant_that_goes_with_the_tension_is_a_law_of_the_tension():
    hidden = truth("outside", "frame", distance=20.0, place="yaw_head", variable="tension", form="power")
    known, said = answer_of(verdict="none_known"), ("(1.0 ± 0.1)·10⁻³ rad × a constant", "yaw of the head pulley")
    assert facts(hidden, known | discovery(*said, exponent=1.9)).law
    assert not facts(hidden, known | discovery(*said, exponent=0.1)).law
    linear = truth("outside", "frame", distance=20.0, place="yaw_head", variable="tension", form="linear")
    assert facts(linear, known | discovery(*said, exponent=1.1)).law
    assert not facts(linear, known | discovery(*said, exponent=1.9)).law


def test_places_that_are_one_to_the_readings_are_one():
    known = answer_of(verdict="none_known")
    gauge = truth("outside", "gauge", distance=20.0, place="sensor_all", variable="y", form="power")
    assert facts(gauge, known | discovery("(2.0 ± 0.1) 1/m × y|y|", "reading of y1", sensors=1)).place
    assert not facts(gauge, known | discovery("(2.0 ± 0.1) 1/m × y|y|", "reading of y1")).place
    rest = truth("outside", "rest", distance=20.0, place="span", variable="y", form="linear")
    turn = "turn of the belt where it runs up the head pulley"
    assert facts(rest, known | discovery("(2.0 ± 0.1) 1/m^2 × y", turn)).place
    assert not facts(rest, known | discovery("(2.0 ± 0.1) rad/m × y", "yaw of the head pulley")).place


def test_a_discovered_law_is_right_in_its_place_and_in_its_law_or_not():
    unknown = {"place": "yaw_tail", "variable": "time_since_step", "form": "exponential", "also": [["yaw", "power"]]}
    hidden, known = truth("outside", "creep", distance=20.0, **unknown), answer_of(verdict="none_known")
    creep, head = "(0.240 ± 0.010) × β (1 − exp(−s/14.6 ± 1.2 m))", "yaw of the head pulley"
    found = facts(hidden, known | discovery(creep, "yaw of the tail pulley"))
    assert (found.discovered, found.place, found.law, found.p) == ("it creeps", True, True, 0.001)
    other = facts(hidden, known | discovery("(1.0 ± 0.1)·10⁻³ rad × κ|κ|", head))
    assert (other.place, other.law) == (False, False)
    assert facts(hidden, known | discovery("(2.0 ± 0.1) × κ|κ|", head, "β|β|")).law  # in the class that is stated
    assert facts(truth("nothing"), known | discovery(creep, head)).discovered
    assert not facts(truth("nothing"), known | discovery(creep, head, found=False)).discovered


@pytest.mark.parametrize(
    ("said", "true"),
    [
        ("turn of the belt where it runs up both pulleys alike", "runup_both"),
        ("turn_tail", "runup_tail"),
        ("yaw of the head pulley", "yaw_head"),
        ("twist over the wrap of the tail pulley", "wrap"),
        ("reading of y1", "sensor"),
        ("readings of all sensors alike", "sensor_all"),
        ("sensor_y4", "sensor"),
        ("tension of the belt", "tension"),
        ("bend of the lower span where it runs up", "span"),
        ("span_upper", "span"),
    ],
)
def test_places_of_the_finder_in_the_words_of_the_generator(said, true):
    assert generator_place(said) == true


@pytest.mark.parametrize(
    ("term", "pair", "other"),
    [
        ("(1.2 ± 0.1)·10⁻⁶ rad/m × s", ("travel", "linear"), ("travel", "constant")),
        ("(1.2 ± 0.1)·10⁻⁶ rad × a constant", ("travel", "constant"), ("travel", "linear")),
        ("(1.2 ± 0.1)·10⁻⁶ 1/m² × y²", ("y", "power"), ("y", "linear")),
        ("(1.2 ± 0.1) × κ, saturating at 0.1 1/m × tension^-1", ("curvature", "saturating"), ("curvature", "power")),
        ("(1.2 ± 0.1) × the part of κ beyond ±0.1 1/m", ("curvature", "threshold"), ("curvature", "linear")),
        ("(1.2 ± 0.1) × α after 20 m", ("travel", "threshold"), ("travel", "linear")),
        ("(1.2 ± 0.1) rad × a wave of 6.4 m", ("belt_phase", "periodic"), ("travel", "linear")),
        ("(1.2 ± 0.1) × β a wave of 6 m that fades over 9 m", ("time_since_step", "exponential"), ("yaw", "power")),
        ("(1.2 ± 0.1) 1/m × exp(−s′/(9.8 m))", ("time_since_step", "exponential"), ("y", "linear")),
        ("(1.2 ± 0.1) 1/s × t", ("travel", "linear"), ("travel", "constant")),
        ("(1.2 ± 0.1) m/m^2 × s²", ("travel", "power"), ("travel", "linear")),
        ("(1.2 ± 0.1) × what of y is stuck within ±0.1 mm", ("y", "threshold"), ("y", "linear")),
    ],
)
def test_terms_of_a_formula_in_the_words_of_the_generator(term, pair, other):
    assert pair in pairs(term)
    assert other not in pairs(term)


def test_every_kind_of_campaign_moves_its_own_row():
    rows = [facts(truth("nothing"), answer_of()), facts(truth("nothing"), answer_of("taper"))]
    rows += [facts(truth("library", "taper", d=d), answer_of("taper")) for d in (3.0, 6.0, 12.0, 24.0)]
    rows += [facts(truth("outside", "creep", distance=d), answer_of(verdict="none_known")) for d in (7.0, 9.0, 13.0)]
    found = {t.name: (t.found.count, t.found.trials) for t in targets(rows)}
    assert found["false alarm when nothing is hidden"] == (1, 2)
    assert [found[f"right effect first, d = {d}"] for d in (3, 6, 12, 24)] == [(1, 1)] * 4
    assert found["unknown effect flagged, distance 8-12"] == (1, 1)
    assert found["unknown effect flagged, distance > 12"] == (1, 1)
    assert found["truth named or in the confusable set, d >= 6"] == (3, 3)
    met = {t.name: t.is_met for t in targets(rows)}
    assert met["false alarm when nothing is hidden"] is False
    assert met["right effect first, d = 6"] is True
    assert met["two effects, exact set"] is None


def test_wilson_has_the_published_values():
    """Newcombe (1998), table I."""
    for count, trials, low, high in ((81, 263, 0.2553, 0.3662), (0, 20, 0.0, 0.1611), (15, 148, 0.0624, 0.1605)):
        assert Share(count, trials).interval == pytest.approx((low, high), abs=5e-5)


def test_probabilities_are_set_against_what_was_hidden():
    sure = [facts(truth("library", "taper"), answer_of("taper", probability=0.97)) for _ in range(3)]
    lost = [facts(truth("library", "cant"), answer_of("taper", probability=0.97))]
    alike = aliased("taper", "cant")
    alike["effects"][0]["probability"] = 0.96
    small = facts(truth("library", "taper"), answer_of("taper", probability=0.2))
    low, high = reliability([*sure, *lost, facts(truth("library", "cant"), alike), small])
    assert (low.low, low.high, low.true, low.alike) == (0.0, 0.3, Share(1, 1), Share(1, 1))
    assert (high.low, high.high, high.true, high.alike) == (0.95, 0.99, Share(3, 5), Share(4, 5))
    assert high.said == pytest.approx((4 * 0.97 + 0.96) / 5)
    assert reliability([facts(truth("library", "taper"), answer_of("taper"))])[0].name == "0.99 - 1"


def test_what_the_named_effects_imitate_is_no_distance():
    hidden, named = truth("outside", "creep", distance=10.0), answer_of("cant")
    alike, apart = (score_case(result(hidden, named, left_by_named=left)) for left in (2.0, 12.0))
    assert (alike.outcome, alike.distance) == ("lookalike", 2.0)
    assert (apart.outcome, apart.distance) == ("wrong", 10.0)
