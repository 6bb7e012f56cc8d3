"""The chain of particles against the rope law: its spans must not ring with the landings and releases of stations."""

from dataclasses import replace

import numpy as np
import pytest

from belt_sim.errors import CannotRepresent
from belt_sim.line.march import march_case
from belt_sim.model import analytic_model
from belt_sim.space import Options
from belt_sim.space.native import run_native
from belt_sim.space.options import BONDS

START = 0.002  # of y_1 after 0.5 m; a kink that begins beside the tangent point is 1 % off, a span that rings 9 %
SAMPLED = 5e-6  # [m]: half a station x yaw is 15 um; a span that rings moves point 3 by 200 um, the wrong way
LATE = 0.005  # of the late rate; with stations 40 mm apart it is 0.2 % off
QUICK = Options(dx=0.04, run_in=0.3, settle=0.2, acceleration=3.0)


@pytest.mark.parametrize(
    ("direction", "points"), [(1.0, (0, 1, 2, 3)), pytest.param(-1.0, (1, 0, 3, 2), marks=pytest.mark.long)]
)
def test_rope_starts_like_the_rope_law(short_rig, direction, points):
    case = replace(short_rig, settings=replace(short_rig.settings, direction=direction))
    curves = run_native(case, belt="rope", travel=0.55, options=QUICK)
    law = march_case(case, analytic_model("rope"), travel=0.55)
    y, exact = (np.array([np.interp(0.5, c.travel, c.y[p]) for p in points]) for c in (curves, law))
    assert y[0] == pytest.approx(exact[0], rel=START)
    assert y[1:] == pytest.approx(exact[1:], abs=SAMPLED)


@pytest.mark.long
def test_late_rate_of_the_rope_law_at_all_four_points(short_rig):
    curves = run_native(short_rig, belt="rope", travel=16.0, options=replace(QUICK, acceleration=1.0))
    law = march_case(short_rig, analytic_model("rope"), travel=16.0)
    slopes = [[np.polyfit(c.travel[c.travel >= 5.0], y[c.travel >= 5.0], 1)[0] for y in c.y] for c in (curves, law)]
    assert slopes[0] == pytest.approx(slopes[1], rel=LATE)


def test_a_limp_belt_with_finite_friction_is_refused(short_rig):
    for belt, bonds in (("rope", BONDS), ("grid", BONDS[:2])):
        with pytest.raises(CannotRepresent, match=r"model\.friction = 0\.3: a limp belt"):
            run_native(short_rig, belt=belt, travel=0.1, options=replace(QUICK, friction=0.3, bonds=bonds))
