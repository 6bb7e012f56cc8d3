"""Fitted numbers: steps between sides, uncertainties, what is known together only, intervals by likelihood."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_bench import SPREAD, WHITE, linear_bench, with_readings

import belt_sim as bs
from belt_sim.diagnosis.fit import Fit, bounded_step, covariance_of, covariance_root
from belt_sim.diagnosis.forward import Slot
from belt_sim.diagnosis.plausibility import (
    estimates,
    estimates_of_single_sizes,
    is_plausible,
    plausible_bounds,
    prefer_plausible,
    profile_intervals,
)
from belt_sim.effects.base import Parameter
from belt_sim.results.diagnosis import FoundEffect
from belt_sim.results.estimates import COVERAGE_95, Estimate
from belt_sim.units import DEGREE, N_PER_MM2
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Plan, grid


def test_of_two_numbers_known_only_together_the_step_ends_in_their_valley():
    """The valley a + b = 1 passes between the sides; a free step goes far along it, and the corner lies off it."""
    columns = np.array([[10.0, 0.01, 0.0], [10.0, 0.0, 0.01]])
    system, low, high = columns @ columns.T, np.full(2, -2.0), np.full(2, 4.0)
    step = bounded_step(system, columns @ np.array([10.0, 0.09, -0.08]), low, high)
    assert step == pytest.approx([3.0, -2.0], abs=1e-3)


@pytest.mark.parametrize("seed", range(40))
def test_no_number_that_is_held_pulls_back_and_none_that_is_free_pulls(seed):
    rng = np.random.default_rng(seed)
    size = int(rng.integers(2, 9))
    columns = rng.normal(size=(size, size + 3))
    columns[1] = columns[0] + 0.1 * columns[1]
    system, along = columns @ columns.T, columns @ (5.0 * rng.normal(size=size + 3))
    low, high = -rng.exponential(size=size), rng.exponential(size=size)
    low[0], high[-1] = 0.0, np.inf
    step = bounded_step(system, along, low, high)
    pull = (along - system @ step) / np.sqrt(np.diag(system))
    assert ((low <= step) & (step <= high)).all()
    assert np.all(pull[step > low] > -2e-3)
    assert np.all(pull[step < high] < 2e-3)


def test_where_a_free_step_stays_between_the_sides_it_is_that():
    system, along = np.diag([2.0, 4.0]), np.array([1.0, -2.0])
    assert bounded_step(system, along, np.full(2, -1.0), np.full(2, 1.0)) == pytest.approx([0.5, -0.5])


def test_a_number_without_room_does_not_move():
    assert bounded_step(np.eye(2), np.ones(2), np.zeros(2), np.array([0.0, 5.0])) == pytest.approx([0.0, 1.0])


SHAPE = (len(SPREAD), 1, 40)


def fitted(shapes, y):
    """The fit of all shapes (k, R, S, n) to readings."""
    named = {f"e{k}": rows for k, rows in enumerate(shapes)}
    bench = with_readings(linear_bench(SPREAD, shapes=named), y)
    return bench.fit([bench.start(tuple(named), bench.forward.null())])[0]


def test_fifty_random_fits_have_the_uncertainties_of_an_svd():
    rng = np.random.default_rng(0)
    for _ in range(50):
        k = int(rng.integers(2, 7))
        shapes = WHITE.white * rng.standard_normal((k, *SHAPE)) * 10.0 ** rng.uniform(-1.0, 3.0, (k, 1, 1, 1))
        size = np.linalg.norm(shapes[0]) / np.linalg.norm(shapes[-1])
        shapes[-1] = shapes[0] + size * shapes[-1] * 10.0 ** rng.uniform(-4.0, 0.0)  # nearly alike
        fit = fitted(shapes, WHITE.white * rng.standard_normal(SHAPE))
        _, size, rows = np.linalg.svd(fit.columns.T, full_matrices=False)
        np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance)), np.linalg.norm(rows.T / size, axis=1), rtol=0.01)


def test_intervals_hold_the_truth_as_often_as_they_say():
    rng, hits = np.random.default_rng(1), []
    shapes = WHITE.white * rng.standard_normal((3, *SHAPE))
    shapes[2] += 3.0 * shapes[0]
    truth = np.array([2.0, -1.0, 0.5])
    for _ in range(400):
        fit = fitted(shapes, np.einsum("k,krsn->rsn", truth, shapes) + WHITE.white * rng.standard_normal(SHAPE))
        hits.append(np.abs(fit.vector[fit.free] - truth) < 1.96 * np.sqrt(np.diag(fit.covariance)))
    assert 0.93 < np.mean(hits) < 0.97


def test_what_no_reading_tells_apart_is_not_known_but_its_sum_is():
    column = np.random.default_rng(2).standard_normal(200)
    columns = np.stack([column, 2.0 * column])
    assert np.sqrt(np.diag(covariance_of(columns))).min() > 1e3 / np.linalg.norm(column)
    along = np.array([1.0, 2.0]) @ covariance_root(columns)
    assert np.linalg.norm(along) == pytest.approx(1.0 / np.linalg.norm(column), rel=1e-6)


@pytest.fixture(scope="module")
def one_run():
    """A campaign of one run that hides a taper of 20 ppm per m of width."""
    plan = Plan(runs=grid((10.0 * N_PER_MM2,), (-0.042 * DEGREE,), repeats=0), length=30.0, spacing=0.5)
    return make_campaign(hidden=[{"id": "taper", "kappa_t": 20e-6}], base="strip", seed=1, plan=plan)[0]


def test_a_fit_says_what_the_readings_cannot_separate(one_run):
    found = bs.fit(one_run, ["taper", "yaw_offset_tail"], "strip")
    said = str(found)
    assert set(found.unbound) == {"taper.kappa_t", "taper.kappa_t_head", "yaw_offset_tail.beta_0"}
    assert said.count("not bound by these readings") == 3
    assert "these readings cannot separate taper.kappa_t, taper.kappa_t_head, yaw_offset_tail.beta_0" in said
    assert found.u["taper.kappa_t"] > 20e-6  # pinv said 0.16e-6
    assert said.startswith("[[Fit Statistics]]")
    assert "    reduced chi-square = " in said
    assert said.index("[[Variables]]") < said.index("[[Left open]]")


def test_a_fit_tells_correlations_and_bounds(one_run):
    alone = bs.fit(one_run, ["taper"], "strip")
    assert not alone.unbound
    assert abs(alone.values["taper.kappa_t"] - 20e-6) < 4.0 * alone.u["taper.kappa_t"]
    assert np.allclose(np.diag(alone.correlation), 1.0)
    if abs(alone.correlation[0, 1]) > 0.9:
        assert "correlation" in str(alone)
    waves = {n: y + 1e-3 * np.sin(3.0 * one_run.runs[0].travel) for n, y in one_run.runs[0].signals.items()}
    odd = replace(one_run, runs=(replace(one_run.runs[0], signals=waves),))
    assert "rejected" in str(bs.fit(odd, ["taper"], "strip"))


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
    same = replace(far, columns=np.tile(1e10 * rows[:1], (2, 1)))  # one number, as far as its derivatives there go
    assert is_plausible(bench.forward, prefer_plausible(bench, [same])[0])


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
    assert "gain = 0.235 ± 0.012 or bias = 1.638 ± 0.084 N/mm²" in found.sizes_on(None)[0]
    assert "how large it is not" in replace(found, alone={}).sizes_on(None)[0]
    assert str(Estimate(4e-4, 2e-3, "m", True, (2e-4, 8e-4))) == "0.200 to 0.800 mm"


WIDE = (-1e6, 1e6)


class Curved:
    """Two readings of two numbers: bend(a) + b and b, each with noise of one."""

    id = "curved"
    parameters = {
        "a": Parameter(unit="1", meaning="", plausible=WIDE, scale=1.0),
        "b": Parameter(unit="1", meaning="", plausible=WIDE, scale=1.0),
    }


@dataclass
class Bench:
    """A workbench of those readings."""

    bend: object
    plausible: tuple[float, float] = WIDE

    @property
    def fitted(self):
        return SimpleNamespace(y=self.forward.values(np.zeros((1, 2)))[0])

    @property
    def forward(self):
        cls = type("Curved", (Curved,), {"parameters": dict(Curved.parameters)})
        cls.parameters["a"] = replace(cls.parameters["a"], plausible=self.plausible)
        slots = [Slot(cls, n) for n in ("a", "b")]
        return SimpleNamespace(slots=slots, values=self.values)

    def values(self, vector):
        return np.stack([self.bend(vector[:, 0]) + vector[:, 1], vector[:, 1]], axis=1)[:, None, None, :]

    @property
    def metric(self):
        return SimpleNamespace(chi2=lambda rest: np.sum(rest**2, axis=(1, 2, 3)))

    def start(self, ids, vector, free):
        return Fit(ids=tuple(ids), free=list(free), vector=np.array(vector))

    def fit(self, starts):
        """The other number as it has to be: b for a held a; a for a held b by search."""
        return [self._best(f) for f in starts]

    def _best(self, f):
        points = np.repeat(f.vector[None], 200_001, axis=0)
        points[:, f.free[0]] = np.linspace(-10.0, 10.0, len(points))
        chi2 = self.metric.chi2(self.fitted.y - self.values(points))
        return replace(f, vector=points[np.argmin(chi2)], chi2=float(chi2.min()))


def interval_of(bend, slope, plausible=WIDE):
    bench = Bench(bend, plausible)
    columns = np.array([[slope, 0.0], [1.0, 1.0]])
    fit = Fit(ids=("curved",), free=[0, 1], vector=np.zeros(2), chi2=0.0, columns=columns)
    u = np.sqrt(np.diag(covariance_of(columns)))
    found = {"curved": {n: Estimate(0.0, float(u[k]), "1", True) for k, n in enumerate("ab")}}
    return profile_intervals(bench, fit, found)["curved"]


def test_a_straight_number_keeps_its_even_interval():
    found = interval_of(lambda a: 3.0 * a, 3.0)
    assert all(e == Estimate(e.value, e.u, e.unit, e.plausible) for e in found.values())


def test_a_curved_number_reaches_further_where_readings_change_less():
    found = interval_of(lambda a: 4.0 * (np.exp(a) - 1.0), 4.0)["a"]
    low, high = (np.log(1.0 + side * COVERAGE_95 * np.sqrt(2.0) / 4.0) for side in (-1.0, 1.0))
    assert found.interval_95 == pytest.approx((low, high), rel=0.07)
    assert -low > 1.5 * high


def test_an_interval_that_readings_leave_open_ends_where_machines_do():
    found = interval_of(lambda a: 2.0 * np.tanh(a) + 6.0 * np.minimum(a, 0.0), 2.0, plausible=(-9.0, 9.0))["a"]
    assert found.interval_95[1] == pytest.approx(9.0)
    assert -0.6 < found.interval_95[0] < -0.2


def test_a_number_of_which_readings_exclude_nothing_is_not_told():
    assert "a" not in interval_of(lambda a: np.tanh(a), 1.0, plausible=(-0.5, 9.0))


def test_two_numbers_that_do_the_same_are_not_known():
    alike = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0 + 1e-9]])
    assert np.sqrt(covariance_of(alike)[0, 0]) > 1e3
    faint = np.array([[1e-5, 0.0], [0.0, 1e5]])
    assert np.sqrt(np.diag(covariance_of(faint))) == pytest.approx([1e5, 1e-5])
