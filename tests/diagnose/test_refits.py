"""Refits reach the valley they began in, and the effect that explains more takes the place of the one that does not."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_bench import NUMBER, SPREAD, WHITE, linear_bench, with_readings

from belt_sim.diagnosis.fit import Fit, fit_sets
from belt_sim.diagnosis.forward import Slot
from belt_sim.diagnosis.linearisation import Linearisation
from belt_sim.diagnosis.plausibility import has_diverged
from belt_sim.diagnosis.search import NO_EFFECTS, Search, add_fits, extend, fit_best, move_to

SHARP = 100.0  # sigmas a unit of the curve: where it stops, the rest of chi2 is below the tolerance of 0.02


def unit(readings):
    """A metric of so many readings, all null, that leaves them as they are."""
    samples = SimpleNamespace(y=np.zeros((1, 1, readings)))
    return SimpleNamespace(samples=samples, whiten=lambda x: x.reshape(*x.shape[:-3], -1))


class Saturating:
    """One reading that follows atan(q): beyond 1.39 an undamped Gauss-Newton step lands further off."""

    size = 1
    sides = np.array([-np.inf]), np.array([np.inf])

    def values_and_slopes(self, points, along):
        q = points[:, :, None, None]
        return SHARP * np.arctan(q), SHARP * along[:, :, None, None] / (1.0 + q**2)


@pytest.mark.parametrize("start", [-3.0, -1.0, 0.3, 1.6, 3.0])
def test_a_refit_goes_down_and_never_up(start):
    begun = Fit(ids=("a",), free=[0], vector=np.array([start]))
    fit = fit_sets(Saturating(), unit(1), [begun])[0]
    assert fit.chi2 < 0.03
    assert fit.vector[0] == pytest.approx(0.0, abs=2e-3)
    assert fit.chi2 == pytest.approx(float(fit.residual @ fit.residual), rel=1e-12)
    assert fit.residual[0] == pytest.approx(-SHARP * np.arctan(fit.vector[0]), abs=1e-9)


class Bent:
    """A valley along b = a^2 / 2, a hundred sigmas a unit across and ten along it, with its end at a = 0."""

    size = 2
    sides = np.array([-np.inf, -np.inf]), np.array([np.inf, np.inf])

    def values_and_slopes(self, points, along):
        a, b = points.T
        across, down = along.T
        values = np.stack([SHARP * (b - 0.5 * a**2), 10.0 * a], axis=1)
        slopes = np.stack([SHARP * (down - a * across), 10.0 * across], axis=1)
        return values[:, None, None], slopes[:, None, None]


def test_steps_along_a_bent_valley_are_as_long_as_they_may_be():
    """Guard: a step that had to be shorter was once damped so far that a refit crawled and ran out of rounds."""
    begun = Fit(ids=("a",), free=[0, 1], vector=np.array([-1.0, 0.5]))
    fit = fit_sets(Bent(), unit(2), [begun])[0]
    assert fit.is_converged
    assert fit.chi2 < 0.03


def test_a_number_that_a_machine_has_on_one_side_of_null_stays_there():
    """Two alike shapes of which one may not be negative: the other alone takes what both would."""
    rng = np.random.default_rng(3)
    one = WHITE.white * rng.normal(size=(len(SPREAD), 1, 40))
    other = one + 0.3 * WHITE.white * rng.normal(size=one.shape)
    bench = linear_bench(SPREAD, y=-3.0 * one + 5.0 * other, shapes={"one": one, "other": other})
    free = bench.fit([bench.start(("one", "other"), np.zeros(2))])[0]
    assert free.vector == pytest.approx([-3.0, 5.0], abs=1e-3)
    bench.forward.sides[0][0] = 0.0
    held = bench.fit([bench.start(("one", "other"), np.array([1.0, 0.0]))])[0]
    alone = bench.fit([bench.start(("other",), np.zeros(2))])[0]
    assert held.is_converged
    assert held.vector == pytest.approx([0.0, alone.vector[1]], abs=1e-3)
    assert held.chi2 == pytest.approx(alone.chi2, abs=0.05)
    pushed = with_readings(bench, -one).fit([bench.start(("one",), np.zeros(2))])[0]
    assert (pushed.is_converged, pushed.vector[0]) == (True, 0.0)


def test_a_refit_of_a_sum_of_shapes_is_least_squares():
    rng = np.random.default_rng(1)
    shapes = {i: 1e-5 * rng.normal(size=(len(SPREAD), 1, 40)) for i in "abc"}
    y = 1e-5 * rng.normal(size=(len(SPREAD), 1, 40)) + 3.0 * shapes["a"] - 2.0 * shapes["c"]
    bench = linear_bench(SPREAD, y=y, shapes=shapes)
    fit = bench.fit([bench.start(("a", "c"), np.array([0.0, 0.7, 0.0]))])[0]
    known = np.stack([shapes["a"].ravel(), shapes["c"].ravel()], axis=1)
    wanted = np.linalg.lstsq(known, (y - 0.7 * shapes["b"]).ravel(), rcond=None)[0]
    np.testing.assert_allclose(fit.vector, [wanted[0], 0.7, wanted[1]], atol=1e-3)


def test_a_faint_number_is_fitted_beside_one_that_moves_readings_by_far():
    """Guard: a force stayed where it began beside a cover whose unit is a million times what these readings show."""
    rng = np.random.default_rng(4)
    one, other = WHITE.white * rng.normal(size=(2, len(SPREAD), 1, 40))
    bench = linear_bench(SPREAD, y=3.0 * one + 5.0 * other, shapes={"far": 1e4 * one, "faint": 3e-3 * other})
    fit = bench.fit([bench.start(("far", "faint"), np.zeros(2))])[0]
    assert fit.is_converged
    assert fit.vector == pytest.approx([3e-4, 5.0 / 3e-3], rel=1e-3)


def test_a_direction_in_which_the_belt_runs_away_is_none():
    """The derivative there is no number; the other parameter is fitted, and nothing but numbers comes out."""
    rng = np.random.default_rng(4)
    one, other = WHITE.white * rng.normal(size=(2, len(SPREAD), 1, 40))
    bench = linear_bench(SPREAD, y=3.0 * one, shapes={"one": one, "other": other})
    lanes = bench.forward.values_and_slopes

    def running_away(vectors, directions):
        values, slopes = lanes(vectors, directions)
        return values, np.where(directions[:, 1, None, None, None] != 0.0, np.inf, slopes)

    bench.forward.values_and_slopes = running_away
    fit = bench.fit([bench.start(("one", "other"), np.zeros(2))])[0]
    assert fit.is_converged
    assert fit.vector == pytest.approx([3.0, 0.0], abs=1e-6)
    assert np.isfinite(fit.slopes).all()


def test_an_effect_is_at_null_where_all_that_is_better_with_it_has_diverged():
    """From null its number runs out of range; what the other start reaches is worse than the fit without it."""
    rng = np.random.default_rng(5)
    one, other = WHITE.white * rng.normal(size=(2, len(SPREAD), 1, 40))
    bench = linear_bench(SPREAD, y=30.0 * one, shapes={"faint": 1e-3 * one, "other": other})
    current = bench.fit([bench.start(("other",), np.zeros(2))])[0]
    null = Linearisation(current, {0: 1e-3 * one}).with_effect(bench, "faint")
    far = bench.fit([bench.start((), np.array([0.0, 50.0]))])[0]
    near = SimpleNamespace(
        fit=current, with_effect=lambda *_: null, starts={"faint": [SimpleNamespace(begin=lambda *_: far)]}
    )
    assert has_diverged(bench.fit([null])[0])
    assert far.chi2 > current.chi2 + 1000.0
    best = fit_best(bench, near, ["faint"], 0.0, {})["faint"]
    assert (best.chi2, best.vector[0], best.ids) == (current.chi2, 0.0, ("other", "faint"))


NOWHERE = Linearisation(Fit(ids=(), free=[], vector=np.zeros(1)), {})


@dataclass(frozen=True)
class Sliding:
    """A workbench on which the number of a set comes nearer to 10 the nearer to it settings were taken to be."""

    about: float = 0.0
    metric = SimpleNamespace(whiten=lambda rows: rows)
    slot = Slot(SimpleNamespace(id="a", parameters={"size": NUMBER}), "size")
    sides = np.full(1, -np.inf), np.full(1, np.inf)
    forward = SimpleNamespace(null=lambda: np.zeros(1), index=lambda _: [0], slots=[slot], sides=sides, classes=())

    def moved_to(self, vector):
        return Sliding(float(vector[0]))

    def start(self, ids, vector):
        return Fit(ids=ids, free=[0] if ids else [], vector=vector)

    def fit(self, starts):
        at = np.array([10.0 + 0.3 * (self.about - 10.0)])
        found = [(f, np.eye(1)[: len(f.free)]) for f in starts]
        return [replace(f, vector=at if f.ids else f.vector, chi2=1.0, columns=k, slopes=k) for f, k in found]


def test_settings_are_moved_until_they_stay():
    """Of a tension that is a quarter off, what is linear about none of it says too much."""
    moved = move_to(Search(bench=Sliding(), linearisation=NOWHERE), ("a",))
    assert (moved.bench.about, moved.reference) == (pytest.approx(9.1), {"a"})
    assert moved.fits[frozenset("a")].vector[0] == pytest.approx(9.73)


def test_settings_are_moved_back_to_where_nothing_is_missing():
    """After a set that was dropped: nothing is fitted then that could slide."""
    moved = move_to(Search(bench=Sliding(9.1), linearisation=NOWHERE, reference=frozenset("a")), ())
    assert (moved.bench.about, moved.reference) == (0.0, NO_EFFECTS)
    assert moved.fits[NO_EFFECTS].free == []


class Slow(Sliding):
    """A workbench that gets no further than where it begins, as where a guide is touched now and then."""

    def moved_to(self, vector):
        return self

    def fit(self, starts):
        columns = np.eye(1)
        return [
            replace(f, chi2=float((f.vector[0] - 10.0) ** 2), columns=columns[: len(f.free)], slopes=columns)
            for f in starts
        ]


@pytest.mark.parametrize("moves", [0, 1, 2])
def test_what_a_search_has_found_is_not_looked_for_anew(moves, monkeypatch):
    """Neither because it ran out of rounds, nor because settings moved twice before anybody asked for it."""
    search = add_fits(Search(bench=Slow(), linearisation=NOWHERE), [()])
    search = replace(search, linearisation=Linearisation(search.fits[NO_EFFECTS], {}))
    found = Fit(ids=("a",), free=[0], vector=np.array([9.0]), chi2=1.0, steps=24)
    monkeypatch.setattr("belt_sim.diagnosis.search.screen", lambda *_: {"a": found})
    search = extend(search, ())
    for _ in range(moves):
        search = move_to(search, ())
    fits = add_fits(search, [(), ("a",)]).fits
    assert fits[frozenset("a")].vector[0] == 9.0
    assert fits[NO_EFFECTS].chi2 - fits[frozenset("a")].chi2 == 99.0


def test_a_pair_begins_where_its_members_stood_by_themselves_too():
    """Guard: from null alone a guide in a pair never came to where the belt touches it."""
    alone = Fit(ids=("a",), free=[0], vector=np.array([9.0]), chi2=1.0)
    search = Search(bench=Slow(), linearisation=NOWHERE, starts={frozenset("a"): alone})
    fits = add_fits(search, [(), ("a", "b")]).fits
    assert fits[NO_EFFECTS].chi2 - fits[frozenset("ab")].chi2 == 99.0
