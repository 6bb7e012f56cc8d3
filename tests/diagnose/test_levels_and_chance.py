"""Noise levels that repeats leave possible, and what chance draws from them, against normal laws written down."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_bench import REPEATS, SPACING, SPREAD, WHITE, linear_bench

from belt_sim.diagnosis.choice.chance import beyond
from belt_sim.diagnosis.left_over.null import NoiseSource, NullGains, null_gains, rough_wander
from belt_sim.diagnosis.left_over.openset import open_set
from belt_sim.diagnosis.noise.contrasts import WINDOW
from belt_sim.diagnosis.noise.noise import Levels
from belt_sim.diagnosis.noise.signal_levels import LEVEL_SPREAD, TOGETHER

DRAWS = 4000
SIGMAS = 4.5
NORMAL = 0.1  # of a width: the law of a logarithm is not quite normal, and the grid ends at 2.6 sigma


def scattered(factor=1.0, runs=REPEATS, count=40):
    """Repeats that differ exactly as much as white noise of ``factor`` times the stated size would on the average, in
    what is fast and in the rest.
    """
    difference = np.random.default_rng(8).standard_normal(count)
    difference -= difference.mean()
    parabolas = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, WINDOW), 3))[0]
    fast = np.zeros(count)
    whole = count // WINDOW * WINDOW
    fast[:whole] = (difference[:whole].reshape(-1, WINDOW) @ (np.eye(WINDOW) - parabolas @ parabolas.T)).ravel()
    freedom = whole // WINDOW * (WINDOW - 3)
    parts = ((fast, freedom), (difference - fast, count - 1 - freedom))
    difference = sum(part * np.sqrt(2.0 * many / np.sum(part**2)) for part, many in parts)
    return factor * WHITE.white * np.stack([difference, 0.0 * difference])[:, None]


@pytest.fixture(scope="module")
def drawn():
    """Logarithms (DRAWS, 3) of factors on white noise and on a wander of which the readings say nothing."""
    y = scattered()
    bench = linear_bench(REPEATS, y=y)
    return np.log(bench.finder.draw(y, DRAWS, np.random.default_rng(1))[0])[:, 0]


def test_where_readings_say_nothing_the_data_sheet_and_the_other_noise_are_all_that_is_known(drawn):
    """The white noise is as stated; what both levels have in common is then known no better than that allows."""
    wander = drawn[:, 1]
    common = 1.0 / (TOGETHER**-2 + LEVEL_SPREAD**-2)
    width = np.sqrt(common + LEVEL_SPREAD**2)
    assert np.mean(wander) == pytest.approx(0.0, abs=SIGMAS * width / np.sqrt(DRAWS))
    assert np.std(wander) == pytest.approx(width, rel=NORMAL)


def test_without_repeats_levels_are_drawn_from_the_data_sheet():
    """One sigma either way, and none further off than the grid of levels goes."""
    finder = linear_bench(SPREAD).finder
    drawn = np.log(finder.draw(np.zeros((6, 1, 40)), DRAWS, np.random.default_rng(7))[0])[:, 0, :2]
    assert np.quantile(drawn, [0.25, 0.5, 0.75]) == pytest.approx(
        LEVEL_SPREAD * np.array([-0.6745, 0, 0.6745]), abs=0.02
    )
    assert np.abs(drawn).max() < np.log(2.5)


def test_readings_narrow_a_level_by_their_number(drawn):
    """The logarithm of a level is known from m differences to 1/sqrt(2 m); what is fast in the mean tells it again."""
    width = 1.0 / np.sqrt(2.0 * (39 + 25) + LEVEL_SPREAD**-2)
    assert np.mean(drawn[:, 0]) == pytest.approx(0.0, abs=0.3 * width)
    assert np.std(drawn[:, 0]) == pytest.approx(width, rel=NORMAL)


@pytest.mark.parametrize("count", [14, 40])
def test_the_level_taken_lies_between_readings_and_data_sheet(count):
    """Nearer to what was read the more there are: m (1 - r^2/f^2) + log f / (0.35^2 + 0.6^2) = 0."""
    y = scattered(1.8, count=count)
    f = linear_bench(REPEATS, y=y, count=count).finder(y).white
    fine = np.linspace(1.0, 1.8, 8001)
    balance = (count - 1) * (1.0 - (1.8 / fine) ** 2) + np.log(fine) / (LEVEL_SPREAD**2 + TOGETHER**2)
    assert np.log(f) == pytest.approx(np.log(fine[np.argmin(np.abs(balance))]), abs=0.05)  # half a step of the grid


def test_runs_that_are_shorter_than_others_leave_levels_as_they_are():
    """What a short run has not measured says nothing of the noise of the others."""
    y = np.concatenate([scattered(1.4), scattered(1.4)[:1]])
    whole = linear_bench((*REPEATS, SPREAD[-1]), y=y).finder
    y[2, :, 16:] = np.nan
    short = linear_bench((*REPEATS, SPREAD[-1]), y=y).finder
    assert short(y).white == pytest.approx(whole(np.nan_to_num(y)).white, rel=0.1)
    assert np.isfinite(short.draw(y, 5, np.random.default_rng(1))[0]).all()


def test_chance_draws_each_noise_at_its_own_level():
    """White noise shows between neighbours however near; wander in what a whole run keeps."""
    signal = replace(WHITE, wander_sd=2e-5, wander_length=20 * SPACING)
    bench = linear_bench(REPEATS, signal, per_bin=4.0)
    finder = SimpleNamespace(
        draw=lambda y, count, rng: (np.tile([3.0, 0.5, 1.0], (count, 1, 1)), np.zeros(count, bool))
    )
    errors = NoiseSource(replace(bench, finder=finder), bench.samples.y, np.random.default_rng(2)).draw(DRAWS)
    white, wander = (3.0 * signal.white) ** 2 / 4.0, (0.5 * signal.wander_sd) ** 2
    for apart in (1, 20):
        jumps = errors[..., apart:] - errors[..., :-apart]
        wanted = 2.0 * white + 2.0 * wander * (1.0 - np.exp(-apart / 20))
        assert np.mean(jumps**2) == pytest.approx(wanted, rel=0.03)
    assert np.mean(errors**2) == pytest.approx(white + wander, rel=0.03)


def test_what_is_fitted_already_gains_nothing_more():
    """A candidate of two parameters, one of which the current model has: the other's gain is chi2 of one degree."""
    rng = np.random.default_rng(3)
    current, new = 1e-4 * rng.normal(size=(2, 1, len(SPREAD), 1, 40))
    bench = linear_bench(SPREAD)
    shapes = {"same": 2.0 * current, "more": np.concatenate([current, new + 0.5 * current])}
    levels = Levels(white=(1.0,), wander=(1.0,))
    finder = SimpleNamespace(draw=lambda e, count, rng: (np.ones((count, 1, 3)), np.zeros(count, bool)))
    exact = replace(bench, finder=finder, levels=levels)
    null = null_gains(exact, shapes, current, 0.0 * current[0], count=2000, seed=4)
    assert null.dof == {"same": 0, "more": 1}
    assert not null.gains["same"].any()
    assert np.mean(null.gains["more"]) == pytest.approx(1.0, abs=SIGMAS * np.sqrt(2.0 / 2000))
    assert np.var(null.gains["more"]) == pytest.approx(2.0, rel=0.4)


