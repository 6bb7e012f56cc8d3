"""Friction, guides, the bending layer and giving pulleys on arrays, each beside what the run in time does with them."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import paper_case

from belt_sim.effects.load import load_effects
from belt_sim.space import Options
from belt_sim.space.model import SpaceModel
from belt_sim.space.native import run_native
from belt_sim.space.quasi_static import compliance_step, prepare_case, simulate_batch
from studies.paper.case import ROPE_EXAMPLE

pytestmark = pytest.mark.filterwarnings("ignore:flex")

COARSE = Options(dx=0.04, dt=1e-3, run_in=0.3, settle=0.3, acceleration=2.0)
CASE = paper_case(20.0, rig=ROPE_EXAMPLE)
ACTING = [
    {"id": "edge_guide", "stiffness": 1e6, "gap": 1e-4, "at": 0.8},
    {"id": "lift_off", "strength": 1.0},
    {"id": "yaw_compliance", "c_m": 2e-5},
]
STIFF = 1e-4  # of the stiffness of a wrap: native reads it off by steps of 1 um
SETTLED = 1e-6  # of the largest limit; native stops at 1e-3
PARITY = 0.01  # of the largest y
FRICTION = 0.15


def scene_of(*effects, friction=np.inf):
    options = replace(COARSE, friction=friction)
    return options, SpaceModel(options=options).parts(CASE, load_effects(list(effects)))


@pytest.fixture(scope="module")
def ready():
    """The laid belt, with everything that may act."""
    options, parts = scene_of(*ACTING, friction=FRICTION)
    return prepare_case(CASE, travel=0.5, options=options, parts=parts)


def test_a_giving_pulley_comes_to_rest_where_the_moment_holds_it(ready):
    """With a moment that falls as it turns, whether it stands or runs."""
    belt = ready.belt
    compliance, stiffness, turned = belt.surfaces.yaw_compliance, 0.7 * float(belt.yaw_stiffness), np.zeros(2)
    for moved in [0.0] * 12 + [0.006] * 60:
        turned = np.asarray(compliance_step(belt, turned, turned, 100.0 - stiffness * turned, np.array(moved)))
        if moved == 0.0:
            standing = turned
    rest = 100.0 * compliance / (1.0 + compliance * stiffness)
    assert standing == pytest.approx(rest, rel=1e-3)
    assert turned == pytest.approx(rest, rel=1e-5)


@pytest.mark.long
def test_belts_with_all_of_it_run_as_in_time():
    """Sticking; and with friction in the same batch, where less of it lets more nodes slide."""
    scenes = [scene_of(*ACTING, friction=friction) for friction in (np.inf, 0.5, 0.2)]
    found = simulate_batch([CASE] * 3, travel=1.0, options=COARSE, parts=[parts for _, parts in scenes])
    native = run_native(CASE, travel=1.0, options=COARSE, parts=scenes[0][1])
    y = np.array([np.interp(native.travel, found[0].travel, line) for line in found[0].y])
    assert np.abs(y - native.y).max() < PARITY * np.abs(native.y).max()
    for curves in found:
        assert curves.extra["friction_residual"].max() < SETTLED
    assert not found[0].extra["sliding_tail"].any()
    assert found[2].extra["sliding_tail"][-1] > found[1].extra["sliding_tail"][-1] > 0.0
