"""The 3D belt against the strip and rope laws on the short rig."""

from dataclasses import replace

import numpy as np
import pytest

from belt_sim.effects.yaw import Cant, YawCompliance, YawOffsetHead, YawOffsetTail
from belt_sim.line.march import march_case
from belt_sim.model import analytic_model
from belt_sim.space import Options
from belt_sim.space.model import SpaceModel
from belt_sim.space.native import run_native
from belt_sim.space.options import BONDS

NEAR = 0.03  # of y at points 1 and 3; dx = 25 mm stands for a span longer by dx and a start sampled at dx
UPWARDS = 5e-6  # [m], what y may wander by: shaking of landings at 25 mm

BENT = 0.1  # of the largest: read over links of 25 mm beside the pulley, along which the moment falls
SHAKEN = 0.1  # of tilt: landings shake a span that hardly resists tilting

TURNING = (
    YawCompliance(c_m=2e-5),
    YawOffsetTail(beta_0=5e-4),
    YawOffsetHead(beta_0=5e-4),
    Cant(gamma=1e-3, gamma_head=-5e-4),
)
COARSE = 0.08  # of y of the grid at 40 mm between stations

pytestmark = pytest.mark.filterwarnings("ignore:flex")


def at(curves, travel, point):
    return float(np.interp(travel, curves.travel, np.asarray(curves.y)[point]))


def test_sticking_membrane_starts_like_the_strip(short_rig):
    curves = run_native(short_rig, travel=0.6, options=Options(run_in=0.3, settle=0.3, acceleration=2.0))
    law = march_case(short_rig, analytic_model("strip"), travel=0.6)
    for point in (0, 2):
        assert at(curves, 0.55, point) == pytest.approx(at(law, 0.55, point), rel=NEAR, abs=UPWARDS)
    stress = short_rig.settings.tension - 6.0 * np.abs(law.moment) / (
        short_rig.belt.width**2 * short_rig.belt.thickness
    )
    law = replace(law, edge_stress=stress)  # at the run-ups, as in 3D; a line model's is that of both ends
    for name, near in (("angle", BENT), ("moment", BENT), ("edge_stress", NEAR), ("tilt", SHAKEN)):
        late = [np.array([np.interp(0.4, c.travel, row) for row in getattr(c, name)]) for c in (curves, law)]
        np.testing.assert_allclose(*late, atol=near * np.abs(late[1]).max(), err_msg=name)
    np.testing.assert_allclose(curves.sag, law.sag, rtol=NEAR)


@pytest.mark.parametrize(("bonds", "law"), [(BONDS, "strip"), pytest.param(BONDS[:2], "rope", marks=pytest.mark.long)])
def test_grid_starts_like_a_strip_with_diagonals_and_like_a_rope_without(short_rig, bonds, law):
    options = Options(dx=0.04, dt=2e-3, run_in=0.1, settle=0.1, acceleration=3.0, yaw_time=0.1, bonds=bonds)
    curves = run_native(short_rig, belt="grid", travel=0.35, options=options)
    exact = march_case(short_rig, analytic_model(law), travel=0.35)
    assert at(curves, 0.32, 0) == pytest.approx(at(exact, 0.32, 0), rel=COARSE)


@pytest.mark.long
def test_late_rate_of_the_strip(short_rig):
    curves = run_native(short_rig, travel=25.0)
    law = march_case(short_rig, analytic_model("strip"), travel=25.0)
    for point in range(4):
        assert at(curves, 24.9, point) == pytest.approx(at(law, 24.9, point), rel=NEAR)


@pytest.mark.evidence(
    "yaw_compliance",
    "yaw_offset_head",
    "yaw_offset_tail",
    route="3d",
    what="change of y on a short rig, {COARSE} of the largest",
)
def test_what_turns_a_pulley_does_what_the_strip_law_says(short_rig):
    """One effect after the other; the law has them all, at null but for one."""
    options = Options(dx=0.04, dt=2e-3, run_in=0.1, settle=0.1, acceleration=3.0, yaw_time=0.1)
    model, law, null = SpaceModel(options=options), analytic_model("strip"), [cls.null() for cls in map(type, TURNING)]
    plain, straight = model.run(short_rig, (), travel=0.5), march_case(short_rig, law, tuple(null), travel=0.5)
    for k, effect in enumerate(TURNING):
        turned = model.run(short_rig, (effect,), travel=0.5)
        bent = march_case(short_rig, law, (*null[:k], effect, *null[k + 1 :]), travel=0.5)
        seen, expected = (
            np.array([at(with_it, 0.45, point) - at(without, 0.45, point) for point in range(4)])
            for with_it, without in ((turned, plain), (bent, straight))
        )
        assert seen == pytest.approx(expected, abs=COARSE * np.abs(expected).max()), effect.id
