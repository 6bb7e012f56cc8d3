"""The sticking belt on the test rig beside the strip law over 60 m: what the README says of the 3D model."""

import numpy as np
import pytest
from paper_cases import YAW, paper_case

from belt_sim.line.march import march_case
from belt_sim.model import analytic_model
from belt_sim.space.native import run_native

#: of the largest y: 1.1 % is said, to the digit printed, and needed at 10 N/mm2, where the late rates differ by 2 %;
#: 0.2 to 0.7 % at the other tensions
SAID = 0.0115
TRAVEL = 60.0  # [m]: two and a half rounds, the long swing of a slack belt and the drift after it

pytestmark = [pytest.mark.long, pytest.mark.filterwarnings("ignore:flex")]


@pytest.mark.evidence(
    "sag_roll",
    route="3d",
    what="all four points over 60 m at 7 to 40 N/mm2, {SAID} of the largest y (sections level at "
    "the pulleys by construction)",
)
@pytest.mark.parametrize("tension", [7.0, 10.0, 20.0, 40.0])
def test_all_four_points_stay_beside_the_strip_law(tension):
    case = paper_case(tension, -YAW)
    curves = run_native(case, travel=TRAVEL)
    law = march_case(case, analytic_model("strip"), travel=TRAVEL)
    wanted = np.stack([np.interp(curves.travel, law.travel, y) for y in law.y])
    size = np.abs(wanted).max()
    off = np.abs(curves.y - wanted).max(axis=1) / size
    assert curves.travel[-1] > TRAVEL - 0.1
    assert off.max() < SAID, f"points 1-4: {100 * off} % of {1e3 * size} mm"
