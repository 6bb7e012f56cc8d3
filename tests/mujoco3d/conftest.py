"""The paper's belt on its short rig, for the 3D tests."""

import pytest

from belt_sim.mujoco3d.study import paper_case


@pytest.fixture(scope="session")
def short_rig():
    """a = 2 m at 60 N/mm2, where the edge bending stress stays below the tension; yaw -0.042 deg."""
    return paper_case(2.0, 60.0, -0.042)
