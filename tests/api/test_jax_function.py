"""The march as JAX sees it: its derivatives are those of the curves, its batches are its cases."""

from dataclasses import replace
from functools import partial

import jax
import numpy as np
import pytest

import belt_sim as bs
from belt_sim.effects.load import load_effects
from belt_sim.jax_setup import LEAST_EFFORT, known_options
from belt_sim.settings import make_case

jit = partial(jax.jit, compiler_options=known_options(LEAST_EFFORT))  # each runs once or twice


def _with_tension(case, tension):
    return replace(case, settings=replace(case.settings, tension=tension))


@pytest.mark.parametrize("model", ["strip", pytest.param("beam_th2", marks=pytest.mark.long)])
def test_the_derivative_by_tension_is_that_of_the_curves(model):
    case, size = make_case(tension=10, travel=5), 1e3
    with jax.enable_x64(True):
        run = bs.jax_function(case, model, travel=5)
        end = jit(last := lambda tension: run(_with_tension(case, tension)).y[0, -1])
        slope, above, below = jit(jax.grad(last))(10e6), end(10e6 + size), end(10e6 - size)
    assert float(slope) == pytest.approx(float(above - below) / (2 * size), rel=1e-5)
    assert float(slope) != 0.0


def test_the_derivative_by_an_effect_and_a_batch():
    case = make_case(tension=10, travel=3)
    (taper,) = load_effects([{"id": "taper", "kappa_t": 1e-6}])
    with jax.enable_x64(True):
        run = bs.jax_function(case, travel=3)
        slope = jit(jax.grad(lambda k: run(case, [replace(taper, kappa_t=k)]).y[0, -1]))(1e-6)
        tensions = np.array([7e6, 20e6])
        ends = jit(jax.vmap(lambda t: run(_with_tension(case, t)).y[:, -1]))(tensions)
    one = bs.simulate(case, effects=[taper], travel=3).curves.y[0, -1]
    none = bs.simulate(case, travel=3).curves.y[0, -1]
    assert float(slope) == pytest.approx((one - none) / 1e-6, rel=1e-6)  # the law is linear in the taper
    for tension, end in zip(tensions, np.asarray(ends), strict=True):
        wanted = bs.simulate(_with_tension(case, tension), model="strip_lift_off", travel=3).curves.y[:, -1]
        np.testing.assert_allclose(end, wanted, rtol=1e-9, atol=1e-15)
