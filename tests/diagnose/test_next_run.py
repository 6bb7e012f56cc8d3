"""The next run: opposite yaw tells an offset of the pulley from an error of a sensor."""

from dataclasses import replace

import numpy as np
import pytest
from small_campaign import CLASSES, MODEL, TENSIONS, campaign

from belt_sim.diagnosis.confusable import Rival
from belt_sim.diagnosis.nextrun import RESOLVED, Outlook, next_runs
from belt_sim.diagnosis.workbench import workbench
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


def test_no_pair_no_advice():
    bench = workbench(campaign("nothing"), MODEL, CLASSES)
    base = bench.fit([bench.start((), bench.forward.null())])[0]
    assert next_runs(bench, base, []) == []
