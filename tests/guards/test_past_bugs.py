"""One test for every bug that was found and could come back."""

import numpy as np
import pytest
from paper_cases import paper_case

from belt_sim.curves import Curves, late_rates
from belt_sim.effects.base import library
from belt_sim.errors import InputError
from belt_sim.line.march import march_case
from belt_sim.model import analytic_model

BEAM = analytic_model("beam_th2")
EFFECTS = library()


def test_compliant_steering_does_not_blow_up():
    """The yaw used to chase the moment from step to step, which diverged for 2 C EI dkappa/dtheta > 1."""
    soft = EFFECTS["yaw_compliance"](c_m=EFFECTS["yaw_compliance"].parameters["c_m"].plausible[1])
    stiff, found = (march_case(paper_case(40), BEAM, e, travel=5.0) for e in ((), (soft,)))
    assert np.all(found.y[0, 1:] > 0)
    assert np.all(found.y[0, 1:] < stiff.y[0, 1:])


def test_compliance_answers_to_the_yaw_with_its_offset():
    """Asked before a yaw offset, the compliance used the moment of a yaw that it did not know of."""
    soft, off = EFFECTS["yaw_compliance"](c_m=2e-5), EFFECTS["yaw_offset_tail"](beta_0=3e-4)
    with_offset = march_case(paper_case(40, 0.0), BEAM, (soft, off), travel=5.0)
    as_command = march_case(paper_case(40, 3e-4), BEAM, (soft,), travel=5.0)
    np.testing.assert_allclose(with_offset.y, as_command.y, atol=1e-12)


def test_sensor_effects_reach_a_simulation():
    """A march returns the true curves: sensor effects used to be dropped in silence."""
    gain = EFFECTS["sensor_gain"](g1=0.5)
    plain, shown = (BEAM.run(paper_case(40), e, travel=5.0) for e in ((), (gain,)))
    np.testing.assert_allclose(shown.y[0], 1.5 * plain.y[0], rtol=1e-9)


def test_an_encoder_that_lags_does_not_flatten_the_end():
    """The true travel is longer than the record: the march must reach it."""
    scale = EFFECTS["encoder_scale"](e=-0.05)
    shown = BEAM.run(paper_case(40), (scale,), travel=5.0)
    slopes = np.diff(shown.y[0])
    assert slopes[-1] > 0.9 * slopes[-2] > 0  # the curve still gets steeper there


@pytest.mark.parametrize(("name", "value"), [("step", 0.0), ("step", -0.1), ("keep", 0.0), ("travel", 0.0)])
def test_lengths_must_be_positive(name, value):
    lengths = {"travel": 5.0, "step": 0.05, "keep": 0.1} | {name: value}
    with pytest.raises(InputError, match=name):
        march_case(paper_case(40), BEAM, **lengths)


def test_effects_that_leave_no_tension_are_refused():
    with pytest.raises(InputError, match="effects leave none"):
        march_case(paper_case(2), BEAM, (EFFECTS["tension_bias"](bias=-3e6),), travel=5.0)


def test_a_record_of_two_samples_has_a_slope():
    """A run over 0.1 m left one record in the last fifth, and NaN in summary.json."""
    short = Curves(travel=np.array([0.0, 0.1]), y=np.array([[0.0, 0.1]] * 4))
    np.testing.assert_allclose(late_rates(short), 1.0)