def test_chance_is_judged_at_the_noise_that_readings_are_judged_at():
    """Noise twice as large as believed gives four times the gain: nothing is read off what was drawn."""
    shape = 1e-4 * np.ones((1, len(SPREAD), 1, 40))
    finder = SimpleNamespace(draw=lambda e, count, rng: (2.0 * np.ones((count, 1, 3)), np.zeros(count, bool)))
    bench = replace(linear_bench(SPREAD), finder=finder, levels=Levels(white=(1.0,), wander=(1.0,)))
    null = null_gains(bench, {"bow": shape}, shape[:0], 0.0 * shape[0], count=2000, seed=4)
    assert null.inflation("bow") == pytest.approx(4.0, rel=0.2)


@pytest.mark.parametrize(
    ("sizes", "named"),
    [({"odd": 0.0}, None), ({"odd": 3.0}, "smooth, odd in yaw"), ({"even": 3.0}, "smooth, even in yaw")],
)
def test_what_no_effect_explains_is_left_over_and_readings_that_are_met_leave_nothing(sizes, named):
    """A slow bow of three sigma in every run, of one sign or of the yaw's sign."""
    ((parity, size),) = sizes.items()
    bow = size * WHITE.white * np.cos(np.linspace(0.0, np.pi, 40))
    signs = np.array([np.sign(r.yaw) if parity == "odd" else 1.0 for r in SPREAD])
    bench = linear_bench(SPREAD, y=signs[:, None, None] * bow)
    fit = bench.fit([bench.start((), bench.forward.null())])[0]
    test = open_set(bench, fit, bootstraps=200, seed=6)
    assert (named in test.failed) if named else not test.failed
    if named:
        most = max(gain for n, gain in test.gain.items() if n.startswith("smooth"))
        assert test.gain[named] == pytest.approx(most, rel=1e-9)  # all signals alike: the same of a single one
    assert all((n in test.failed) == (test.gain[n] > test.threshold[n]) for n in test.gain)


def test_alternatives_are_so_many_tries_and_no_broader_law():
    """The best of 30 independent gains of two degrees of freedom exceeds g with 1 - (1 - exp(-g/2))^30."""
    each = np.random.default_rng(11).chisquare(2, (4000, 30))
    null = NullGains({"a": each.max(axis=1)}, {"a": 2}, {"a": float(each.mean())})
    for log_p in (-2.0, -6.5):
        right = -2.0 * np.log(-np.expm1(np.log1p(-np.exp(log_p)) / 30))
        assert null.threshold("a", log_p) == pytest.approx(right, abs=0.4)
        assert float(null.log_p("a", null.threshold("a", log_p))) == pytest.approx(log_p)
    broader = NullGains(null.gains, null.dof)
    assert broader.threshold("a", -6.5) > null.threshold("a", -6.5) + 10.0
    far = -200.0 / null.inflation("a") + np.log(null.tries("a"))
    assert float(null.log_p("a", 400.0)) == pytest.approx(far)


def test_the_limit_of_the_largest_hardly_moves_with_the_seed():
    """The largest of 200 draws is another by a tenth with every seed; the law of all of them is not."""
    rng = np.random.default_rng(4)
    drawn = np.exp(0.3 * rng.standard_normal((40, 200, 5))).max(axis=2)
    limits = np.log([beyond(each, 0.002) for each in drawn])
    assert np.std(limits) < 0.05 < np.std(np.log(drawn.max(axis=1)))
    exceeded = np.exp(0.3 * rng.standard_normal((200_000, 5))).max(axis=1) > np.exp(np.mean(limits))
    assert 0.0005 < np.mean(exceeded) < 0.004


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
