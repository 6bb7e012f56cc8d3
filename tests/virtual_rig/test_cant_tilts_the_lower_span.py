"""What a canted pulley lifts sideways in its wrap moves the end of the span behind it, and so tilts that span."""

from dataclasses import replace

import numpy as np
from virtual_bench import RADIUS, plan_of

from belt_sim.virtual_rig.faults.cant import Cant
from belt_sim.virtual_rig.faults.yaw_offset_tail import YawOffsetTail
from belt_sim.virtual_rig.observe import Errors, observe, true_line
from belt_sim.virtual_rig.plan import Setting

GAMMA = 1e-3


def test_the_lower_span_tilts_with_its_run_off():
    """Beside a yaw offset of the cant's even part, in the first quarter turn."""
    plan = plan_of(Setting(tension=10e6, yaw=0.0), length=RADIUS * np.pi / 2, spacing=1e-3)
    plan = replace(plan, signals={"y3": "point_3", "tilt": "lower_mid_span"})
    line = true_line(plan, "strip", Errors())
    even = Cant(gamma=GAMMA).set(line).sag_yaw.item()
    y, tilt = (observe(plan, line, [Cant(gamma=GAMMA)]) - observe(plan, line, [YawOffsetTail(beta_0=even)]))[:, :, 0]
    row, lifted = line.span().tilt[:, 0], RADIUS * GAMMA * (1 - np.cos(plan.travel / RADIUS))
    expected = row[0] * lifted + row[2] * y - row[3] * np.gradient(y, plan.travel)
    assert np.abs(expected).max() > 1e-6  # [rad]
    np.testing.assert_allclose(tilt[1:-1], expected[1:-1], atol=1e-2 * np.abs(expected).max())
