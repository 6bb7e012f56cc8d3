"""A wander that has a slope everywhere is told from one that has none, and each is drawn as it is."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_bench import SPACING, SPREAD, WHITE, linear_bench, run
from scipy.linalg import toeplitz

from belt_sim.diagnosis.linearisation import draw_noise, rough_wander
from belt_sim.diagnosis.noise import LevelFinder, Levels, of_wander

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
    of_its_kind = [lv.of_signal(0) for lv in found if lv.smooth == smooth]
    assert np.mean(np.log([wander for _, wander, _ in of_its_kind])) == pytest.approx(0.0, abs=0.3)
    assert np.mean(np.log([reach.length for *_, reach in of_its_kind])) == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize(("correlation", "smooth"), [(ROUGH, False), (SLOPED, True)])
def test_single_runs_tell_it_too_beside_all_that_candidates_could_do(correlation, smooth):
    rng = np.random.default_rng(3)
    drawn = [readings(correlation, rng) for _ in range(20)]
    bench = linear_bench(SPREAD[: len(REPEATS)], SIGNAL, count=COUNT)
    bend = np.broadcast_to(np.linspace(-1.0, 1.0, COUNT) ** 2, (1, *bench.samples.y.shape))
    finder = LevelFinder(bench.samples, 0.0 * bend, 1e-3 * bend)
    assert np.mean([lv.smooth == smooth for lv in map(finder, drawn)]) >= 0.9


def test_what_is_fast_in_every_run_helps_two_repeats_to_tell():
    """Two short repeats and many runs beside them, each of which shows how its wander begins."""
    rng, runs = np.random.default_rng(4), (run(), run(), *(run(t * 1e6) for t in range(10, 40)))
    root = np.linalg.cholesky(toeplitz(SLOPED) + 1e-9 * np.eye(COUNT))
    share = []
    for seen in (slice(0, 2), slice(None)):
        bench = linear_bench(runs[seen], SIGNAL, count=COUNT)
        slow = rng.standard_normal((12, len(runs), 1, COUNT)) @ root.T
        y = SIGNAL.wander_sd * slow + SIGNAL.white * rng.standard_normal(slow.shape)
        share.append(np.mean([bench.finder.smooth_share(each[seen]) for each in y]))
    assert share[1] > share[0] + 0.2


def test_where_readings_do_not_tell_both_kinds_are_drawn():
    """Of the same readings some draws are smooth, as many as that is probable, and each kind has levels of its own."""
    y = readings(SLOPED, np.random.default_rng(5))[:2, :, :40]
    finder = linear_bench(REPEATS[:2], SIGNAL, count=40, y=y).finder
    share = finder.smooth_share(y)
    levels, smooth = finder.draw(y, 4000, np.random.default_rng(6))
    assert 0.05 < share < 0.95
    assert np.mean(smooth) == pytest.approx(share, abs=0.03)
    assert abs(np.log(levels[smooth] / np.median(levels[~smooth], axis=0)).mean(axis=0)).max() > 0.1


def test_chance_draws_a_smooth_wander_as_it_is():
    """Between neighbours it differs with the square of their distance, where a rough one does with the distance."""
    bench = linear_bench(REPEATS, SIGNAL, count=COUNT, levels=Levels(smooth=True))
    finder = SimpleNamespace(draw=lambda y, count, rng: (np.tile([1.0, 0.5, 1.0], (count, 1, 1)), np.ones(count, bool)))
    errors = draw_noise(replace(bench, finder=finder), bench.samples.y, 1500, np.random.default_rng(2))
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
    found = of_wander(np.array([[step]]), turn, smooth)[0]
    assert found == pytest.approx(wanted, rel=1e-9)


def test_wander_of_runs_that_were_read_elsewhere_is_that_of_their_own_travel():
    """The recursion, place by place, of what is drawn record by record."""
    apart, of = np.array([[0.5, 1.0, 0.1], [2.0, 0.0, 0.3]]), np.array([1, 0, 1])
    length, size = np.array([[1.0, 3.0], [2.0, 0.7]]), np.array([[1.0, 0.2], [0.5, 4.0]])  # (B, S)
    steps = apart.T[:, :, None, None] / length.T
    found = rough_wander(steps, of, size.T, np.random.default_rng(5))
    told = np.random.default_rng(5).standard_normal((2, 3, 2, 4))
    for b, r, s in np.ndindex(2, 3, 2):
        keep = np.exp(-apart[of[r]] / length[b, s])
        for k in range(3):
            told[b, r, s, k + 1] = keep[k] * told[b, r, s, k] + np.sqrt(1.0 - keep[k] ** 2) * told[b, r, s, k + 1]
        np.testing.assert_allclose(found[:, r, s, b], size[b, s] * told[b, r, s], rtol=1e-12)
