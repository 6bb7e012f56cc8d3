"""Centring is counted as it reads, and the stored 3D run is centred where the document says."""

import numpy as np
import pytest

from belt_sim.commands.cases import CentringGoal
from belt_sim.curves import read_curves
from belt_sim.errors import InputError
from belt_sim.io import ROOT
from belt_sim.units import MM

WANTED = CentringGoal(start=10 * MM, within=1 * MM, beyond=0.2 * MM)


def test_travel_overshoot_and_rest():
    travel = np.arange(5.0)
    y = np.array([[0.0, -4.0, -9.5, -10.1, -10.0]]).repeat(4, axis=0) * MM
    assert WANTED.measures(travel, y)[0] == 2.0
    assert WANTED.measures(travel, y)[2] == pytest.approx(2.0)
    assert WANTED.measures(travel, y - 0.3 * MM)[2] == pytest.approx(2.0 + 50 * 0.2)  # 0.4 mm beyond, 0.2 are allowed
    assert WANTED.measures(travel, y + 3 * MM)[2] == pytest.approx(4.0 + 10 * 2.0)  # 3 mm are left, 1 is allowed
    one_late = y.copy()
    one_late[2, 3] = -8.0 * MM
    assert WANTED.measures(travel, one_late)[0] == 4.0
    assert CentringGoal(start=-10 * MM, within=1 * MM, beyond=0.2 * MM).measures(travel, -y)[2] == pytest.approx(2.0)


@pytest.mark.parametrize("asked", ["fast", {"start": 10}, {"start": "ten", "within": 1, "beyond": 0.2}])
def test_an_objective_that_cannot_be_is_refused(asked):
    with pytest.raises(InputError, match="objective"):
        CentringGoal.from_setting(asked)


def test_the_stored_belt_in_3d_is_centred():
    curves = read_curves(ROOT / "docs" / "data" / "centred_3d.csv")
    travel, y = curves.travel, curves.y
    assert WANTED.measures(travel, y)[0] == pytest.approx(79.8, abs=0.1)
    assert WANTED.measures(travel, y)[1] == pytest.approx(0.30 * MM, abs=0.01 * MM)
