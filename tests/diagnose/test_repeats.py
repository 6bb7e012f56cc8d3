"""Repeats that disagree tell of a change between runs; their difference is no noise."""

from dataclasses import replace

import numpy as np
import pytest
from small_campaign import CLASSES, MODEL, REPEATED

from belt_sim.diagnosis.noise import DISAGREE, words_of
from belt_sim.diagnosis.workbench import workbench
from belt_sim.virtual_rig.make import make_campaign

SWING, LENGTH = 0.5e-3, 8.0  # [m]: by which the last repeat differs from the others, over such a length


def bench_of(swing: float):
    campaign = make_campaign(seed=2, plan=REPEATED)[0]
    *others, last = campaign.runs
    grown = {name: y + swing * np.sin(2.0 * np.pi * last.travel / LENGTH) for name, y in last.signals.items()}
    return workbench(replace(campaign, runs=(*others, replace(last, signals=grown))), MODEL, CLASSES)


def test_repeats_within_the_noise_are_noise():
    bench = bench_of(0.0)
    assert bench.finder.disagreements == []
    assert bench.levels.repeats > 0


def test_repeats_that_disagree_are_told_and_are_no_noise():
    bench, quiet = bench_of(SWING), bench_of(0.0)
    found = bench.finder.disagreements
    assert {d.signal.name for d in found} == {"y1", "y4"}
    assert all(d.times > DISAGREE for d in found)
    assert bench.levels.repeats == quiet.levels.repeats - 1
    assert np.max(bench.levels.wander) < 1.5 * np.max(quiet.levels.wander)
    words = words_of(found)
    assert found[0].runs[-1] in words
    assert "something changes between runs" in words


@pytest.mark.parametrize("odd", [0, 2])
def test_of_several_repeats_the_odd_one_is_named(odd):
    """Contrasts compare each run with the mean of those before it, so that a spoilt first run shows in all of them."""
    campaign = make_campaign(seed=2, plan=REPEATED)[0]
    first, rng = campaign.runs[0], np.random.default_rng(3)
    runs = []
    for k in range(4):
        swing = SWING * np.sin(2.0 * np.pi * first.travel / LENGTH) * (k == odd)
        signals = {n: y + swing + rng.normal(0.0, 2e-5, len(y)) for n, y in first.signals.items()}
        runs.append(replace(first, name=f"q{k}", repeat_of="q0" if k else None, signals=signals))
    found = workbench(replace(campaign, runs=tuple(runs)), MODEL, CLASSES).finder.disagreements
    assert {d.runs[-1] for d in found} == {f"q{odd}"}
    assert len(found) == 2
    assert words_of(found).startswith(f"run q{odd} lies furthest from the median of its repeats q")
