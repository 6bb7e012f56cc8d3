"""What a mirror, a reversal or a still pulley must do to the belt."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import YAW, marched, paper_case, response, steered

from belt_sim.case import Schedule
from belt_sim.curves import late_rates
from belt_sim.line.march import march_case
from belt_sim.model import analytic_model
from studies.closed_forms import steady_offsets

ROUNDING = 1e-11  # against the largest value of a curve
LATE = 1e-3  # a march of 500 m against the closed form at 40 N/mm2
STEP_AT = Schedule.step(YAW, at=2.0)
UNEQUAL = replace(paper_case(10).rig, head_radius=0.25, tail_radius=0.12)


@pytest.fixture(scope="module", params=["rope", "beam_th2", "strip"])
def runs(request):
    """Eight related marches of one model."""
    cases = {
        "plain": paper_case(40),
        "mirrored": paper_case(40, -YAW),
        "still": paper_case(40, 0.0),
        "reversed": paper_case(40, direction=-1.0),
        "head": paper_case(40, 0.0, yaw_head=Schedule.step(YAW)),
        "both": paper_case(40, yaw_head=Schedule.step(YAW)),
        "double": paper_case(40, 2 * YAW),
        "unequal": paper_case(40, rig=UNEQUAL, yaw_head=Schedule.step(-0.3 * YAW)),
    }
    curves = marched(list(cases.values()), request.param, travel=500.0)
    return request.param, cases, dict(zip(cases, curves, strict=True))


def test_mirrored_yaw_mirrors_the_belt(runs):
    _, _, c = runs
    for name in ("y", "angle", "moment", "tilt"):
        np.testing.assert_array_equal(getattr(c["mirrored"], name), -getattr(c["plain"], name))
    np.testing.assert_array_equal(c["mirrored"].edge_stress, c["plain"].edge_stress)


def test_zero_yaw_is_zero_motion(runs):
    _, _, c = runs
    assert not c["still"].y.any()
    assert not c["still"].moment.any()


def test_motion_is_proportional_to_yaw(runs):
    _, _, c = runs
    np.testing.assert_allclose(c["double"].y, 2 * c["plain"].y, atol=ROUNDING * np.abs(c["plain"].y).max())


def test_reversed_travel_is_the_machine_turned_upside_down(runs):
    """Turned about its long axis, the reversed machine runs forward again: upper and lower change places, and a yaw
    about +z becomes one about -z while y becomes -y: the same curves, points 1-2 and 3-4 exchanged."""
    _, _, c = runs
    np.testing.assert_array_equal(c["reversed"].y, c["plain"].y[[1, 0, 3, 2]])
    np.testing.assert_array_equal(c["reversed"].moment, c["plain"].moment[::-1])


def test_only_the_difference_of_the_yaws_makes_the_belt_run_off(runs):
    _, _, c = runs
    scale = np.abs(late_rates(c["plain"])).max()
    np.testing.assert_allclose(late_rates(c["head"]), -late_rates(c["plain"]), atol=LATE * scale)
    np.testing.assert_allclose(late_rates(c["both"]), 0.0, atol=LATE * scale)


def test_yaws_superpose(runs):
    _, _, c = runs
    np.testing.assert_allclose(c["both"].y, c["plain"].y + c["head"].y, atol=ROUNDING * np.abs(c["plain"].y).max())


@pytest.mark.parametrize("which", ["plain", "head", "unequal"])
def test_late_rates_and_offsets_are_the_closed_forms(runs, which):
    model, cases, c = runs
    case, law = cases[which], analytic_model(model)
    rate = law.steady_rate(case)
    np.testing.assert_allclose(late_rates(c[which]), rate, rtol=LATE)
    wanted = steady_offsets(case, law)
    y = np.asarray(c[which].y)[:, -1]
    np.testing.assert_allclose((y[0] - y[3], y[2] - y[1]), wanted, atol=LATE * np.abs(wanted).max())


def test_a_later_yaw_only_shifts_the_curve():
    early, late = marched([paper_case(10), steered(paper_case(10), STEP_AT)], "strip", travel=50.0)
    np.testing.assert_allclose(late.y[:, 4:], early.y[:, :-4], atol=ROUNDING)
    assert not late.y[:, :4].any()


def test_start_is_straight_and_stuck():
    """The run-up point does not move in the first step: y grows with the square of travel, kappa_0 s^2/2."""
    curves = marched([paper_case(40)], "beam_th2", travel=10.0)[0]
    assert curves.angle[0, 0] == pytest.approx(YAW, rel=1e-12)
    bent = curves.moment[0, 0] / paper_case(40).belt.bending_stiffness
    assert curves.y[0, 1] == pytest.approx(bent * curves.travel[1] ** 2 / 2, rel=0.02)  # kappa falls as it moves


def plain_march(case, travel, step, keep):
    """y (4, n) [m] of the strip by explicit first-order steps, run-offs of one wrapped arc ago by straight lines."""
    ky, ko, ku = (float(x) for x in response(analytic_model("strip").span(case)).runup[:3])
    yaw, wrap = float(case.settings.yaw.last()), float(case.rig.wrap_tail)
    back = int(wrap / step)
    y1, a1, y3, a3 = rows = [[0.0] * (back + 2) for _ in range(4)]

    def earlier(row):
        return row[-1 - back] + (wrap / step - back) * (row[-2 - back] - row[-1 - back])

    kept = [(0.0, 0.0, 0.0, 0.0)]
    for k in range(1, round(travel / step) + 1):
        upper = ky * (y1[-1] - earlier(y3)) + ko * earlier(a3) + ku * (yaw + a1[-1])
        lower = ky * (y3[-1] - earlier(y1)) + ko * (earlier(a1) - yaw) + ku * a3[-1]
        for row, change in zip(rows, (a1[-1], upper, a3[-1], lower), strict=True):
            row.append(row[-1] - step * change)
        if k % round(keep / step) == 0:
            kept.append((y1[-1], earlier(y1), y3[-1], earlier(y3)))
    return np.array(kept).T


def test_a_plain_loop_agrees_to_its_first_order():
    """An independent program of a few lines, first order at 20 mm: it is 1-2 % off at 1 m, and 1e-3 in the whole."""
    case = paper_case(10, YAW)
    y = plain_march(case, 100.0, 0.02, 0.1)
    fine = march_case(case, analytic_model("strip"), travel=100.0, step=0.0125, keep=0.1).y
    assert 5e-3 < abs(y[0, 10] / fine[0, 10] - 1.0) < 3e-2
    assert np.abs(y - fine).max() < 2e-3 * np.abs(fine).max()
