"""An effect whose one step promises little, since it bends, is refitted all the same."""

import numpy as np
import pytest
from linear_bench import SPREAD, WHITE, linear_bench

from belt_sim.diagnosis import search
from belt_sim.diagnosis.linearisation import Linearisation
from belt_sim.diagnosis.search import best_gauss_newton_step, find_nonlinear, screen


@pytest.fixture(name="laid_out")
def _laid_out():
    """``soft`` begins as one shape and ends as another, which is what the readings show; ``straight`` looks half like
    it, ``other`` a third.
    """
    rng = np.random.default_rng(7)
    ends, apart, more, begins = WHITE.white * rng.normal(size=(4, len(SPREAD), 1, 40))
    begins = begins + 0.5 * ends
    bench = linear_bench(
        SPREAD, y=8.0 * ends, shapes={"soft": begins, "straight": ends + apart, "other": ends + 2.0 * more}
    )
    forward, sums = bench.forward, bench.forward.values
    forward.linear = np.array([False, False, True])

    def values(vectors):
        q = vectors[:, 0, None, None, None]
        left = np.exp(-np.abs(q))
        return sums(vectors) + q * (left - 1.0) * begins + 8.0 * np.sign(q) * (1.0 - left) ** 2 * ends

    def lanes(vectors, directions):
        hair = 1e-6
        return values(vectors), (values(vectors + hair * directions) - values(vectors)) / hair

    forward.values, forward.values_and_slopes = values, lanes
    base = bench.fit([bench.start((), np.zeros(3))])[0]
    return bench, Linearisation(base, dict(enumerate(lanes(np.zeros((3, 3)), np.eye(3))[1])))


def test_one_prediction_tells_which_effect_bends(laid_out):
    bench, near = laid_out
    stepped = {n: best_gauss_newton_step(bench, near, n) for n in ("soft", "straight", "other")}
    assert find_nonlinear(bench, near, stepped) == ["soft"]
    assert find_nonlinear(bench, near, {n: stepped[n] for n in ("straight", "other")}) == []


def test_what_a_machine_has_on_the_other_side_only_is_not_asked_for(laid_out):
    bench, near = laid_out
    stepped = {"soft": best_gauss_newton_step(bench, near, "soft")}
    assert stepped["soft"].vector[0] > 0.0
    bench.forward.sides[1][0] = 0.0
    assert find_nonlinear(bench, near, stepped) == []


def test_it_is_refitted_though_others_promise_more(laid_out, monkeypatch):
    bench, near = laid_out
    monkeypatch.setattr(search, "REFITTED", 1)
    names = ("soft", "straight", "other")
    promised = {n: near.fit.chi2 - best_gauss_newton_step(bench, near, n).chi2 for n in names}
    found = screen(bench, near, names, 10.0, {})
    gains = {n: near.fit.chi2 - f.chi2 for n, f in found.items()}
    assert max(promised, key=promised.get) == "straight"
    assert max(gains, key=gains.get) == "soft"
    assert gains["soft"] > 2.0 * promised["soft"]
    assert found["soft"].is_converged
    assert found["other"].steps == 0
