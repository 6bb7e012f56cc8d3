"""Whitened readings have unit covariance, and repeats tell the noise levels."""

from dataclasses import replace

import numpy as np
import pytest
from noise_by_recursion import errors
from small_campaign import bench, repeated_bench

from belt_sim.campaign import Quantity
from belt_sim.diagnosis.errors import error_map, validation_uncertainty
from belt_sim.diagnosis.forward import NUISANCES
from belt_sim.diagnosis.noise import (
    LevelFinder,
    Levels,
    Reach,
    contrast,
    metric_of,
    nuisance_shapes,
)

DRAWS = 600
SIGMAS = 4.5  # a handful of figures, each beyond this once in 150,000
STEP = np.log(2.5 / 0.4) / 14  # what the prior may pull, in logarithm
SECOND_ORDER = 0.03  # predictions curve between one sigma and none
ROUNDING = 1e-3  # of directions beside one a million times as long
EXACT = 1e-10  # rounding of a product of 732 numbers


@pytest.fixture
def stated():
    """The metric at the noise that the campaign states."""
    b = bench()
    return metric_of(b.fitted, Levels(), b.shapes, b.shared)


def test_whitened_errors_have_unit_covariance(stated):
    rng = np.random.default_rng(1)
    white = stated.whiten(errors(bench(), DRAWS, rng))
    size = white.shape[1]
    assert np.mean(white**2) == pytest.approx(1.0, abs=SIGMAS * np.sqrt(2 / (DRAWS * size)))
    nuisances = stated.whiten(np.concatenate([bench().shapes, bench().shared]))
    along = np.concatenate([nuisances, rng.standard_normal((20, size))])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    np.testing.assert_allclose(np.var(white @ along.T, axis=0), 1.0, atol=SIGMAS * np.sqrt(2 / DRAWS))


def test_neighbours_are_no_longer_correlated(stated):
    white = stated.whiten(errors(bench(), DRAWS, np.random.default_rng(2)))
    neighbours = np.mean(white[:, 1:] * white[:, :-1])
    assert abs(neighbours) < SIGMAS / np.sqrt(white.size)


def test_half_the_wander_is_seen_as_too_small(stated):
    quiet = stated.whiten(errors(bench(), 100, np.random.default_rng(3), wander=0.5))
    assert np.mean(quiet**2) < 0.95


def test_blank_readings_weigh_nothing():
    b, y = bench(), bench().samples.y.copy()
    y[1, 0, 10:30] = np.nan
    metric = metric_of(replace(b.samples, y=y), Levels(), b.shapes, b.shared)
    moved = np.where(np.isfinite(y), 0.0, 1.0)
    assert metric.chi2(moved) == 0.0
    assert metric.chi2(np.where(np.isfinite(y), 1e-4, np.nan)) > 0.0


def long_bench():
    """The runs of the bench with repeats as 60 m records read every quarter metre: the prior then hardly counts."""
    b = repeated_bench()
    runs, signals, _ = b.samples.y.shape
    travel = np.tile(np.arange(0.0, 60.0, 0.25), (runs, 1))
    still = np.zeros((runs, signals, travel.shape[1]))
    return replace(b, samples=replace(b.samples, travel=travel, y=still), shapes=still[None], shared=still[None])


@pytest.mark.parametrize(("white", "wander"), [(0.6, 1.4), (1.4, 0.6)])
def test_repeats_tell_both_noise_levels(white, wander):
    b = long_bench()
    finder = LevelFinder(b.samples, b.shapes)
    found = [finder(e) for e in errors(b, 15, np.random.default_rng(5), white=white, wander=wander)]
    assert {f.repeats for f in found} == {2}
    # the prior (0.35 in logarithm) pulls each by less than that
    assert np.mean(np.log([f.white for f in found])) == pytest.approx(np.log(white), abs=STEP)
    assert np.mean(np.log([f.wander for f in found])) == pytest.approx(np.log(wander), abs=STEP)


def test_what_the_model_lacks_does_not_change_the_noise_levels(monkeypatch):
    """Repeats share whatever is missing from the model, so it cancels; single runs that hold far more are not asked."""
    b = repeated_bench()
    drawn = errors(b, 1, np.random.default_rng(6))[0]
    missing = 5e-3 * np.sin(b.samples.travel)[:, None, :]
    monkeypatch.setattr("belt_sim.diagnosis.noise.find_scatter", lambda samples, groups, s: [])
    repeats_alone = LevelFinder(b.samples, b.shapes)
    assert b.finder(drawn + missing) == repeats_alone(drawn)


