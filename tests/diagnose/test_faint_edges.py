"""An edge of many faint harmonics predicts what is held out, once these are as small together as they show."""

import numpy as np
import pytest
from small_campaign import MODEL, campaign
from test_linear_readings import with_edge

from belt_sim.diagnosis.errors import Condition, ErrorsWithoutNuisances, held_out, prior_of_fit
from belt_sim.diagnosis.fit import Fit
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
