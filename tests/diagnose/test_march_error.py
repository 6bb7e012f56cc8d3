"""The march's own error stays far below the noise, on rigs of any size."""

from dataclasses import replace

import numpy as np
import pytest
from small_campaign import MODEL, bench

from belt_sim.campaign import Quantity
from belt_sim.diagnosis.forward import STEP, Forward
from belt_sim.diagnosis.noise import metric_of
from belt_sim.diagnosis.workbench import MARCH_ERROR, workbench
from belt_sim.units import MM
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import TEST_RIG, TEST_TENSIONS, TEST_YAWS, Noise, Plan, grid

SHORT = Plan(
    machine=replace(TEST_RIG, centre_distance=Quantity(value=2.0, u=0.002)),
    runs=grid(TEST_TENSIONS[::3], TEST_YAWS, repeats=0),
    length=10.0,
    spacing=0.25,
)
QUIET = Noise(white=0.005 * MM, wander_sd=0.015 * MM, zero=0.03 * MM)


@pytest.fixture(scope="module")
def short():
    """A rig of two metres read with a third of the usual noise: steps of 0.1 m are too coarse for it."""
    return workbench(make_campaign(seed=1, plan=SHORT, noise=QUIET)[0], MODEL, ())


def test_the_step_follows_the_error(short):
    assert bench().forward.step == STEP
    assert short.forward.step < STEP


def test_the_error_is_what_a_much_finer_march_says(short):
    values, fine = (
        Forward(short.samples, MODEL, (), step).values(short.forward.null()[None])[0]
        for step in (short.forward.step, short.forward.step / 8)
    )
    size = np.abs(values - fine).max()
    assert np.abs(short.march_error).max() == pytest.approx(size, rel=0.2)
    still = np.zeros_like(values)
    whiten = metric_of(short.fitted, short.levels, still[None], still[None]).whiten
    assert np.linalg.norm(whiten(values - fine)) < 1.2 * MARCH_ERROR
