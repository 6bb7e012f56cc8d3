"""A wander that has a slope everywhere is told from one that has none, and drawn as it is."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_bench import SPACING, WHITE, linear_bench, run
from scipy.linalg import toeplitz

from belt_sim.diagnosis.left_over.null import NoiseSource
from belt_sim.diagnosis.noise.levels import _of_wander
from belt_sim.diagnosis.noise.noise import Levels

LENGTH, COUNT = 20, 160  # samples
REPEATS = tuple(run() for _ in range(4))
SIGNAL = replace(WHITE, wander_sd=3.0 * WHITE.white, wander_length=LENGTH * SPACING)
APART = np.arange(COUNT) / LENGTH
ROUGH = np.exp(-APART)
SLOPED = (1.0 + np.sqrt(3.0) * APART) * np.exp(-np.sqrt(3.0) * APART)


def readings(correlation, rng):
    """White noise and wander of a correlation (n,), as the sheet states, in repeats."""
    root = np.linalg.cholesky(toeplitz(correlation) + 1e-9 * np.eye(COUNT))
    slow = rng.standard_normal((len(REPEATS), 1, COUNT)) @ root.T
    return SIGNAL.wander_sd * slow + SIGNAL.white * rng.standard_normal(slow.shape)


@pytest.mark.parametrize(("correlation", "smooth"), [(ROUGH, False), (SLOPED, True)])
def test_repeats_tell_which_wander_it_is(correlation, smooth):
    rng = np.random.default_rng(1)
    drawn = [readings(correlation, rng) for _ in range(20)]
    found = [linear_bench(REPEATS, SIGNAL, count=COUNT, y=y).finder(y) for y in drawn]
    assert np.mean([lv.smooth == smooth for lv in found]) >= 0.9
    of_its_kind = [lv.of(0) for lv in found if lv.smooth == smooth]
    assert np.mean(np.log([wander for _, wander, _ in of_its_kind])) == pytest.approx(0.0, abs=0.3)
    assert np.mean(np.log([reach.length for *_, reach in of_its_kind])) == pytest.approx(0.0, abs=0.5)


def test_chance_draws_a_smooth_wander_as_it_is():
    """Between neighbours it differs with the square of their distance, where a rough one does with the distance."""
    bench = linear_bench(REPEATS, SIGNAL, count=COUNT, levels=Levels(smooth=True))
    finder = SimpleNamespace(draw=lambda y, count, rng: np.tile([1.0, 0.5, 1.0], (count, 1, 1)))
    source = NoiseSource(replace(bench, finder=finder), bench.samples.y, np.random.default_rng(2))
    errors = source.draw(1500)
    white, wander = SIGNAL.white**2, (0.5 * SIGNAL.wander_sd) ** 2
    assert np.mean(errors**2) == pytest.approx(white + wander, rel=0.03)
    for apart in (1, 10, 30):
        jumps = errors[..., apart:] - errors[..., :-apart]
        assert np.mean(jumps**2) == pytest.approx(2.0 * white + 2.0 * wander * (1.0 - SLOPED[apart]), rel=0.03)


@pytest.mark.parametrize(("smooth", "slope"), [(False, 1.0), (True, np.sqrt(3.0))])
def test_modes_of_a_wander_are_what_its_correlation_says(smooth, slope):
    step, turn, lag = slope * 0.1, np.array([0.02, 0.3, 2.0]), np.arange(-2000, 2001)
    fall = np.exp(-step * np.abs(lag)) * (1.0 + smooth * step * np.abs(lag))
    wanted = [np.sum(fall * np.cos(lag * t)) for t in turn]
    found = _of_wander(np.array([[step]]), turn, smooth)[0]
    assert found == pytest.approx(wanted, rel=1e-9)
