"""Options of XLA come and go with its versions: those that one does not know are left out."""

import numpy as np

from belt_sim.jax_setup import jit_float64, known_options


def test_an_option_of_the_compiler_that_xla_does_not_know_is_left_out():
    known = {"xla_backend_optimization_level": 0}
    effort = known | {"xla_fusion_of_last_year": False}
    assert known_options(effort) == known
    third = jit_float64(lambda x: x / 3.0, effort=effort)(np.ones(2))
    assert np.asarray(third).tolist() == [1 / 3, 1 / 3]
