"""Joint refits: a larger set never fits worse, and what is no number never counts as a good fit."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from linear_bench import with_readings
from noise_by_recursion import errors
from small_campaign import CLASSES, MODEL, SHAPE, bench, campaign, examined, q_of

from belt_sim.diagnosis.errors import conditions
from belt_sim.diagnosis.linearisation import Linearisation, linearise_effects
from belt_sim.diagnosis.search import MAX_EFFECTS, Search, add_fits, fit_best
from belt_sim.diagnosis.workbench import workbench
from studies.paper.case import TEST_RIG

NESTED = 0.05  # in chi2; the fit ends when a round gains less than 0.02
LINEAR = 1e-6  # yaw_offset_tail enters linearly, so that one step ends at the least-squares point


@pytest.fixture(scope="module")
def two():
    return workbench(campaign("two"), MODEL, CLASSES)


def chi2(bench, ids) -> float:
    return bench.fit([bench.start(ids, bench.forward.null())])[0].chi2


def test_a_larger_set_never_fits_worse(two):
    chain = [(), ("taper",), ("taper", "yaw_offset_tail"), ("taper", "yaw_offset_tail", "cant")]
    sizes = [chi2(two, ids) for ids in chain]
    assert all(after <= before + NESTED for before, after in pairwise(sizes))
    assert sizes[1] - sizes[2] > 100.0  # and the truth is worth something


def test_a_set_whose_fit_strayed_is_refitted_from_its_best_subset():
    """Guard: where noise levels had moved on, a start on an earlier workbench once led to a fit worse than none."""
    b = bench()
    nothing = b.fit([b.start((), b.forward.null())])[0]
    strayed = b.start(("tension_bias", "taper"), q_of(b, "tension_bias", gain=-3.0))  # the belt would be pushed
    search = Search(bench=b, linearisation=Linearisation(nothing, {}), starts={frozenset(strayed.ids): strayed})
    fits = add_fits(search, [(), ("taper",), ("tension_bias", "taper")]).fits
    assert fits[frozenset(strayed.ids)].chi2 <= fits[frozenset(["taper"])].chi2 + NESTED
    assert fits[frozenset(["taper"])].chi2 <= nothing.chi2


def test_every_candidate_fits_at_least_as_well_as_what_it_stands_beside(two):
    """Guard: sag_roll, whose derivative at null is zero, once stopped above the model without it."""
    base = two.fit([two.start((), two.forward.null())])[0]
    near = linearise_effects(two, base, ["sag_roll", "slip", "taper"])
    assert "sag_roll" in near.starts
    fits = fit_best(two, near, ["sag_roll", "slip", "taper"], 0.0, {})
    assert all(f.chi2 <= base.chi2 for f in fits.values())


def test_predictions_that_are_no_numbers_are_no_fit():
    """Guard: whitening takes nan for a missing reading, so a tension below zero once fitted everything."""
    b = bench()
    beyond = q_of(b, "tension_bias", gain=-3.0)  # the belt would be pushed
    values = b.forward.values(beyond[None])[0]
    fit = b.fit([b.start(("tension_bias",), beyond)])[0]
    assert not np.isfinite(values).all()
    assert not np.isfinite(fit.chi2)


def test_an_effect_that_enters_linearly_is_fitted_in_one_step():
    b = bench()
    truth = q_of(b, "yaw_offset_tail", beta_0=3e-4)
    y = b.forward.values(truth[None])[0]
    fit = with_readings(b, y).fit([b.start(("yaw_offset_tail",), b.forward.null())])[0]
    assert fit.chi2 < LINEAR
    (position,) = fit.free
    assert fit.vector[position] == pytest.approx(3.0, rel=1e-4)


@pytest.mark.long
def test_the_interval_is_the_scatter_of_the_estimate():
    """u from the curvature of chi2 against the scatter of refits to readings simulated anew."""
    b, rng = bench(), np.random.default_rng(3)
    levels, base = b.levels, b.forward.values(b.forward.null()[None])[0]
    starts = b.start(("yaw_offset_tail",), b.forward.null())
    drawn = errors(b, 40, rng, white=levels.white, wander=levels.wander)
    found = [with_readings(b, base + e).fit([starts])[0] for e in drawn]
    pulls = [f.vector[f.free[0]] / np.sqrt(f.covariance[0, 0]) for f in found]
    assert 0.65 < np.std(pulls) < 1.4  # 40 draws: +- 11 %, three of which are allowed
    assert abs(np.mean(pulls)) < 3 / np.sqrt(40)


def test_held_out_conditions_are_whole_conditions():
    b = bench()
    found = conditions(b)
    assert set(found) == {"7 N/mm2", "14 N/mm2", "40 N/mm2", "yaw +", "yaw -"}
    for name, out in found.items():
        inside = {(r.tension, np.sign(r.yaw)) for r, o in zip(b.samples.runs, out, strict=True) if o}
        outside = {(r.tension, np.sign(r.yaw)) for r, o in zip(b.samples.runs, out, strict=True) if not o}
        kind = 1 if name.startswith("yaw") else 0
        assert len({i[kind] for i in inside}) == 1
        assert not {i[kind] for i in inside} & {o[kind] for o in outside}


def test_the_largest_yaw_is_left_out_where_there_are_smaller_ones():
    b = bench()
    runs = tuple(replace(r, yaw=r.yaw * (2.0 if k < 3 else 1.0)) for k, r in enumerate(b.samples.runs))
    found = conditions(replace(b, samples=replace(b.samples, runs=runs)))
    assert found["largest yaw"].tolist() == [k < 3 for k in range(len(runs))]


def test_the_search_ends_at_the_truth_and_has_tried_what_is_beside_it():
    found = examined("two")
    assert set(found.named.ids) == {"taper", "yaw_offset_tail"}
    assert all(len(ids) <= MAX_EFFECTS for ids in found.search.fits)
    revolutions = SHAPE["length"] / TEST_RIG.belt_length
    tried = set(found.search.singles)
    assert tried == {c.id for c in CLASSES if c.min_revolutions <= revolutions}
