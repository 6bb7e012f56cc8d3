"""The span whose sections stay straight: the strip law for small angles, less moment for large ones, as in 3D."""

import math
from dataclasses import replace

import numpy as np
import pytest

from belt_sim.case import Schedule
from belt_sim.line.span import strip
from belt_sim.line.spans import span_responses
from belt_sim.space import Options
from belt_sim.space.native import simulate
from studies.wide_strip import _STEP, March, WideSpan, short_wide_rig

SMALL, LARGE = math.radians(5e-5), math.radians(0.03)  # of yaw
LINEAR = 3e-3  # of the strip's entry moment: v'' of 16 elements at their ends
SPACE = 0.02  # of y_1 after 0.5 m; the strip law is 12 % off


def entry(case, fibres, angle):
    return WideSpan(case, fibres).hold(np.array([0.0, 0.0, 0.0, angle]))


def law(case):
    """Entry moment, carry-over [N m] and tilt per unit of angle."""
    answer = span_responses(case, (), strip(case))
    bending = float(case.belt.bending_stiffness)
    return bending * float(answer.runup[0, 2]), bending * float(answer.runoff[0, 2]), float(answer.mid_tilt[0, 2])


def test_small_angles_are_the_strip_law():
    case = short_wide_rig()
    off, up, tilt = entry(case, "stretched", SMALL)
    assert (up / SMALL, off / SMALL, tilt / SMALL) == pytest.approx(law(case), rel=LINEAR)


@pytest.mark.long
def test_a_large_moment_takes_torsional_stiffness_away():
    """dM/M = -0.3 M^2/(F T), and no edge is slack yet where F/(b h) - 6 M/(b^2 h) says so."""
    case = short_wide_rig()
    ups = {fibres: entry(case, fibres, LARGE)[1] for fibres in ("linear", "stretched", "slack")}
    moment, belt, force = law(case)[0] * LARGE, case.belt, case.tension_force
    torsion = force * belt.width**2 / 12 + belt.shear_modulus * belt.width * belt.thickness**3 / 3
    assert ups["stretched"] / moment - 1 == pytest.approx(-0.3 * ups["stretched"] ** 2 / (force * torsion), rel=0.1)
    assert ups["linear"] < 0.99 * ups["stretched"]
    assert moment > force * belt.width / 6
    assert ups["slack"] == pytest.approx(ups["stretched"], rel=1e-6)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:flex")
def test_the_belt_in_3d_does_what_a_straight_section_does():
    case = short_wide_rig(LARGE)
    curves = simulate(case, travel=0.55, options=Options(run_in=0.3, settle=0.6))
    state = March.from_case(case, "stretched", 0.6).state
    wide = [np.interp(0.5, _STEP * np.arange(len(state)), state[:, k]) for k in (0, 2)]
    seen = [np.interp(0.5, curves.travel, curves.y[k]) for k in (0, 2)]
    assert seen == pytest.approx(wide, rel=SPACE)
    small = replace(case, settings=replace(case.settings, yaw=Schedule.step(SMALL)))
    linear = March.from_case(small, "stretched", 0.6).state * LARGE / SMALL
    assert np.interp(0.5, _STEP * np.arange(len(linear)), linear[:, 0]) > (1 + 4 * SPACE) * wide[0]
