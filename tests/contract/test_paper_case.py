"""The paper's rigs and belt stand in studies/paper/case.py; conf and the virtual rig say the same."""

from omegaconf import OmegaConf

from belt_sim.io import CONF
from belt_sim.settings import belt_from, rig_from
from belt_sim.units import DEGREE
from belt_sim.virtual_rig import plan
from studies.paper.case import PAPER_BELT, ROPE_EXAMPLE, TEST_RIG, YAW


def read(name: str) -> dict:
    return OmegaConf.to_container(OmegaConf.load(CONF / name))


def test_the_command_line_says_the_same():
    assert rig_from(read("rig/test_rig.yaml")) == TEST_RIG
    assert rig_from(read("rig/rope_example.yaml")) == ROPE_EXAMPLE
    assert belt_from(read("belt/paper_belt.yaml")) == PAPER_BELT
    assert read("simulate.yaml")["yaw"] * DEGREE == YAW


def test_the_virtual_rig_says_the_same():
    for name in ("centre_distance", "head_radius", "tail_radius"):
        assert getattr(plan.TEST_RIG, name).value == getattr(TEST_RIG, name)
    for name in ("width", "thickness", "youngs_modulus", "density", "poisson_ratio"):
        assert getattr(plan.TEST_BELT, name).value == getattr(PAPER_BELT, name)
    assert sorted(plan.TEST_YAWS) == [YAW, -YAW]
