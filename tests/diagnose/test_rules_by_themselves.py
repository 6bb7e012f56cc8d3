"""Rules of the diagnosis on made-up numbers whose answer is known: held-out errors, choosing, chance, what is left."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from belt_sim.diagnosis.choice.chance import Chance
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import Condition, HeldOut, _surprise, held_out
from belt_sim.diagnosis.left_over.null import NullGains
from belt_sim.diagnosis.left_over.openset import OpenSet, apart, basis
from belt_sim.diagnosis.left_over.shape_card import _exponent, _onset, _required_angle, _wavelength, shape_card

EXACT = 1e-6  # of a refit with its wide prior
YAW, LENGTH = 7e-4, 11.28
TRAVEL = np.linspace(0.0, 30.0, 121)
SIGNALS = (SimpleNamespace(kind="lateral", at="point_1", white=1e-5, wander_sd=1e-5),)
RUNS = tuple(
    SimpleNamespace(tension=t, yaw=yaw, use="fit") for t in (7e6, 14e6, 40e6) for yaw in (YAW, -YAW)
)  # fmt: skip


#: a parameter of which a machine leaves everything open
OPEN = SimpleNamespace(plausible=(-1e6, 1e6), null=0.0)
EFFECT = SimpleNamespace(id="a", parameters={"size": OPEN}, is_additive=lambda: False)
SLOT = SimpleNamespace(scale=1.0, name="size", effect=EFFECT)


class Plain:
    """A bench whose readings are white and of unit variance already: six runs of one signal."""

    def __init__(self, y):
        rig = SimpleNamespace(span_length=LENGTH)
        self.samples = SimpleNamespace(
            runs=RUNS, signals=SIGNALS, y=y, travel=np.tile(TRAVEL, (len(RUNS), 1)), cases=SimpleNamespace(rig=rig)
        )
        self.metric = SimpleNamespace(whiten=lambda x: x.reshape(*x.shape[:-3], -1))
        self.forward = SimpleNamespace(
            slots=(SLOT, SLOT),
            null=lambda: np.zeros(2),
            sides=(np.full(2, -np.inf), np.full(2, np.inf)),
        )


def fitted(slopes, y):
    """A fit at the parameter vector 0 of parameters with these slopes (k, R, S, n)."""
    whole = slopes.reshape(len(slopes), -1)
    return Fit(
        ids=("a", "b")[: len(slopes)], free=list(range(len(slopes))), vector=np.zeros(2), chi2=float(np.sum(y**2)),
        columns=whole, slopes=slopes, residual=y.ravel(), values=np.zeros_like(y),
    )  # fmt: skip


def shapes():
    return np.random.default_rng(1).normal(size=(2, len(RUNS), 1, len(TRAVEL)))


def test_what_the_other_runs_know_is_predicted_where_it_was_left_out():
    truth = np.array([3.0, -2.0])
    y = np.einsum("k,krsn->rsn", truth, shapes())
    found = held_out(Plain(y), fitted(shapes(), y))
    assert found.rms < EXACT * np.std(y)
    assert set(found.by_condition) == {"7 N/mm2", "14 N/mm2", "40 N/mm2", "yaw +", "yaw -"}
    learned = 2 * (3 * np.log(3 / 2) + 2 * np.log(2))  # two numbers, known from two thirds and from half of the runs
    assert found.chi2 == pytest.approx(learned, rel=0.05)


def test_a_condition_is_not_predicted_from_itself():
    """One tension that contradicts the others is off by the whole difference, and its own runs do not help it."""
    rows = shapes()[:1]
    y = 2.0 * rows[0].copy()
    y[:2] *= -1.0  # at 7 N/mm2
    found = held_out(Plain(y), fitted(rows, y))
    assert found.by_condition["7 N/mm2"] == pytest.approx(4.0 * np.sqrt(np.mean(rows[0, :2] ** 2)), rel=EXACT)


def test_what_only_the_left_out_runs_show_is_said_to_be_untested():
    """One number that acts at 7 N/mm2 alone: nothing else knows it, so it falls back to null there."""
    rows = np.zeros_like(shapes()[:1])
    rows[0, :2] = shapes()[0, :2]
    y = 3.0 * rows[0]
    at_joint_fit = replace(fitted(rows, 0.0 * y), vector=np.array([3.0, 0.0]), values=y)
    found = held_out(Plain(y), at_joint_fit)
    assert found.untestable == ("7 N/mm2",)
    assert found.by_condition["7 N/mm2"] == pytest.approx(3.0 * np.sqrt(np.mean(rows[0, :2] ** 2)), rel=EXACT)
    assert found.by_condition["yaw +"] < EXACT


def test_a_large_effect_that_is_known_does_not_hide_that_a_small_one_is_not():
    """Beside another of a thousand sigma, what only 7 N/mm2 shows is nothing that hold-out can test there."""
    rows = shapes()
    rows[0, 2:] *= 1e-3
    numbers = np.array([3.0, 1000.0])
    y = np.einsum("k,krsn->rsn", numbers, rows)
    at_joint_fit = replace(fitted(rows, 0.0 * y), vector=numbers, values=y)
    bench = Plain(y)
    bench.forward.slots = (
        SLOT,
        SimpleNamespace(scale=1.0, name="size", effect=SimpleNamespace(**vars(EFFECT) | {"id": "b"})),
    )
    assert held_out(bench, at_joint_fit).untestable == ("7 N/mm2",)


def test_numbers_that_are_known_together_only_are_known():
    """An offset and a gain that act nearly alike: each may be nothing, what they do is known well."""
    first, other = shapes()
    rows = np.stack([first, first + 0.02 * other])
    y = 3.0 * first
    at_joint_fit = replace(fitted(rows, 0.0 * y), vector=np.array([2.0, 1.0]), values=y)
    assert np.sqrt(at_joint_fit.covariance[1, 1]) > 1.0
    assert held_out(Plain(y), at_joint_fit).untestable == ()


def test_a_condition_that_the_other_runs_leave_open_is_untested_though_the_fit_is_nothing_there():
    rows = np.zeros_like(shapes()[:1])
    rows[0, :2] = shapes()[0, :2]
    at_joint_fit = replace(fitted(rows, 0.0 * rows[0]), vector=np.array([0.01, 0.0]))
    assert held_out(Plain(0.0 * rows[0]), at_joint_fit).untestable == ("7 N/mm2",)


@pytest.mark.parametrize(("elsewhere", "untestable"), [(0.005, ("7 N/mm2",)), (0.1, ())])
def test_a_number_that_may_as_well_be_nothing_without_the_left_out_runs_is_not_tested_there(elsewhere, untestable):
    """A camber acts at a low tension: at 40 N/mm2 it does so little that its size is known to several times itself."""
    rows = shapes()[:1]
    rows[0, 2:] *= elsewhere
    y = 3.0 * rows[0]
    at_joint_fit = replace(fitted(rows, 0.0 * y), vector=np.array([3.0, 0.0]), values=y)
    assert held_out(Plain(y), at_joint_fit).untestable == untestable


@pytest.mark.parametrize(("least", "number"), [(-np.inf, -6.0), (0.0, 0.0)])
def test_a_number_that_a_machine_has_on_one_side_of_null_stays_there_without_the_left_out_runs(least, number):
    """At the lowest tension the readings ask for 3, elsewhere for -6."""
    shape = shapes()[:1]
    y = shape[0] * np.array([3.0, 3.0, *[-6.0] * 4])[:, None, None]
    bench = Plain(y)
    bench.forward.sides = np.full(2, least), np.full(2, np.inf)
    without = held_out(bench, fitted(shape, y)).conditions["7 N/mm2"]
    np.testing.assert_allclose(without.left, (y - number * shape[0])[:2], rtol=EXACT, atol=1e-4)


def test_surprise_is_the_density_of_a_normal_law():
    rng = np.random.default_rng(2)
    here, rest, left = rng.normal(size=(2, 1, 5)), rng.normal(size=(2, 1, 7)), rng.normal(size=5)
    known = np.linalg.inv(rest[:, 0] @ rest[:, 0].T)
    covariance = np.eye(5) + here[:, 0].T @ known @ here[:, 0]
    wanted = -2.0 * multivariate_normal(cov=covariance).logpdf(left) - 5 * np.log(2 * np.pi)
    assert _surprise(left, here[:, 0], rest[:, 0], np.full(2, 1e6)) == pytest.approx(wanted, rel=1e-4)


def test_thresholds_are_passed_by_chance_as_often_as_stated():
    rng = np.random.default_rng(3)
    inflated = {"one": 1.5 * rng.chisquare(1, 20000), "five": 1.5 * rng.chisquare(5, 20000)}
    null = NullGains(inflated, {"one": 1, "five": 5})
    critical = null.critical(["one", "five"], 0.05)
    above = np.any([inflated[n] > null.threshold(n, critical) for n in inflated], axis=0)
    assert np.mean(above) == pytest.approx(0.05, abs=0.005)
    for name in inflated:
        assert null.log_p(name, null.threshold(name, critical)) == pytest.approx(critical, rel=1e-9)
        assert null.log_p(name, 2.0 * null.threshold(name, critical)) < critical


@pytest.mark.parametrize(("sigmas", "vetoed"), [(3.5, False), (4.0, True)])
def test_an_error_rises_by_chance_in_one_of_a_dozen_conditions_less_than_once_in_1000_campaigns(sigmas, vetoed):
    """Settings that happen to undo a right effect in one condition do not cost it its name."""
    apart_by = np.array([1.0, -1.0, 1.0, -1.0]) / 2.0
    after = -sigmas * apart_by
    new, old = (
        Condition(-100.0 * k, e, np.zeros((0, 4)), np.zeros(4, dtype=int), np.array([True]), e[None, None])
        for k, e in ((1, after), (0, after + apart_by))
    )
    chance = Chance({"yaw +": apart_by[None]})
    said = chance.worse(HeldOut(-100.0, 1.0, {"yaw +": new}), HeldOut(0.0, 1.0, {"yaw +": old}))
    assert said == (("yaw +",) if vetoed else ())


def test_rare_thresholds_come_from_the_tail_of_all_draws():
    """One in a hundred of few draws: the fourth smallest p would be another with every seed."""
    dof = {f"{n}": 1 + n % 2 for n in range(6)}
    said, fourth = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        null = NullGains({n: rng.chisquare(k, 400) for n, k in dof.items()}, dof)
        said.append(null.critical(list(dof), 0.01))
        fourth.append(np.sort(np.min([null.log_p(n, null.gains[n]) for n in dof], axis=0))[3])
    assert np.mean(said) == pytest.approx(np.log(1.0 - 0.99 ** (1 / 6)), abs=0.25)
    assert np.std(said) < 0.8 * np.std(fourth)


def test_u_is_the_scatter_of_refits_to_white_noise():
    rng = np.random.default_rng(4)
    columns = rng.normal(size=(2, 30)) * [[1.0], [5.0]]
    noise = rng.normal(size=(4000, 30))
    refits = np.linalg.lstsq(columns.T, noise.T, rcond=None)[0]
    said = Fit(ids=("a",), free=[0, 1], vector=np.zeros(2), columns=columns).covariance
    spread = np.sqrt(np.diag(said))
    np.testing.assert_allclose(np.cov(refits) / np.outer(spread, spread), said / np.outer(spread, spread), atol=0.08)


def test_what_the_fitted_effects_could_take_is_not_left_over():
    y = np.random.default_rng(5).normal(size=shapes()[0].size)
    both = shapes().reshape(2, -1)
    inside = basis(both[:1])
    left = basis(apart(both[1:] + 2.0 * both[:1], inside))
    gain = np.sum((apart(y[None], inside) @ left.T) ** 2)
    alone, together = (np.linalg.lstsq(rows.T, y, rcond=None)[1][0] for rows in (both[:1], both))
    assert gain == pytest.approx(alone - together, rel=EXACT)


def residual(curve, weights):
    """Readings (R, S, n) that follow one curve with a weight for every run."""
    return np.asarray(weights)[:, None, None] * curve[None, None]


def test_the_shape_of_an_unknown_is_read_off_what_is_left():
    """A contact angle of 20 urad lifts the belt by theta L (1 - exp(-s/L)); a kink at 5 m begins at 5 m."""
    sign, slack = (
        np.array([f(r) for r in RUNS]) for f in (lambda r: np.sign(r.yaw), lambda r: (r.tension / 7e6) ** -1.5)
    )
    angle = 2e-5
    y = residual(angle * LENGTH * (1.0 - np.exp(-TRAVEL / LENGTH)), sign)
    found = _required_angle(Plain(y), y, sign)
    np.testing.assert_allclose(found.angle, angle, rtol=1e-3)
    assert _exponent(Plain(y).samples, y * slack[:, None, None]) == pytest.approx(-1.5, abs=1e-9)
    late = residual(1e-3 * np.maximum(TRAVEL - 5.0, 0.0), slack)
    assert _onset(Plain(late), late) == pytest.approx(5.0, abs=0.6)


def test_a_line_in_what_is_left_has_its_wavelength():
    y = residual(1e-4 * np.sin(2 * np.pi * TRAVEL / 2.5), np.ones(len(RUNS)))
    assert _wavelength(Plain(y).samples, y) == pytest.approx(2.5, rel=0.05)
    noise = np.random.default_rng(6).normal(size=y.shape)
    assert _wavelength(Plain(y).samples, noise) is None


@pytest.mark.parametrize(("odd", "even", "word"), [(90.0, 10.0, "odd"), (10.0, 90.0, "even"), (50.0, 50.0, "mixed")])
def test_the_parity_of_an_unknown_is_where_most_of_it_lies(odd, even, word):
    y = residual(1e-4 * np.sin(TRAVEL), np.ones(len(RUNS)))
    test = OpenSet(("x",), {}, {"smooth, odd in yaw": odd, "smooth, even in yaw": even}, {})
    assert shape_card(Plain(y), fitted(shapes()[:1], y), test, None).parity == word
