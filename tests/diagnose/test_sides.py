"""What a fit may take for a number: sizes are for the readings to say, shapes end where no machine goes on."""

import numpy as np
import pytest

from belt_sim.diagnosis.forward import Slot
from belt_sim.effects.base import library

SHAPES = [(e, n) for e in library().values() for n, p in e.parameters.items() if p.modifier]


def side(effect, name):
    """In SI units."""
    slot = Slot(library()[effect], name)
    return tuple(end * slot.scale for end in slot.side)


def test_a_weld_is_no_longer_and_no_shorter_than_welds_are_and_its_angle_is_free():
    assert side("weld", "length") == pytest.approx(library()["weld"].parameters["length"].plausible)
    assert side("weld", "angle") == (-np.inf, np.inf)


def test_a_stiffness_keeps_its_side_and_may_be_as_large_as_the_readings_say():
    assert side("yaw_compliance", "c_m") == (0.0, np.inf)


@pytest.mark.parametrize(("effect", "name"), SHAPES, ids=lambda x: getattr(x, "id", x))
def test_every_shape_is_bounded_and_null_is_within(effect, name):
    slot = Slot(effect, name)
    low, high = slot.side
    assert np.isfinite([low, high]).all()
    assert low <= slot.parameter.null / slot.scale <= high
