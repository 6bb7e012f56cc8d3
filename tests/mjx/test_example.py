"""examples/steer_on_mjx.py, a tiny version of it."""

import runpy

import numpy as np
import pytest

from belt_sim.paths import ROOT


@pytest.mark.long
def test_the_controller_turns_the_tail_against_y():
    """Of two equal belts the steered one moves less."""
    steered = runpy.run_path(str(ROOT / "examples" / "steer_on_mjx.py"))["steered"]
    y = steered(np.array([0.0, 2e-3]), np.array([0.04, 0.04]), 900)
    assert y.shape == (2, 900)
    assert 0.0 < np.abs(y[1, -1]) < np.abs(y[0, -1])
