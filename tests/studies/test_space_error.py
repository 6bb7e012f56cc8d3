"""The 3D rig's own error is told as a factor and a rest."""

import numpy as np
import pytest

from studies.space_error import differences


def test_a_known_factor_and_a_known_rest_are_found():
    travel = np.linspace(0.0, 12.0, 121)
    line = np.stack([np.outer(np.sin(travel), [1e-4, -2e-4]), np.outer(np.cos(travel), [3e-4, 1e-4])])
    aside = np.broadcast_to(1e-6 * np.outer(travel, [1.0, -1.0]), line.shape).copy()
    aside -= line * ((aside * line).sum(axis=1) / (line * line).sum(axis=1))[:, None]  # at right angles to it
    off, left = differences(1.02 * line + aside, line)
    assert off == pytest.approx(np.full((2, 2), 0.02), abs=1e-12)
    assert left == pytest.approx(aside, abs=1e-15)
