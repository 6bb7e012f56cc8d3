"""What is held out: a faint edge predicts it, a right effect takes its error to the floor beside all nuisances."""

from dataclasses import replace

import numpy as np
import pytest
from linear_bench import SPREAD, linear_bench
from small_campaign import CLASSES, MODEL, SEED, campaign
from test_linear_readings import with_edge

from belt_sim.diagnosis.describe import describe
from belt_sim.diagnosis.errors import Condition, ErrorsWithoutNuisances, errors_of, held_out, prior_of_fit
from belt_sim.diagnosis.examine import examine
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.noise import metric_of
from belt_sim.diagnosis.workbench import Workbench, workbench
from belt_sim.effects.base import library

HARMONICS = 16
EDGE = [library()["edge_profile"]]


def fitted(first: float) -> tuple[Workbench, Fit, Fit]:
    """Fits without and with an edge whose first harmonic is ``first`` [m]."""
    sizes = first / np.arange(1, HARMONICS + 1) ** 1.27
    bench = workbench(with_edge(campaign("nothing"), sizes), MODEL, EDGE, terms={"edge_profile": HARMONICS})
    null = bench.forward.null()
    base, edge = bench.fit([bench.start((), null), bench.start(["edge_profile"], null)])
    return bench, base, edge


def surprise(held: dict[str, Condition]) -> float:
    return sum(c.surprise for c in held.values())


def test_a_faint_edge_predicts_better_than_none():
    """It takes a chi2 of 75 with 32 numbers; as free as a machine allows, they would predict worse."""
    bench, base, edge = fitted(3e-5)
    assert 60.0 < base.chi2 - edge.chi2 < 90.0
    without, with_it, own = held_out(bench, base), held_out(bench, edge), ErrorsWithoutNuisances(bench)
    assert surprise(with_it) < surprise(without) - 20.0
    tested = [name for name, c in with_it.items() if c.testable]
    assert own.rms([with_it[n] for n in tested]) < 0.99 * own.rms([without[n] for n in tested])


def test_no_edge_predicts_no_better():
    bench, base, edge = fitted(0.0)
    assert base.chi2 - edge.chi2 > 20.0
    assert surprise(held_out(bench, edge)) > surprise(held_out(bench, base))


@pytest.mark.parametrize("first", [6e-5, 2e-4])
def test_the_common_size_is_that_of_the_harmonics(first):
    """In units of their scales: half of the harmonics here are null, the sines."""
    bench, _, edge = fitted(first)
    machine, found, _ = prior_of_fit(bench, edge)
    assert np.ptp(found) == 0.0
    assert found[0] == pytest.approx(first / 2e-4 / np.sqrt(2.0), rel=0.3)
    assert (found < machine).all()


COUNT, ZERO = 40, 1e-3  # a zero of a hundred times the noise


def bench_with_zeros(y):
    """One signal whose zero differs from run to run."""
    bench = linear_bench(SPREAD, y=y, shapes={"a": np.tile(np.linspace(0.0, 1e-4, COUNT), (len(SPREAD), 1, 1))})
    shapes = np.full((1, len(SPREAD), 1, COUNT), ZERO)
    return replace(bench, shapes=shapes, metric=metric_of(bench.samples, bench.levels, shapes, bench.shared))


@pytest.fixture(scope="module")
def drawn():
    """White noise as stated, and a zero of every run."""
    rng = np.random.default_rng(4)
    zeros = ZERO * rng.standard_normal((len(SPREAD), 1, 1))
    return zeros + 1e-5 * rng.standard_normal((len(SPREAD), 1, COUNT))


def test_a_perfect_model_leaves_the_floor(drawn):
    own = ErrorsWithoutNuisances(bench_with_zeros(drawn))
    left = own.remove_nuisances(drawn, np.ones(len(SPREAD), dtype=bool))
    assert own.floor == pytest.approx(1e-5 * np.sqrt(1.0 - 1.0 / COUNT), rel=1e-3)
    assert np.sqrt(np.mean(left**2)) == pytest.approx(own.floor, rel=4.0 / np.sqrt(2 * drawn.size))
    assert np.sqrt(np.mean(drawn**2)) > 20.0 * own.floor


def test_a_right_effect_takes_the_error_to_the_floor_whatever_the_zeros_are(drawn):
    """In plain rms the zeros hide it."""
    bench = bench_with_zeros(drawn + np.linspace(0.0, 1e-4, COUNT))
    base, found = (bench.fit([bench.start(ids, bench.forward.null())])[0] for ids in ((), ("a",)))
    error = errors_of(bench, base, bench, found)
    assert error.own.before > 2.5 * error.own.floor
    assert error.own.after == pytest.approx(error.own.floor, rel=0.2)
    assert error.held_out.after > 0.9 * error.held_out.before


def test_a_campaign_of_one_run_has_no_unseen_ones():
    """Guard: the error that no run at all had predicted was that of unseen runs."""
    whole = campaign("nothing")
    found = examine(replace(whole, runs=whole.runs[:1]), MODEL, CLASSES[1:2], seed=SEED, laws=None)
    error = describe(found, seed=SEED).error
    assert (error.held_out, error.own, error.by_condition) == (None, None, {})
    assert error.fit is not None
