"""Dense records are averaged in bins: of short waves on the belt the averages show less, and the fit knows how much."""

from types import SimpleNamespace

import numpy as np

from belt_sim.diagnosis.forward import Slot, bin_attenuation
from belt_sim.diagnosis.samples import Samples
from belt_sim.effects.belt_shape import EdgeProfile
from belt_sim.effects.pulley_shape import Taper

LENGTH, SPACING, MANY, BINS = 7.0, 0.06, 5, 100


def binned(travel):
    return travel.reshape(-1, MANY).mean(axis=1)


def test_the_average_of_a_wave_over_a_bin_is_as_large_as_the_fit_takes_it_for():
    dense = SPACING * np.arange(MANY * BINS)
    coarse = binned(dense)
    travel = np.stack([coarse, np.where(np.arange(BINS) < 70, coarse, coarse[69])])  # the second record is shorter
    samples = Samples(
        runs=(), signals=(), cases=SimpleNamespace(rig=SimpleNamespace(belt_length=LENGTH)), travel=travel, time=travel,
        y=np.zeros((2, 0, BINS)), yaw_at=np.zeros(2), per_bin=np.array([float(MANY), 1.0]),
    )  # fmt: skip
    asked = [Slot(Taper, "kappa_t"), *(Slot(EdgeProfile, name) for name in ("cos1", "sin9", "cos24", "sin40"))]
    shown = bin_attenuation(asked, samples)
    for share, k in zip(shown[0], (0, 1, 9, 24, 40), strict=True):
        wave = np.exp(2j * np.pi * k * dense / LENGTH)
        np.testing.assert_allclose(binned(wave), share * np.exp(2j * np.pi * k * coarse / LENGTH), atol=1e-9)
    assert shown[0, -1] < 0.2  # nothing like the whole
    np.testing.assert_allclose(shown[1], 1.0)
