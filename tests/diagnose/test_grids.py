"""What only shapes an effect is tried on a grid: as one candidate, which pays for having been tried so often."""

from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
import pytest
from noise_by_recursion import errors
from small_campaign import MODEL, campaign

from belt_sim.diagnosis.choice.refits import PROMISING, best_of, screened
from belt_sim.diagnosis.fits.around import around
from belt_sim.diagnosis.fits.one_step import projected
from belt_sim.diagnosis.fits.workbench import workbench
from belt_sim.diagnosis.left_over.null import null_gains
from belt_sim.diagnosis.readings.forward import Forward
from belt_sim.diagnosis.readings.samples import samples_of
from belt_sim.effects.base import Effect, Parameter, effect
from belt_sim.effects.weld import Weld

GRID = (2.0, 3.0, 4.0, 5.0, 7.0)
LENGTH, SIZE = 4.3, 2e-4  # between two points of the grid
IDS = ["test_wave"]


@effect
@dataclass(frozen=True, kw_only=True)
class Wave(Effect):
    """Every lateral sensor reads a wave in travel beside the truth."""

    id = "test_wave"
    law = "sensor"
    reference = "a test"
    parameters = {
        "a": Parameter(unit="m", meaning="cosine", plausible=(-1e-3, 1e-3), scale=1e-4),
        "b": Parameter(unit="m", meaning="sine", plausible=(-1e-3, 1e-3), scale=1e-4),
        "wave": Parameter(
            unit="m", meaning="wavelength", plausible=(1.0, 10.0), scale=1.0, null=3.0, modifier=True, grid=GRID
        ),
    }
    a: float = 0.0
    b: float = 0.0
    wave: float = 3.0

    def sensor(self, reading, case):
        phase = 2 * jnp.pi * reading.travel / self.wave
        return replace(reading, y=reading.y + self.a * jnp.cos(phase) + self.b * jnp.sin(phase))


@pytest.fixture(scope="module")
def waved():
    """A campaign in which every reading holds a wave of 4.3 m."""
    b = workbench(campaign("nothing"), MODEL, (Wave,))
    hidden = b.forward.null()
    hidden[:3] = 2.0, 0.0, LENGTH
    noise = errors(b, 1, np.random.default_rng(3))[0]
    y = b.forward.values(hidden[None])[0] + noise
    samples = replace(b.samples, y=y)
    b = replace(b, samples=samples, fitted=samples, metric=replace(b.metric, samples=samples))
    fit = b.fit([b.start((), b.forward.null())])[0]
    return b, fit, around(b, fit, ["test_wave"])


def test_the_best_points_of_the_grid_are_starts_and_the_fit_ends_between_them(waved):
    bench, _, near = waved
    assert near.points["test_wave"][0] == ((2, 4.0),)
    assert set(near.points["test_wave"]) <= set(near.weak["test_wave"])
    best = best_of(bench, near, ["test_wave"])["test_wave"]
    assert best.vector[2] == pytest.approx(LENGTH, abs=0.05)
    assert np.hypot(*best.vector[:2]) == pytest.approx(2.0, rel=0.1)


def test_an_effect_that_promises_nothing_at_null_is_refitted_for_what_it_promises_on_its_grid(waved):
    """A weld that lies elsewhere than at its null place takes next to nothing by one step from there."""
    bench, fit, near = waved
    best = best_of(bench, near, ["test_wave"])["test_wave"]
    threshold = 0.6 * (fit.chi2 - best.chi2)
    assert PROMISING * threshold > fit.chi2 - projected(bench, replace(near, points={}), "test_wave").chi2
    found = screened(bench, near, ["test_wave"], lambda name: threshold, {})["test_wave"]
    assert found.chi2 == pytest.approx(best.chi2, abs=0.1)
    assert found.vector[2] == pytest.approx(LENGTH, abs=0.05)


def test_the_best_points_are_those_for_what_is_left_now(waved):
    """Beside what took most of the readings a weld lies elsewhere than where it would have stood for all of them."""
    bench, fit, _ = waved
    elsewhere = bench.forward.null()
    elsewhere[:3] = 2.0, 0.0, 7.0
    samples = replace(bench.samples, y=bench.forward.values(elsewhere[None])[0])
    other = replace(bench, samples=samples, fitted=samples, metric=replace(bench.metric, samples=samples))
    before = around(other, other.fit([other.start((), other.forward.null())])[0], IDS)
    assert before.points["test_wave"][0] == ((2, 7.0),)
    now = around(bench, fit, IDS, before)
    assert now.points["test_wave"][0] == ((2, 4.0),)
    assert set(now.shaped) == set(now.points["test_wave"])


def test_a_candidate_pays_for_every_point_that_was_tried(waved):
    bench, fit, near = waved
    alternatives = near.shapes(bench, "test_wave")
    assert len(alternatives) == len(GRID)
    shapes = {"test_wave": alternatives, "one": alternatives.columns[alternatives.choices[0]]}
    bench = bench.at_levels(bench.finder(bench.samples.y - fit.values))  # as a workbench for these readings has them
    null = null_gains(bench, shapes, fit.slopes, fit.values, count=400, seed=1)
    assert null.dof == {"test_wave": 2, "one": 2}  # nothing is drawn for the modifier: the grid stands for it
    assert np.mean(null.gains["one"]) == pytest.approx(2.0, rel=0.35)
    assert np.mean(null.gains["test_wave"]) > 1.5 * np.mean(null.gains["one"])


@pytest.mark.parametrize("centres", [2.0, 11.28, 14.0])
def test_a_weld_is_looked_for_all_round_a_belt_of_any_length(centres):
    """Steps in metres that fit a long belt go round a short one in its own time, and find a few places again."""
    samples = samples_of(campaign("nothing"))
    cases = replace(samples.cases, rig=replace(samples.cases.rig, centre_distance=centres))
    forward = Forward(replace(samples, cases=cases), MODEL, (Weld,))
    (position, grid), *others = forward.grids("weld").items()
    assert not others
    around = float(cases.rig.belt_length)
    places = np.sort(np.mod(np.array(grid) * forward.slots[position].scale, around))
    gaps = np.diff([*places, places[0] + around])
    assert gaps == pytest.approx(around / len(grid))
    assert gaps.max() < 0.1 * around
