"""The laid belt closes and hangs, the run stops for a yaw step."""

import numpy as np
import pytest
from paper_cases import paper_case

from belt_sim.errors import InputError
from belt_sim.space.model import SpaceModel
from belt_sim.space.native import SpaceRun
from belt_sim.space.options import Options, fit_options
from belt_sim.space.run import plan_in_time
from belt_sim.space.scene import lay_loop
from studies.paper.case import ROPE_EXAMPLE, TEST_RIG

CHORDS_EQUAL = 1e-9  # [m]; the spans are divided by length of arc, which bends by 5 % more in their middle
PARABOLA = 1e-3  # slope^2 / 12, and the circle of the stations 0.15 mm outside the pulley


def test_laid_belt_has_equal_chords_and_hangs():
    case = paper_case(10, 0.0, TEST_RIG)
    loop = lay_loop(case, 0.025)
    chords = np.hypot(np.roll(loop.x, -1) - loop.x, np.roll(loop.z, -1) - loop.z)
    assert chords == pytest.approx(loop.chord, abs=CHORDS_EQUAL)
    slope = 0.5 * case.sag_curvature * 11.28  # at the ends of the span, which begins behind the tops of the pulleys
    span, below = 11.28 - 2.0 * 0.17 * np.sin(slope), 0.17 * (1.0 - np.cos(slope))
    sag = case.sag_curvature * span**2 / 8.0 + below
    middle = np.argmin(np.abs(loop.x - 5.64) + 10.0 * (loop.z < 0.0))
    assert loop.radius_head - loop.z[middle] == pytest.approx(sag, rel=PARABOLA)


def test_belt_stands_still_for_a_yaw_step():
    case = paper_case(60, 1e-3, ROPE_EXAMPLE)
    options = fit_options(Options(belt_speed=1.0, run_in=0.3), case, "flex")
    run = SpaceRun(case, "flex", options)
    plan, resting = plan_in_time(run.scene, 0.5)
    travel, speed, yaw = plan.travel[resting:], plan.speed[resting:], plan.yaw[resting:, 1]
    turning = (yaw > 0.0) & (yaw < 1e-3)
    assert turning.sum() > 200
    assert np.all(travel[turning] == 0.0)
    assert np.all(speed[turning] == 0.0)
    assert np.all(yaw[travel < 0.0] == 0.0)
    assert np.all(yaw[travel > 0.0] == 1e-3)
    assert travel[-1] >= 0.5
    assert np.diff(speed).max() <= (options.acceleration + 1e-9) * options.dt


def test_too_long_a_step_is_refused_in_one_line():
    with pytest.raises(InputError, match=r"model\.dt = 0\.002 s: give at most"):
        fit_options(Options(dt=2e-3, belt_speed=2.0), paper_case(40, 0.0, TEST_RIG), "flex")


@pytest.mark.parametrize(("tension", "yaw", "dx"), [
    (7.0, 0.048, 0.025), (40.0, 0.3, 0.025), (40.0, 0.218, 0.04), (20.0, 0.042, 0.008), (20.0, 0.06, 0.0125),
])  # fmt: skip
def test_a_yaw_step_that_would_fold_the_belt_is_refused_before_the_run(tension, yaw, dx):
    """Each of these ran until its accelerations grew without bound."""
    case = paper_case(tension, np.radians(yaw), ROPE_EXAMPLE)
    for engine in ("native", "mjx"):
        with pytest.raises(InputError, match=r"model\.dt = 0\.001 s: give at most .* folds it"):
            SpaceModel(options=Options(dx=dx, dt=1e-3), engine=engine).run(case, travel=0.1)
        assert SpaceModel(options=Options(dx=dx), engine=engine).options_for(case).dt < 1e-3


@pytest.mark.parametrize(("tension", "yaw", "options"), [
    (12.0, 0.042, {}), (7.0, 0.048, {"dt": 5e-4}), (40.0, 0.3, {"dt": 2e-4}), (7.0, 0.06, {"dx": 0.04}),
    (20.0, 0.042, {"dx": 0.008, "dt": 3e-4}),
])  # fmt: skip
def test_a_yaw_step_that_runs_is_not_refused(tension, yaw, options):
    asked = Options(**({"dt": 1e-3} | options))
    assert SpaceModel(options=asked).options_for(paper_case(tension, np.radians(yaw), ROPE_EXAMPLE)).dt == asked.dt


def test_a_slow_belt_on_mjx_takes_steps_of_the_same_travel():
    """As far as no more than one station lands in them; the other engines keep to 1 ms."""
    steps = [fit_options(Options(), paper_case(t, 0.0, TEST_RIG), "flex", "mjx") for t in (5.0, 7.0, 60.0)]
    for options in steps:
        assert options.step * options.run_speed == pytest.approx(2e-3)
    assert fit_options(Options(), paper_case(7.0, 0.0, TEST_RIG), "flex").step == 1e-3
    with pytest.raises(InputError, match=r"model\.dt = 0\.01 s: give at most 0\.0087 at 2\.00 m/s"):
        fit_options(Options(dt=1e-2), paper_case(60.0, 0.0, TEST_RIG), "flex", "mjx")
