"""The paper's belt on its short rig, for the 3D tests."""

import jax
import pytest
from paper_cases import YAW, paper_case

from studies.paper.case import ROPE_EXAMPLE


@pytest.fixture(scope="session")
def short_rig():
    """a = 2 m at 60 N/mm2, where the edge bending stress stays below the tension; yaw -0.042 deg."""
    return paper_case(60, -YAW, ROPE_EXAMPLE)


@pytest.fixture
def float64():
    """JAX in float64, for functions that are called one by one."""
    with jax.enable_x64(True):
        yield
