"""Edge guides in the scene against the strip law with an elastic stop, and mirrored."""

import numpy as np
import pytest
from paper_cases import YAW, paper_case

from belt_sim.effects.span import EdgeGuide
from belt_sim.line.march import march_case
from belt_sim.model import analytic_model
from belt_sim.space import Options
from belt_sim.space.model import SpaceModel
from studies.paper.case import ROPE_EXAMPLE

NEAR = 0.02  # of y: dx = 40 mm stands for a span longer by dx
MIRRORED = 0.01  # of y: triangles lean to one side
FINE = Options(dx=0.04, dt=2e-3, run_in=0.2, settle=0.3, acceleration=2.0)
GUIDE = EdgeGuide(stiffness=1e6, gap=1e-4, at=0.8)
NEARER = EdgeGuide(stiffness=1e6, gap=3e-5, at=0.8)  # touched sooner
CASE = paper_case(60, -YAW, ROPE_EXAMPLE)

pytestmark = pytest.mark.filterwarnings("ignore:flex")


@pytest.mark.evidence(
    "edge_guide",
    route="3d",
    what="y of all points on the short rig at 60 N/mm2, {NEAR} of the largest",
)
def test_a_guide_holds_the_belt_like_an_elastic_stop():
    curves = SpaceModel(options=FINE).run(CASE, [NEARER], travel=1.5)
    law, free = (march_case(CASE, analytic_model("strip"), e, travel=1.5) for e in ((NEARER,), ()))
    wanted, alone = (np.stack([np.interp(curves.travel, c.travel, y) for y in c.y]) for c in (law, free))
    size = np.abs(wanted).max()
    assert np.abs(alone - wanted).max() > 5 * NEAR * size  # the guide matters
    np.testing.assert_allclose(curves.y, wanted, atol=NEAR * size)


@pytest.mark.long
def test_guides_saturate_the_belt_and_mirror():
    cases = [paper_case(60, yaw, ROPE_EXAMPLE) for yaw in (-YAW, YAW)]
    right, left = (SpaceModel().run(case, [GUIDE], travel=12.0) for case in cases)
    law = march_case(CASE, analytic_model("strip"), (GUIDE,), travel=12.0)
    wanted = np.stack([np.interp(right.travel, law.travel, y) for y in law.y])
    size = np.abs(wanted).max()
    np.testing.assert_allclose(right.y, wanted, atol=NEAR * size)
    np.testing.assert_allclose(left.y, -right.y, atol=MIRRORED * size)
