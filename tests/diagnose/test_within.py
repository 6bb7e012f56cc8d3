"""Numbers known only together, or from below only: what a machine can have, where the readings allow it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_bench import SPREAD, WHITE, linear_bench

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.forward import Slot
from belt_sim.diagnosis.plausibility import (
    estimates,
    estimates_of_single_sizes,
    is_plausible,
    plausible_bounds,
    prefer_plausible,
)
from belt_sim.effects.base import Parameter
from belt_sim.results.diagnosis import Estimate, FoundEffect

COUNT, HAIR = 40, 1e-7
NEARLY = np.linspace(1.0, 1.02, len(SPREAD))[:, None, None] * np.ones(COUNT)


def number(low, high):
    return Parameter(unit="1", meaning="", plausible=(low, high), scale=1.0)


class Bent:
    """Predictions ``of`` the numbers (k,) of one effect, derivatives by differences."""

    def __init__(self, of, **parameters):
        effect = SimpleNamespace(id="bent", parameters=parameters, is_additive=lambda: False)
        self.of, self.classes, self.size = of, (effect,), len(parameters)
        self.slots = tuple(Slot(effect, n) for n in parameters)
        self.sides = np.full(self.size, -np.inf), np.full(self.size, np.inf)

    def index(self, name):
        return list(range(self.size))

    def null(self):
        return np.zeros(self.size)

    def values(self, vectors):
        return 1e-4 * np.stack([self.of(v) for v in vectors])

    def values_and_slopes(self, vectors, directions):
        ahead, behind = self.values(vectors + HAIR * directions), self.values(vectors - HAIR * directions)
        return self.values(vectors), (ahead - behind) / (2.0 * HAIR)


def bench_of(forward, truth, noise=0.0):
    y = forward.values(np.array([truth]))[0]
    errors = noise * WHITE.white * np.random.default_rng(1).standard_normal(y.shape)
    return replace(linear_bench(SPREAD, count=COUNT, y=y + errors), forward=forward)


def load_cell():
    """Its gain and its zero do nearly the same."""
    return Bent(lambda v: v[0] * np.ones_like(NEARLY) + v[1] * NEARLY, gain=number(-0.3, 0.3), zero=number(-0.3, 0.3))


def cover():
    """One that is soft enough does the same as a softer one."""
    return Bent(lambda v: (1.0 - np.exp(-4.0 * v[0])) * NEARLY, c=number(0.0, 1.0))


def at(bench, *numbers):
    return bench.fit([bench.start(("bent",), np.array(numbers))])[0]


def test_numbers_known_only_together_are_as_a_machine_has_them():
    bench = bench_of(load_cell(), (0.0, 0.2), noise=1.0)
    free = bench.start(("bent",), np.array([19.8, -19.4]))
    rows = bench.metric.whiten(bench.forward.values_and_slopes(np.zeros((2, 2)), np.eye(2))[1])
    rest = bench.metric.whiten(bench.fitted.y - bench.forward.values(free.vector[None])[0])
    far = replace(free, columns=rows, residual=rest, chi2=float(rest @ rest))
    best = at(bench, 0.0, 0.0)
    far = replace(far, chi2=best.chi2 - 1.0)  # as if chance had bent the valley so
    assert not is_plausible(bench.forward, far)
    found = prefer_plausible(bench, [far])[0]
    assert is_plausible(bench.forward, found)
    assert np.sum(found.vector) == pytest.approx(0.2, abs=0.01)
    assert np.all(np.abs(found.vector) <= 0.6)
    assert prefer_plausible(bench, [replace(far, chi2=best.chi2 - 20.0)])[0].vector[0] == pytest.approx(19.8)


def test_each_of_two_that_do_the_same_is_told_as_if_it_were_alone():
    bench = bench_of(load_cell(), (0.0, 0.2), noise=1.0)
    fit = at(bench, 0.1, 0.1)
    alone = estimates_of_single_sizes(bench, fit, "bent")
    assert set(alone) == {"gain", "zero"}
    assert alone["zero"].value == pytest.approx(0.2, abs=3.0 * alone["zero"].u)
    assert alone["zero"].u < 0.01
    apart = bench_of(
        Bent(lambda v: v[0] + v[1] * np.linspace(-1, 1, COUNT) * NEARLY, a=number(-1, 1), b=number(-1, 1)), (0.2, 0.5)
    )
    assert estimates_of_single_sizes(apart, at(apart, 0.0, 0.0), "bent") == {}  # neither does what both do


def test_a_number_that_saturates_is_possible_though_none_is_told():
    bench = bench_of(cover(), (2.0,), noise=1.0)
    far = at(bench, 9.0)
    assert estimates(bench.forward, far) == {"bent": {}}
    assert not is_plausible(bench.forward, far)
    found = prefer_plausible(bench, [far])[0]
    assert found.vector[0] <= 2.0
    assert is_plausible(bench.forward, found)


@pytest.mark.parametrize(("beside", "possible"), [(0.0, True), (1e-12, True), (-1e-12, True), (1e-3, False)])
def test_a_number_on_its_bound_is_possible_however_it_was_rounded(beside, possible):
    forward = load_cell()
    bound = plausible_bounds(forward.slots[0])[1]
    same = np.array([[1.0, 0.0, 1.0], [1.0, 0.0, 1.0]])
    vector = np.array([bound + beside, 0.0])
    fit = Fit(ids=("bent",), free=[0, 1], vector=vector, chi2=1.0, columns=same, values=np.zeros(1))
    assert estimates(forward, fit) == {"bent": {}}
    assert is_plausible(forward, fit) is possible


def test_a_well_known_number_beyond_any_machine_stays_impossible():
    bench = bench_of(Bent(lambda v: v[0] * NEARLY, c=number(0.0, 1.0)), (3.0,), noise=1.0)
    fit = at(bench, 0.0)
    assert prefer_plausible(bench, [fit])[0] is fit
    assert not is_plausible(bench.forward, fit)
    assert estimates(bench.forward, fit, every=True)["bent"]["c"].value == pytest.approx(3.0, rel=0.02)


def test_what_is_known_only_together_is_said_so():
    gain, zero = Estimate(0.235, 0.012, "1", True), Estimate(1.638e6, 8.4e4, "Pa", True)
    found = FoundEffect(id="a", numbers={}, parameters={}, probability=0.9, alone={"gain": gain, "bias": zero})
    assert "gain = 0.235 ± 0.012 or bias = 1.638 ± 0.084 N/mm²" in str(found)
    assert "how large it is not" in str(replace(found, alone={}))
    assert str(Estimate(4e-4, 2e-3, "m", True, (2e-4, 8e-4))) == "0.200 to 0.800 mm"
