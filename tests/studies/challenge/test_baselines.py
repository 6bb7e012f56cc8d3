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


def searched(sets, refused=(), unknown=()):
    """An answer that compared these sets, likeliest first: letters -> chi2 gain and number of parameters."""
    rows = [
        {"effects": list(ids), "gain": gain, "parameters": count, "unknown": ids in unknown, "instead": "",
         "refused": "no machine" if ids in refused else ""}
        for ids, (gain, count) in sets.items()
    ]  # fmt: skip
    return answer_of(verdict="none_known") | {"considered": rows}


def by_name(answer):
    return [e["id"] for e in answer["effects"]]


SETS = {"b": (34.0, 2), "a": (30.0, 1), "ab": (43.75, 3), "": (0.0, 0)}


def test_a_search_by_bic_pays_for_every_parameter():
    tried = searched(SETS)
    assert by_name(search_by_bic(tried, 1000)) == ["a"]  # 30 - 1 ln 1000 > 34 - 2 ln 1000, and 2 ln 1000 = 13.8
    assert by_name(search_by_bic(tried, 900)) == ["a", "b"]
    assert search_by_bic(answer_of(verdict="cannot_say"), 900)["verdict"] == "cannot_say"


def test_without_its_gate_the_likeliest_set_is_named_whatever_else_is_likelier():
    assert by_name(search_without_gate(searched(SETS))) == ["b"]
    assert search_without_gate(searched(SETS))["verdict"] == "explained"
    assert by_name(search_without_gate(searched(SETS, refused=("b",)))) == ["a"]
    assert search_without_gate(searched({"": (0.0, 0), "a": (5.0, 1)}))["verdict"] == "adequate"