def test_what_settings_did_to_one_of_two_repeats_is_not_noise():
    """Each repeat has its own settings, and its own shape of what they do where predictions are taken."""
    b = long_bench()
    runs = np.arange(len(b.samples.runs))[:, None, None]
    shapes = (1e-4 * np.cos((1.0 + runs) * b.samples.travel[:, None, :] / 20.0))[None] + b.shapes
    drawn = errors(b, 1, np.random.default_rng(5))[0]
    off = 3.0 * np.random.default_rng(6).standard_normal(runs.shape)
    finder = LevelFinder(b.samples, shapes)
    clean, set_off = (np.array([f.white, f.wander, f.length]) for f in map(finder, (drawn, drawn + off * shapes[0])))
    np.testing.assert_allclose(np.log(set_off), np.log(clean), atol=1e-9)
    assert np.all(LevelFinder(b.samples, b.shapes)(drawn + off * shapes[0]).wander > clean[1])


@pytest.mark.parametrize("size", [1e9, 1e155])
def test_a_column_of_any_size_leaves_the_others_given_up(size):
    b = long_bench()
    bent, drift = (np.broadcast_to(f(b.samples.travel / 20.0)[:, None], b.samples.y.shape) for f in (np.sin, np.exp))
    beside = contrast(b.samples, np.stack([bent, drift]), (0,), (1.0,), 0)
    again = contrast(b.samples, np.stack([bent, size * drift]), (0,), (1.0,), 0)
    np.testing.assert_allclose(again.free @ again.free.T, beside.free @ beside.free.T, atol=ROUNDING)


def test_noise_is_found_beside_the_settings_as_predictions_are_expanded():
    b = repeated_bench()
    moved = b.moved_to(b.forward.null())
    assert moved.finder.shapes is moved.shapes
    assert moved.levels == moved.finder(b.samples.y - moved.forward.values(b.forward.null()[None])[0])


def test_where_repeats_and_single_runs_agree_all_runs_tell_the_white_noise(monkeypatch):
    """Two repeats of 40 readings leave a tenth open; what is fast in all runs leaves less."""
    b = repeated_bench()
    monkeypatch.setattr("belt_sim.diagnosis.noise.find_scatter", lambda samples, groups, s: [])
    repeats_alone = LevelFinder(b.samples, b.shapes)
    drawn = errors(b, 30, np.random.default_rng(9))
    width = [np.std(np.log([lv.white for lv in map(finder, drawn)])) for finder in (b.finder, repeats_alone)]
    assert width[0] < 0.9 * width[1]


def test_a_nuisance_is_what_one_sigma_of_it_does():
    """Tension and yaw as they may be set, and stiffness by E and 1/b^2, against predictions that far off."""
    b, off = bench(), []
    belt, settings = b.campaign.belt, b.campaign.settings
    stiffness = np.hypot(belt.youngs_modulus.u / belt.youngs_modulus.value, 2 * belt.width.u / belt.width.value)
    for size in (stiffness, settings.tension_rel, settings.yaw_u):
        off.append(b.forward.null())
        off[-1][len(b.forward.slots) + len(off) - 1] = size
    plain, *moved = b.forward.values(np.stack([b.forward.null(), *off]))
    for shape, there in zip((b.shared[0], b.shapes[0], b.shapes[1]), moved, strict=True):
        wanted = there - plain
        np.testing.assert_allclose(shape, wanted, atol=SECOND_ORDER * np.abs(wanted).max())


def test_a_belt_one_per_cent_wider_is_two_per_cent_stiffer_against_its_tension():
    """K^2 = F/EI = 12 sigma/(E b^2) at the tension that is set, sigma."""
    b = bench()
    belt = replace(b.campaign.belt, youngs_modulus=Quantity(value=210e9), width=Quantity(value=0.2, u=0.002))
    slopes = np.ones((len(NUISANCES), *b.samples.y.shape))
    _, shared = nuisance_shapes(replace(b.campaign, belt=belt), b.samples, 0.0 * slopes[0], slopes)
    np.testing.assert_allclose(shared[0], 1.01**2 - 1.0, rtol=0.01)


