"""The chain of spans and wraps of studies/web_line: limits, and numbers that it finds again."""

import numpy as np
import pytest

from studies import web_line
from studies.web_line import __main__ as chain

SLOW = 1e-3  # [1/m]: so slow that terms of second order in p are below SECOND of the lag
SECOND = 1e-2


@pytest.mark.parametrize("length", [0.237, 0.491, 2.161])
def test_a_span_delays_slow_changes_by_its_length(length):
    """Pure transport: without slip the web lands where it left, L later, whatever its stiffness."""
    gain = chain.over_span(length, np.array([1j * SLOW]))[0]
    assert abs(gain) == pytest.approx(1.0, abs=SECOND * SLOW)
    assert -np.angle(gain) / SLOW == pytest.approx(length, rel=SECOND)


def test_a_stiff_span_follows_the_cubic_beam():
    """F L^2/EI -> 0: kappa L^2 = 6 (y_o - y) + 2 L theta_o + 4 L theta of a cubic."""
    length = 0.237  # K L = 0.15
    c0, c1, c2 = chain.curvature(length)
    assert [-c0 * length**2, c1 * length, c2 * length] == pytest.approx([6.0, 2.0, 4.0], rel=0.01)


def test_known_numbers_are_found_again(monkeypatch):
    """Records made with f and w give them back, other spans and another number of wraps in each section."""
    truth = 0.93, 0.28
    real = chain.record

    def made(run, section):
        time, source, _ = real(run, section)
        return time, source, chain.predict(section, source, *truth)

    monkeypatch.setattr(chain, "record", made)
    np.testing.assert_allclose(chain.fit(chain.SHORT), truth, rtol=1e-3)


def test_digitised_records_say_where_they_come_from():
    assert "2c_final_project" in chain.__doc__
    assert web_line.__doc__
    assert set(chain.digitised().run) == {*chain.RUNS}
