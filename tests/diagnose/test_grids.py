"""What only shapes an effect is tried on a grid: as one candidate, which pays for having been tried so often."""

from dataclasses import replace

import numpy as np
import pytest
from small_campaign import MODEL, campaign

from belt_sim.diagnosis.forward import Forward
from belt_sim.diagnosis.samples import samples_of
from belt_sim.effects.belt_shape import Weld

GRID = (2.0, 3.0, 4.0, 5.0, 7.0)
LENGTH, SIZE = 4.3, 2e-4  # between two points of the grid
IDS = ["test_wave"]


@pytest.mark.parametrize("centres", [2.0, 11.28, 14.0])
def test_a_weld_is_looked_for_all_round_a_belt_of_any_length(centres):
    """Steps in metres that fit a long belt go round a short one in its own time, and find a few places again."""
    samples = samples_of(campaign("nothing"))
    cases = replace(samples.cases, rig=replace(samples.cases.rig, centre_distance=centres))
    forward = Forward(replace(samples, cases=cases), MODEL, (Weld,))
    (position, grid), *others = forward.grids("weld").items()
    assert not others
    around = float(cases.rig.belt_length)
    places = np.sort(np.mod(np.array(grid) * forward.slots[position].scale, around))
    gaps = np.diff([*places, places[0] + around])
    assert gaps == pytest.approx(around / len(grid))
    assert gaps.max() < 0.1 * around
