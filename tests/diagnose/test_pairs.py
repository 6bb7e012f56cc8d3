"""All pairs of candidates at once: a pair is seen where a third effect looks like the sum of both."""

import numpy as np
import pytest

from belt_sim.diagnosis.search.joint_fits import Pairs, marginal_gains

RNG = np.random.default_rng(3)
A, B, OTHER = RNG.standard_normal((3, 200))
SUM = A + B + 0.3 * OTHER
COLUMNS = np.stack([A, B, SUM, *RNG.standard_normal((7, 200))])
PLACES = {"a": [0], "b": [1], "sum": [2], "two": [3, 4], "many": range(5, 10)}
PAIRS = Pairs(PLACES, COLUMNS @ COLUMNS.T)


def best(residual):
    return PAIRS.best(COLUMNS @ residual, 10.0, 3)


def test_a_pair_is_seen_where_a_third_effect_is_nearly_its_sum():
    assert best(3.0 * A + 3.0 * B)[0] == ("a", "b")


@pytest.mark.parametrize(
    "residual",
    [3.0 * A, 3.0 * SUM, 3.0 * COLUMNS[5] + 3.0 * COLUMNS[6]],  # one does as well; free numbers are nobody's sum
)
def test_no_pair_is_told_of_that_promises_no_more(residual):
    assert best(residual) == []


def test_gains_are_those_of_least_squares():
    """All columns of a pair fitted together; twins among them count once."""
    twins = np.stack([A, A, B])
    residual = RNG.standard_normal(200)
    gains = Pairs({"a": [0], "twin": [1], "b": [2]}, twins @ twins.T)._gains(twins @ residual)
    for ids, rows in {("a", "b"): [A, B], ("a", "twin"): [A], ("twin",): [A]}.items():
        solved = np.linalg.lstsq(np.stack(rows).T, residual, rcond=None)[0]
        assert gains[ids] == pytest.approx(float(np.sum((solved @ np.stack(rows)) ** 2)), rel=1e-9)


def test_a_pair_with_an_effect_that_bends_is_seen_by_what_it_does_where_it_was_fitted():
    """At null ``bends`` moves nothing; fitted by itself it takes A, and beside it ``b`` takes the rest."""
    at_null = np.stack([1e-3 * COLUMNS[5], B, SUM])
    places, residual = {"bends": [0], "b": [1], "sum": [2]}, 3.0 * A + 3.0 * B
    gain = float((A @ residual) ** 2 / (A @ A))
    further = marginal_gains(A[None], residual - (A @ residual) / (A @ A) * A, {"b": B[None]})["b"]
    wanted = float(residual @ residual)  # of both together, all of it
    assert gain + further == pytest.approx(wanted)
    known = {frozenset(["bends"]): gain, frozenset(["bends", "b"]): gain + further}
    found = [Pairs(places, at_null @ at_null.T, k) for k in ({}, known)]
    moments = at_null @ residual
    bests = [p.best(moments, 10.0, 1) for p in found]
    assert bests[0] != bests[1] == [("bends", "b")]
