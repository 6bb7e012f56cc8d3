"""The march is of second order in its step, wherever a yaw change falls and whatever the radii."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import RECORDS, YAW, affected, marched, paper_case, steered

from belt_sim.case import Schedule
from belt_sim.line.march import MARCH_STEP, march_case
from belt_sim.model import analytic_model

READ_AT = 16.0  # [m], where marches of different lengths, and so of different steps, are compared
LENGTHS = (20, 10, 5, 1)  # in units of READ_AT: steps of 160, 80, 40 mm, and of 8 mm for the truth
ORDER = 0.3  # errors are no smooth power: the wrapped arc and the yaw change fall between steps
AT_1_M = 2e-4  # what MARCH_STEP promises of y_1 at 1 m, against itself
WOBBLE = 5e-3  # of y of the run-ups: the trapezoidal rule alone would leave 3 % of each swing

UNEQUAL = replace(paper_case(10).rig, head_radius=0.25, tail_radius=0.12)
CASES = {
    "step at the start": paper_case(10),
    "step inside a march step": steered(paper_case(10), Schedule.step(YAW, at=1.2347)),
    "ramp": steered(paper_case(10), Schedule.ramp(YAW, at=0.5671, over=2.3456)),
    "step and back": steered(paper_case(40), Schedule.step(YAW, at=0.3331).then(Schedule.step(-YAW, at=3.3337))),
    "unequal radii": paper_case(10, rig=UNEQUAL),
    "head pulley steered": paper_case(10, 0.0, yaw_head=Schedule.step(YAW, at=0.7777)),
    "slack": paper_case(4),
    "tight": paper_case(100),
}


@pytest.fixture(scope="module")
def errors():
    """Largest error of y over the four points [m], by case: one compiled plan, marches of different lengths."""
    *coarse, fine = (
        np.array([c.y[:, RECORDS // n] for c in marched(list(CASES.values()), "strip", travel=READ_AT * n)])
        for n in LENGTHS
    )
    return {name: [np.abs(y - fine)[k].max() for y in coarse] for k, name in enumerate(CASES)}


@pytest.mark.parametrize("name", CASES)
def test_second_order_in_the_step(errors, name):
    steps = np.array(LENGTHS[:-1], float)
    slope = np.polyfit(np.log(steps), np.log(errors[name]), 1)[0]
    assert slope == pytest.approx(2.0, abs=ORDER), errors[name]


def test_the_default_step_keeps_its_promise():
    case = paper_case(10)
    fine = marched([case], "strip", travel=10.0)[0]
    mine = march_case(case, analytic_model("strip"), travel=10.0)
    assert mine.y[0, 10] == pytest.approx(fine.y[0, 10], rel=AT_1_M)
    assert mine.travel[10] == pytest.approx(1.0)
    assert MARCH_STEP < 0.1


def test_a_wobble_is_right_in_the_steps_of_a_fit():
    """The fastest effect there is, in steps of 0.1 m, a tenth of a pulley's turn, against steps of 10 mm."""
    swings = {"wobble": {"beta_cos": 1e-4, "beta_sin_head": 1e-4}}
    coarse, fine = (affected([(paper_case(40, 0.0), swings)], travel)[0].y for travel in (200.0, 20.0))
    np.testing.assert_allclose(coarse[::2, :11], fine[::2, ::10], atol=WOBBLE * np.abs(fine).max())
