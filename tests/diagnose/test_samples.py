"""Readings as arrays: what is not judged is blank."""

from dataclasses import replace

import numpy as np
import pytest

from belt_sim.diagnosis.samples import samples_of
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Plan, RunSetting

SIGNALS = {"y1": "point_1", "phi": "upper_mid_span"}


def measured(yaw_at=0.0, spacing=0.5):
    runs = tuple(RunSetting(tension=2e7, yaw=yaw, yaw_at=yaw_at) for yaw in (-7e-4, 7e-4))
    return make_campaign(seed=1, plan=Plan(runs=runs, length=10.0, spacing=spacing, signals=SIGNALS))[0]


@pytest.mark.parametrize("yaw_at", [0.0, 2.0])
def test_a_tilt_is_not_judged_where_it_jumps_at_the_start_and_with_the_yaw(yaw_at):
    samples = samples_of(measured(yaw_at))
    here = np.isin(samples.travel[0], (0.0, yaw_at))
    assert here.sum() == len({0.0, yaw_at})
    np.testing.assert_array_equal(np.isnan(samples.y[:, 1]), np.tile(here, (2, 1)))
    assert np.isfinite(samples.y[:, 0]).all()  # the belt itself has not moved yet


def test_a_mean_of_before_and_after_is_not_judged_either():
    campaign = measured(2.01, spacing=0.02)
    samples = samples_of(campaign)
    assert samples.per_bin[0] == 2
    blank = samples.travel[0][np.isnan(samples.y[0, 1]) & (samples.travel[0] > 1.0)]
    assert blank.min() <= 2.01 <= blank.max()
    assert len(blank) <= 6
    plain = samples_of(replace(campaign, runs=tuple(replace(r, yaw_at=-1.0) for r in campaign.runs)))
    assert np.isfinite(plain.y[:, :, plain.travel[0] > 0.1]).all()
