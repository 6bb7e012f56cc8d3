"""The contenders of the bench compute the same belt, whatever the caller's JAX is set to."""

import jax
from paper_cases import paper_case

from studies.bench.plain import plain_march
from studies.bench.task import errors, linear, truth


def test_the_plain_loop_agrees_on_a_slack_belt_without_float64_outside():
    with jax.enable_x64(False):
        case = paper_case(4)
        found = errors(plain_march(linear(case)), truth(case))
    assert found["largest"] < 2e-3
