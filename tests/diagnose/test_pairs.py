"""All pairs of candidates at once: a pair is seen where a third effect looks like the sum of both."""

import numpy as np
import pytest

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.search import leading_pairs, linear_gains, marginal_gains

RNG = np.random.default_rng(3)
A, B, OTHER = RNG.standard_normal((3, 200))
SUM = A + B + 0.3 * OTHER
MORE = RNG.standard_normal((7, 200))
SHAPES = {"a": A[None], "b": B[None], "sum": SUM[None], "two": MORE[:2], "many": MORE[2:]}


def best(residual):
    return leading_pairs(SHAPES, residual, 10.0, 3, {})


def test_a_pair_is_seen_where_a_third_effect_is_nearly_its_sum():
    assert best(3.0 * A + 3.0 * B)[0] == ("a", "b")


@pytest.mark.parametrize(
    "residual",
    [3.0 * A, 3.0 * SUM, 3.0 * MORE[2] + 3.0 * MORE[3]],  # one does as well; free numbers are nobody's sum
)
def test_no_pair_is_told_of_that_promises_no_more(residual):
    assert best(residual) == []


def test_gains_are_those_of_least_squares():
    """All columns of a pair fitted together; twins among them count once."""
    residual = RNG.standard_normal(200)
    gains = linear_gains({"a": A[None], "twin": A[None], "b": B[None]}, residual)
    for ids, rows in {("a", "b"): [A, B], ("a", "twin"): [A], ("twin",): [A]}.items():
        solved = np.linalg.lstsq(np.stack(rows).T, residual, rcond=None)[0]
        assert gains[ids] == pytest.approx(float(np.sum((solved @ np.stack(rows)) ** 2)), rel=1e-9)


def test_a_pair_with_an_effect_that_bends_is_seen_by_what_it_does_where_it_was_fitted():
    """At null ``bends`` moves nothing; fitted by itself it takes A, and beside it ``b`` takes the rest."""
    at_null, residual = {"bends": 1e-3 * MORE[:1], "b": B[None], "sum": SUM[None]}, 3.0 * A + 3.0 * B
    gain = float((A @ residual) ** 2 / (A @ A))
    left = residual - (A @ residual) / (A @ A) * A
    fit = Fit(ids=("bends",), free=[0], vector=np.zeros(1), columns=A[None], residual=left)
    further = marginal_gains(fit, {"b": B[None]})["b"]
    wanted = float(residual @ residual)  # of both together, all of it
    assert gain + further == pytest.approx(wanted)
    known = {frozenset(["bends"]): gain, frozenset(["bends", "b"]): gain + further}
    bests = [leading_pairs(at_null, residual, 10.0, 1, k) for k in ({}, known)]
    assert bests[0] != bests[1] == [("bends", "b")]
