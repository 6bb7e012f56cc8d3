"""Runs set off by more than the linear range allows still leave nothing to explain."""

from dataclasses import replace

import numpy as np
import pytest
from small_campaign import bench

from belt_sim.diagnosis import workbench
from belt_sim.diagnosis.noise import metric_of

OFF = 2.0  # sigma
TENSION, YAW = 0.06, 3e-5  # one sigma of a careless setting


@pytest.fixture(scope="module")
def careless():
    """Readings of runs that were all set two sigma off, without any noise, under a sheet that allows for it."""
    b = bench()
    settings = replace(b.campaign.settings, tension_rel=TENSION, yaw_u=YAW)
    campaign = replace(b.campaign, settings=settings)
    signs = np.array([1.0, -1.0] * (len(b.samples.runs) // 2))
    forward = b.forward.set_to(OFF * TENSION * signs, OFF * YAW * signs[::-1])
    y = forward.values(b.forward.null()[None])[0]
    samples = replace(b.samples, y=y)
    return replace(b, campaign=campaign, samples=samples, fitted=samples, forward=b.forward.set_to(*np.zeros((2, 6))))


def at(b, levels):
    """The workbench with other noise levels."""
    return replace(b, levels=levels, metric=metric_of(b.fitted, levels, b.shapes, b.shared))


def left(b) -> float:
    """chi2 of the base model."""
    return b.fit([b.start((), b.forward.null())])[0].chi2


def test_what_is_left_of_careless_settings_is_their_prior(careless, monkeypatch):
    """Two sigma in both settings of six runs cost no more than chi2 of 48, which the linear range exceeds."""
    null, exact = careless.forward.null(), OFF**2 * 2 * len(careless.samples.runs)
    levels = replace(careless.levels, white=(0.2, 0.2), wander=(0.2, 0.2))  # hardly any: the readings have none
    moved = careless.moved_to(null)
    again = moved.moved_to(null)
    monkeypatch.setattr(workbench, "expand_at_likely_settings", lambda bench, vector: bench.forward)
    settled_once, settled_twice, linear = (left(at(b, levels)) for b in (moved, again, careless.moved_to(null)))
    assert settled_once < exact < linear
    assert abs(settled_twice - settled_once) < 0.02 * (linear - settled_once)


def test_settings_stay_within_what_may_occur(careless):
    far = replace(careless, fitted=replace(careless.fitted, y=careless.fitted.y + 0.01))
    forward = workbench.expand_at_likely_settings(far, far.forward.null())
    assert np.abs(forward.tension).max() <= workbench.FURTHEST_SETTING * TENSION * (1 + 1e-12)
