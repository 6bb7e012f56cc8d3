"""The next run: opposite yaw tells an offset of the pulley from an error of a sensor."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import ndtr
from small_campaign import CLASSES, MODEL, TENSIONS, campaign

from belt_sim.diagnosis import next_run
from belt_sim.diagnosis.describe import rivals
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.forward import Forward
from belt_sim.diagnosis.next_run import Outlook, Rival, menu, next_runs
from belt_sim.diagnosis.workbench import workbench
from belt_sim.results.diagnosis import RESOLVED, SURE_APART
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import TEST_YAWS, grid

UNRESOLVED = 2.0  # sigma


@pytest.fixture(scope="module")
def one_sided():
    """Only one sign of yaw was run, and the pulley is off: yaw_offset_tail, or is it the sensors' gain?"""
    from small_campaign import SPREAD

    plan = replace(SPREAD, runs=grid(TENSIONS, TEST_YAWS[1:], repeats=3))
    made, _ = make_campaign(hidden=[{"id": "yaw_offset_tail", "beta_0": 5e-5}], seed=3, plan=plan)
    bench = workbench(made, MODEL, CLASSES)
    fits = {i: bench.fit([bench.start((i,), bench.forward.null())])[0] for i in ("yaw_offset_tail", "sensor_gain")}
    return bench, fits["yaw_offset_tail"], fits["sensor_gain"]


def test_opposite_yaw_tells_an_offset_from_a_gain(one_sided):
    bench, offset, gain = one_sided
    outlook = Outlook(bench, offset)
    before, after = outlook.separations(offset, gain)
    words = [a.words for a in outlook.actions]
    opposite = next(k for k, w in enumerate(words) if w.startswith("run at opposite yaw"))
    assert before < UNRESOLVED
    assert after[opposite] > RESOLVED
    assert np.all(after >= before - 1e-6)  # no further run makes two explanations more alike


def test_two_explanations_are_as_far_apart_whichever_is_right(one_sided):
    """Gains of the sensors, one each, can follow an offset where that cannot follow them."""
    bench, offset, gain = one_sided
    outlook = Outlook(bench, offset)
    ways = [outlook.separations(*pair) for pair in ((offset, gain), (gain, offset))]
    assert ways[0][0] == pytest.approx(ways[1][0])
    np.testing.assert_allclose(ways[0][1], ways[1][1], rtol=1e-6)
    least = [left_by(bench, gain, offset), left_by(bench, offset, gain)]
    assert ways[0][0] == pytest.approx(min(least))


def left_by(bench, right, other) -> float:
    """What refitting ``other`` leaves of what tells it from ``right``, in the linear range."""
    known = bench.metric.whiten(right.values - other.values)
    columns = other.columns.reshape(len(other.free), -1)
    return float(np.linalg.norm(known - np.linalg.lstsq(columns.T, known, rcond=1e-9)[0] @ columns))


def test_the_best_action_comes_first(one_sided):
    bench, offset, gain = one_sided
    pair = Rival("yaw_offset_tail", "sensor_gain", 0.1, gain)
    advice = next_runs(bench, offset, [pair])
    assert [a.sigma_after for a in advice] == sorted((a.sigma_after for a in advice), reverse=True)
    assert {a.separates for a in advice} == {("yaw_offset_tail", "sensor_gain")}
    assert any("opposite yaw" in a.action or "zero yaw" in a.action or "reversed" in a.action for a in advice)


def test_a_pair_has_one_separation(one_sided):
    """The sigma by which two explanations are alike is that from which a further run starts."""
    bench, offset, gain = one_sided
    alike = SimpleNamespace(confusable={"yaw_offset_tail": (("sensor_gain",),)})
    search = SimpleNamespace(fits={frozenset(gain.ids): gain})
    (pair,) = rivals(SimpleNamespace(decision=alike, search=search, named=offset, fitted_bench=bench))
    assert all(a.sigma_before == pytest.approx(pair.sigma) for a in next_runs(bench, offset, [pair]))


def test_two_changes_at_once_are_tried_where_one_is_not_enough(one_sided, monkeypatch):
    bench, offset, gain = one_sided
    pairs = [Rival("yaw_offset_tail", "sensor_gain", 0.1, gain)]
    one = next_runs(bench, offset, pairs)
    assert one[0].sigma_after > next_run.SURE_APART
    assert not any(", twice as long" in a.action for a in one)
    monkeypatch.setattr(next_run, "SURE_APART", np.inf)
    two = next_runs(bench, offset, pairs)
    assert len(two) == len(one)
    assert two[0].sigma_after > one[0].sigma_after
    assert ", twice as long" in two[0].action


