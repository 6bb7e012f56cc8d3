"""The controller that is put on the 3D belt is the one of the linear loop."""

import numpy as np
import pytest

from studies.closed_loop import Lead


def test_the_lead_answers_a_step_as_its_transfer_function():
    controller = Lead(gain=0.2, lead=5.0, lag=0.5)
    controller.angle(0.0, 0.0)
    travel = np.arange(1, 4001) * 1e-3
    found = [controller.angle(float(s), 1e-3) for s in travel]
    wanted = -0.2 * 1e-3 * (1.0 + 9.0 * np.exp(-travel / 0.5))  # (1 + 5 s)/(1 + 0.5 s): 10 at once, 1 in the end
    np.testing.assert_allclose(found, wanted, rtol=3e-3)


def test_what_counts_is_the_way_from_where_it_began():
    controller = Lead(gain=0.2, lead=5.0, lag=0.5)
    assert controller.angle(0.0, 0.3) == pytest.approx(0.0)