def test_zero_and_gain_of_a_sensor_move_its_own_readings_in_its_own_run():
    b, rng = bench(), np.random.default_rng(7)
    signals = tuple(replace(s, zero=1e-4, gain=0.02 + 0.01 * k) for k, s in enumerate(b.samples.signals))
    values = rng.normal(size=b.samples.y.shape)
    slopes = np.zeros((len(NUISANCES), *values.shape))
    shapes, _ = nuisance_shapes(b.campaign, replace(b.samples, signals=signals), values, slopes)
    assert len(shapes) == 2 + 2 * len(signals)
    for s, signal in enumerate(signals):
        for row, wanted in zip(shapes[2 + 2 * s : 4 + 2 * s], (signal.zero, signal.gain * values[:, s]), strict=True):
            np.testing.assert_allclose(row[:, s], np.broadcast_to(wanted, row[:, s].shape), rtol=EXACT)
            assert not np.delete(row, s, axis=1).any()


def test_white_noise_falls_with_the_root_of_what_was_averaged_and_wander_does_not():
    signal, still = bench().samples.signals[0], np.zeros((1, 1, 1, 2))
    travel = np.array([[0.0, signal.wander_length]])
    one = {"signals": (signal,), "travel": travel, "y": still[0], "per_bin": np.array([4.0])}
    metric = metric_of(replace(bench().samples, **one), Levels(white=2.0, wander=3.0), still, still)
    root = np.linalg.inv(metric.roots[metric.which[0, 0]])
    found = root @ root.T
    wander = (3.0 * signal.wander_sd) ** 2
    wanted = [[wander + signal.white**2, wander / np.e], [wander / np.e, wander + signal.white**2]]
    np.testing.assert_allclose(found, wanted, rtol=EXACT)


def test_an_error_of_twice_the_uncertainty_is_twice_the_uncertainty():
    """E is model minus measurement; where nothing has moved yet, white noise, wander and zero error are all."""
    b = replace(bench(), levels=Levels())
    u_val = validation_uncertainty(b)
    for s, signal in enumerate(b.samples.signals):
        at_rest = np.sqrt(signal.white**2 + signal.wander_sd**2 + signal.zero**2)
        np.testing.assert_allclose(u_val[:, s, 0], at_rest, rtol=1e-6)
    np.testing.assert_allclose(error_map(b, b.samples.y - 2.0 * u_val).ratio, -2.0, rtol=1e-9)


def test_without_repeats_and_with_nothing_known_of_the_candidates_the_stated_levels_hold():
    b = bench()
    found = LevelFinder(b.samples, b.shapes)(b.samples.y)
    assert [found.of_signal(s) for s in range(len(b.samples.signals))] == [(1.0, 1.0, Reach())] * len(b.samples.signals)
    assert "as stated" in found.sentence


def test_a_sensor_that_only_one_run_has_is_as_those_that_are_stated_alike():
    """A sensor added for one run has no repeats; one of another make stays as its own sheet says."""
    b = long_bench()
    first = b.samples.signals[0]
    signals = (first, replace(first, name="added"), replace(first, name="other", white=3.0 * first.white))
    y = np.full((len(b.samples.runs), 3, b.samples.y.shape[2]), np.nan)
    y[:, 0], y[0] = 0.0, 0.0
    drawn = errors(b, 1, np.random.default_rng(5), white=1.6, wander=1.6)[0][:, :1] + y
    shapes = np.broadcast_to(b.shapes[:, :, :1], (len(b.shapes), *y.shape))
    levels = LevelFinder(replace(b.samples, signals=signals, y=y), shapes)(drawn)
    assert levels.white[0] > 1.3
    first, second = (levels.of_signal(s) for s in (0, 1))
    np.testing.assert_allclose([*second[:2], second[2].length], [*first[:2], first[2].length])
    assert levels.of_signal(2)[:2] == (1.0, 1.0)
    finder = LevelFinder(replace(b.samples, signals=signals, y=y), shapes)
    at_random, _ = finder.draw(drawn, 400, np.random.default_rng(1))
    np.testing.assert_array_equal(at_random[:, 1], at_random[:, 0])
    assert np.ptp(at_random[:, 0, 0]) > 0.0
