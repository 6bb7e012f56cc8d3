"""What a search works out: only what somebody asks for, and nothing with numbers that a processor is slow with."""

import numpy as np
import pytest

from belt_sim.discovery import look
from belt_sim.discovery.gate import Gate
from belt_sim.discovery.look import Seen
from belt_sim.discovery.operators import single


def test_which_law_it_is_waits_until_somebody_asks(monkeypatch):
    """Whether anything is missing is the gate's; choosing a law and putting it into the march is most of the work."""

    def searched(*args, **kwargs):
        raise AssertionError("a search")

    monkeypatch.setattr(look, "discovered", searched)
    seen = Seen(None, Gate(failed=False, p=0.4, threshold=20.0, best=()), False, lambda text: None)
    assert seen.failed == ()
    with pytest.raises(AssertionError, match="a search"):
        seen.columns()


def test_numbers_too_small_for_all_digits_are_none():
    x = np.array([[1e-3, 1e-39, -1e-42], [0.0, 1e-37, np.pi]])
    found = single(x)
    assert found.dtype == np.float32
    assert np.array_equal(found, np.float32([[1e-3, 0.0, 0.0], [0.0, 1e-37, np.pi]]))
