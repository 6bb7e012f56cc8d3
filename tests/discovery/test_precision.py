"""What is done in single precision, and on fewer knots, is as it would be without."""

import numpy as np
import pytest
from small_discovery import fitted, surveyed

from belt_sim.diagnosis.linearisation import draw_noise
from belt_sim.discovery.linear_search import Targets, form_products
from belt_sim.discovery.responses import single_precision
from belt_sim.discovery.search_data import INPUT_LENGTHS, form_inputs

ROUNDED = 1e-5
FEWER = 0.02  # of the largest; straight lines between every fourth knot


def test_draws_are_whitened_in_single_precision_as_in_double():
    bench, fit = fitted("yaw_creep")
    drawn = draw_noise(bench, bench.samples.y - fit.values, 5, np.random.default_rng(1))
    assert drawn.dtype == np.float32
    white, exact = bench.metric.whiten(drawn), bench.metric.whiten(drawn.astype(float))
    assert (white.dtype, exact.dtype) == (np.float32, np.float64)
    assert np.abs(white - exact).max() < 1e-3 * np.abs(exact).std()


def test_lengths_of_columns_are_as_in_double_precision_also_of_what_cancels():
    """A sensor reads zero where the yaw is applied: a constant in it leaves nothing but rounding."""
    data = surveyed("yaw_creep")
    for name in ("yaw_both", "turn_tail", "sensor_y1"):
        place = next(p for p in data.places if p.name == name)
        ((_, forms, blocks),) = form_products(data, [place], Targets(data.projector.residual[None]))
        gains = [np.asarray(data.states.channel_gain(place, *part), dtype=float)[..., None] for part in place.parts]
        exact = sum(data.design(c).swapaxes(0, 1) * gain for (c, _), gain in zip(place.parts, gains, strict=True))
        for block in blocks:
            own, forms = forms[: len(block.own) - len(block.waves)], forms[len(block.own) - len(block.waves) :]
            if any(f.reads_belt or f.is_carried for f in own):
                continue
            everything = [*own, *(own[k].halves["sin"] for k in block.waves)]
            right = np.sum(np.square(form_inputs(data.states, everything, None, None) @ exact), axis=2)
            found = block.own.T.astype(float)
            seen = right > 1e-9 * right.max()
            np.testing.assert_allclose(found[seen], right[seen], rtol=ROUNDED)
            assert found[~seen].max(initial=0.0) < 2e-9 * right.max()
            if name == "sensor_y1":
                assert np.count_nonzero(~seen)  # there is one that cancels


@pytest.mark.parametrize("apart", sorted(set(INPUT_LENGTHS.values())))
def test_what_is_known_of_a_long_course_is_known_on_fewer_knots(apart):
    data = surveyed("yaw_creep")
    place = next(p for p in data.places if p.name == "yaw_tail")
    basis = data.basis_at(place)
    fewer = basis.with_fewer_knots(apart)
    course = np.cos(np.pi * basis.knots / basis.knots[-1])  # half a wave in the record
    own = course[::apart]
    for few, all_of_it in (
        (
            np.einsum("k,rkl,l->r", own, fewer.information, own),
            np.einsum("k,rkl,l->r", course, basis.information, course),
        ),
        (fewer.pull @ own, basis.pull @ course),
    ):
        assert np.abs(few - all_of_it).max() < FEWER * np.abs(all_of_it).max()


def test_numbers_too_small_for_all_digits_are_none():
    x = np.array([[1e-3, 1e-39, -1e-42], [0.0, 1e-37, np.pi]])
    found = single_precision(x)
    assert found.dtype == np.float32
    assert np.array_equal(found, np.float32([[1e-3, 0.0, 0.0], [0.0, 1e-37, np.pi]]))
