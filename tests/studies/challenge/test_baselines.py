"""Plain methods, and the search of the diagnosis with weaker rules."""

import numpy as np
import pytest
from small_challenge import answer_of

from studies.challenge.baselines import Table, iid_bic, least_squares_answer, search_by_bic, search_without_gate, sparse


@pytest.fixture
def table():
    """Two effects on 400 readings, the first of which is there, in white noise of 0.1."""
    rng = np.random.default_rng(3)
    columns = np.stack([np.linspace(-1, 1, 400), np.sin(np.linspace(0, 20, 400))])
    owner = (("ramp", "a", 2.0), ("wave", "b", 1.0))
    return Table(3.0 * columns[0] + 0.1 * rng.standard_normal(400), columns, owner, 0.1)


def test_plain_methods_are_right_where_noise_is_white(table):
    for answer in (iid_bic(table), sparse(table)):
        assert [e["id"] for e in answer["effects"]] == ["ramp"]
        low, high = answer["effects"][0]["parameters"]["a"]["interval_95"]
        assert low < 6.0 < high
        assert high - low == pytest.approx(2 * 1.96 * 2.0 * 0.1 / np.sqrt((table.columns[0] ** 2).sum()), rel=0.1)
    assert least_squares_answer(table, [], {})["verdict"] == "adequate"


def searched(*rounds, names=()):
    """An answer whose search tried, round by round, candidates of these gains."""
    tried = [[{"id": i, "gain": gain, "threshold": 9.0} for i, gain in trials.items()] for trials in rounds]
    ranking = [{"id": "a", "parameters": {"x": 0}}, *({"id": i, "parameters": {"x": 0, "y": 0}} for i in "bc")]
    return answer_of(*names, verdict="explained" if names else "none_known") | {"rounds": tried, "ranking": ranking}


def by_name(answer):
    return [e["id"] for e in answer["effects"]]


def test_a_search_by_bic_pays_for_every_parameter_and_follows_what_was_tried():
    tried = searched({"a": 30.0, "b": 34.0, "c": 9.9}, {"b": 13.75, "c": 13.7})
    assert by_name(search_by_bic(tried, 1000)) == ["a"]  # 30 - 1 ln 1000 > 34 - 2 ln 1000, and 2 ln 1000 = 13.8
    assert by_name(search_by_bic(tried, 900)) == ["a", "b"]
    elsewhere = searched({"a": 30.0, "b": 34.0, "c": 9.9}, {"a": 13.9, "c": 99.0})  # gains beside b say nothing of a
    assert by_name(search_by_bic(elsewhere, 900)) == ["a"]
    assert search_by_bic(answer_of(verdict="cannot_say"), 900)["verdict"] == "cannot_say"


def test_without_its_gate_the_search_names_what_it_ends_with():
    rounds = ({"a": 30.0, "b": 34.0, "c": 9.9}, {"a": 13.9, "c": 7.0})
    assert by_name(search_without_gate(searched(*rounds))) == ["b"]
    assert search_without_gate(searched(*rounds))["verdict"] == "explained"
    assert by_name(search_without_gate(searched(*rounds, names=("a",)))) == ["a"]
    assert search_without_gate(searched(rounds[0]))["verdict"] == "adequate"