def test_an_action_by_itself_says_what_it_says_among_others(one_sided):
    bench, offset, gain = one_sided
    outlook = Outlook(bench, offset)
    turned = next(k for k, a in enumerate(outlook.actions) if a.settings.turned_over)
    for k in (0, turned):
        _, among = outlook.separations(offset, gain)
        _, alone = outlook.single(k).separations(offset, gain)
        assert alone == pytest.approx(among[k], rel=1e-6)


def test_a_run_in_which_the_belt_leaves_its_pulleys_promises_nothing(one_sided, monkeypatch):
    """And leaves the others what they promise, without a word of numbers that are none."""
    bench, offset, gain = one_sided
    outlook = Outlook(bench, offset)
    before, wanted = outlook.separations(offset, gain)
    lanes = Forward.values_and_slopes

    def off(forward, vectors, directions):
        values, slopes = lanes(forward, vectors, directions)
        if forward is outlook.forward:
            values[:, 1, :, 5:], slopes[:, 1, :, 5:] = np.inf, np.nan
        return values, slopes

    monkeypatch.setattr(Forward, "values_and_slopes", off)
    outlook.metric = outlook._metric()
    _, found = outlook.separations(offset, gain)
    assert found[1] == before < wanted[1]
    others = [k for k in range(len(wanted)) if k != 1]
    assert found[others] == pytest.approx(wanted[others], rel=1e-6)


def test_every_advice_says_in_numbers_what_it_says_in_words():
    template = campaign("nothing").runs[0]
    actions = [*menu(template), *menu(template, twofold=True)]
    assert len({a.words for a in actions}) == len(actions)
    for a in actions:
        assert f", {a.settings.travel:.0f} m" in a.words
        assert ("reversed)" in a.words) == (a.settings.direction < 0)
        assert ("all four points" in a.words) == a.settings.all_points
        assert ("turn the belt over" in a.words) == a.settings.turned_over


@pytest.mark.parametrize(("bent", "left"), [(0.0, 1.0), (1.0, 0.0)])
def test_a_promise_is_kept_by_what_marches_and_not_by_derivatives(bent, left):
    """Of two readings to come the number x of one explanation moves the first by 2 x, and the second by x^2 as well."""

    def march(x):
        return np.array([2.0 * x, bent * x**2]), np.array([[2.0, 2.0 * bent * x]])

    def predict(fit, free):
        values, slopes = march(fit.vector[0]) if free else (np.array([2.0, 1.0]), np.empty((0, 2)))
        return values[None], slopes[:, None]

    still = np.zeros(1)
    bench = SimpleNamespace(metric=SimpleNamespace(whiten=lambda x: x))
    outlook = SimpleNamespace(
        bench=bench, predict=predict, white=lambda x: x, here=lambda fit: (still, np.zeros((1, 1)))
    )
    right, other = SimpleNamespace(values=still), Fit(ids=("a",), free=[0], vector=np.array([0.1]))
    assert Outlook.separation_after_refit(outlook, right, other) == pytest.approx(left, abs=0.01)


def test_a_promise_that_tells_two_apart_is_kept_in_97_of_100_campaigns():
    """Twice the difference of log likelihoods is normal about s^2, with 2 s; 19 to 1 is 95 % of the probability."""
    kept = [float(ndtr((0.5 * s**2 - np.log(19.0)) / s)) for s in (RESOLVED, 4.0, SURE_APART)]
    assert kept == pytest.approx([0.70, 0.90, 0.97], abs=0.005)


def test_no_pair_no_advice():
    bench = workbench(campaign("nothing"), MODEL, CLASSES)
    base = bench.fit([bench.start((), bench.forward.null())])[0]
    assert next_runs(bench, base, []) == []


def test_a_fit_that_has_ended_is_not_marched_again(one_sided, monkeypatch):
    bench, offset, _ = one_sided
    outlook = Outlook(bench, offset)
    values, slopes = bench.forward.expand(offset.vector, offset.free)
    np.testing.assert_array_equal(outlook.here(offset)[0], values)
    np.testing.assert_allclose(outlook.here(offset)[1], slopes, rtol=1e-4, atol=1e-4 * np.abs(slopes).max())
    vector = offset.vector.copy()
    vector[offset.free] += 0.1
    moved = replace(offset, vector=vector, settled=False)
    assert not np.allclose(outlook.here(moved)[0], values, rtol=1e-6, atol=0.0)
    monkeypatch.setattr(type(bench.forward), "values_and_slopes", None)
    outlook.here(offset)
    with pytest.raises(TypeError):
        outlook.here(moved)
