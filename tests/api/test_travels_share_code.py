"""Curves of another travel are the same curves, cut, and come from the same compiled code."""

import numpy as np

import belt_sim as bs
from belt_sim.line import march


def test_a_shorter_run_is_the_beginning_of_a_longer_one():
    long, short = (bs.simulate(tension=10, travel=t).curves for t in (20, 17))
    n = len(short.travel)
    np.testing.assert_allclose(short.y, long.y[:, :n], rtol=0, atol=1e-12)
    np.testing.assert_allclose(short.moment, long.moment[:, :n], rtol=1e-9)
    assert (n, short.travel[-1]) == (171, 17.0)


def test_travels_of_a_size_need_one_compilation(monkeypatch):
    bs.simulate(tension=10, travel=20)
    monkeypatch.setattr(march, "_steps_traced", None)  # nothing can be traced anew
    for travel in (19.5, 19.9, 20):
        bs.simulate(tension=10, travel=travel)
