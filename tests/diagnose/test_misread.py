"""A record with its sign turned, or two exchanged, is seen by what the model says of its run."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_bench import SPREAD, WHITE, linear_bench

from belt_sim.campaign import Suspicion
from belt_sim.diagnosis.examine import confirm_signs, find_faults, find_misread_run
from belt_sim.diagnosis.noise import Levels, metric_of

COUNT = 40
S = np.arange(COUNT) / COUNT
Y1, Y4 = 3e-5 * S, 3e-5 * (1.0 - np.exp(-5.0 * S))
PATHS = np.stack([np.stack([np.sign(r.yaw) * Y1, np.sign(r.yaw) * Y4]) for r in SPREAD])


def laid_out(y):
    """A workbench of two signals, y (R, 2, COUNT), without nuisances."""
    bench = linear_bench(SPREAD, count=COUNT)
    samples = replace(bench.samples, signals=(WHITE, replace(WHITE, name="y4", at="point_4")), y=y)
    still = np.zeros((1, *y.shape))
    metric = metric_of(samples, Levels(), still, still)
    return replace(bench, samples=samples, fitted=samples, shapes=still, shared=still, metric=metric)


def told(y):
    return [(s.kind, s.run, s.signal, s.severity) for s in find_misread_run(laid_out(y), PATHS)]


@pytest.fixture
def y():
    return PATHS + WHITE.white * np.random.default_rng(1).standard_normal(PATHS.shape)


def test_a_sign_that_was_turned(y):
    y[2, 1] *= -1.0
    assert told(y) == [("wrong_sign", SPREAD[2].name, "y4", "stop")]


def test_two_records_that_were_exchanged(y):
    y[3] = y[3, ::-1]
    assert told(y) == [("swapped", SPREAD[3].name, "y1 and y4", "stop")]


def test_readings_as_they_are(y):
    assert told(y) == []


def test_an_effect_that_turns_one_signal_in_every_run_is_no_slip_of_the_hand(y):
    y[:, 1] *= -1.0
    assert told(y) == []


def test_a_record_of_another_shape_is_not_turned(y):
    """It lies on the other side, but not where a turned sign would put it."""
    y[2, 1] = -3.0 * PATHS[2, 1] * S**2
    assert told(y) == []


def test_the_sign_of_a_yaw(y):
    y[1] *= -1.0
    assert told(y) == [("wrong_sign", SPREAD[1].name, None, "stop")]


@pytest.mark.parametrize(("fault", "severity"), [(0.0, "stop"), (3e-5, "stop"), (3e-4, "look")])
def test_a_turned_sign_is_believed_where_it_explains_most_of_what_is_left(y, fault, severity):
    """A wave of the belt, larger than what the yaw does, may outweigh it; a small one beside a turned sign does not."""
    y[2, 1] *= -1.0
    y[2, 1] -= fault * np.sin(3.0 * S) ** 2
    seen = Suspicion(run=SPREAD[2].name, signals=("y4",), kind="wrong_sign", sentence="turned")
    assert [s.severity for s in confirm_signs(laid_out(y), PATHS, [seen])] == [severity]


@pytest.mark.parametrize("severity", ["stop", "look"])
def test_a_column_that_is_turned_in_every_run_is_believed_if_turning_it_back_helps(y, severity):
    y[:, 1] *= -1.0 if severity == "stop" else -1.0 - 8.0 * S
    seen = Suspicion(run=None, signals=("y4",), kind="wrong_sign", sentence="turned")
    assert [s.severity for s in confirm_signs(laid_out(y), PATHS, [seen])] == [severity]


def test_a_column_that_looks_turned_stops_where_turning_it_back_leaves_noise(y):
    y[:, 1] *= -1.0
    seen = Suspicion(run=None, signals=("y4",), kind="wrong_sign", sentence="turned", severity="look")
    assert [s.severity for s in confirm_signs(laid_out(y), PATHS, [seen])] == ["stop"]
    y[:, 1] *= 2.0
    assert [s.severity for s in confirm_signs(laid_out(y), PATHS, [seen])] == ["look"]


def test_a_column_that_hardly_moves_is_not_turned_by_noise(y):
    still = PATHS * [[[1.0], [0.0]]]
    seen = Suspicion(run=None, signals=("y4",), kind="wrong_sign", sentence="turned", severity="look")
    assert confirm_signs(laid_out(y - PATHS + still), still, [seen]) == (seen,)


def test_what_is_seen_at_first_glance_and_confirmed_stops(y):
    y[2, 1] *= -1.0
    seen = Suspicion(run=SPREAD[2].name, signals=("y4",), kind="wrong_sign", sentence="turned", severity="look")
    assert [s.severity for s in find_faults(laid_out(y), PATHS, [seen])] == ["stop", "look"]


def test_two_records_that_are_nearly_alike_and_exchanged(y):
    """What shows of it in one run shows in no other."""
    alike = PATHS.copy()
    alike[:, 1] = 0.5 * PATHS[:, 0]
    y += alike - PATHS
    y[3] = y[3, ::-1]
    found = find_misread_run(laid_out(y), alike)
    assert [(s.kind, s.run) for s in found] == [("swapped", SPREAD[3].name)]
    assert find_misread_run(laid_out(y[:, ::-1]), alike) == ()


def test_runs_that_began_at_unlike_places_are_not_stopped(y):
    """What acts by the place, a crown, may show in the one run that stood there."""
    y[2, 1] *= -1.0
    bench = laid_out(y)
    for far, severity in ((0.0, "stop"), (5e-3, "look")):
        runs = tuple(SimpleNamespace(**vars(r) | {"y0": far * (k == 2)}) for k, r in enumerate(bench.samples.runs))
        found = find_misread_run(replace(bench, samples=replace(bench.samples, runs=runs)), PATHS)
        assert [s.severity for s in found] == [severity]
