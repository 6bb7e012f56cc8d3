"""Numbers of the physics sheet, section 4, and the laws of a single span."""

import numpy as np
import pytest
from virtual_bench import ARC, SPAN, YAW, late_rate, measured, plan_of

from belt_sim.campaign import Quantity
from belt_sim.units import MM, MM_PER_M, N_PER_MM2
from belt_sim.virtual_rig.line import RUN_UP, TILT, solve_span
from belt_sim.virtual_rig.march import TrueErrors, true_line
from belt_sim.virtual_rig.plan import RunSetting

LATE_TOLERANCE = 1e-3  # the sheet's tables carry four digits
EARLY_TOLERANCE = 5e-3  # what the sheet asks of a march; this one is ten times closer
TENSIONS = (4, 5, 7, 10, 15, 20, 30, 40, 60, 100)
TH2 = (0.12216, 0.1235, 0.12611, 0.12992, 0.1360, 0.14165, None, 0.16140, None, 0.20137)
STRIP = (0.17827, 0.15278, 0.11764, 0.09419, 0.09133, 0.10409, 0.13268, 0.15201, 0.17469, 0.20094)
ROPE, TH1 = 0.34995, 0.11665
TRANSIENTS = {
    (40, "beam_th2"): (0.1379, 0.4841, 2.0457, 4.0261),
    (40, "strip"): (0.1320, 0.4667, 2.0083, 4.0047),
    (10, "beam_th2"): (0.1218, 0.4365, 1.9447, 3.9679),
    (10, "strip"): (0.0405, 0.1568, 0.8766, 2.7129),
    (7, "beam_th2"): (0.1200, 0.4312, 1.9331, 3.9630),
    (7, "strip"): (0.0211, 0.0831, 0.4880, 1.7017),
}


def steady_rates(base: str, tensions) -> np.ndarray:
    """Late rates [mm/m] for which the curvature at both run-ups of the finite-element spans is 0."""
    plan = plan_of(*(RunSetting(tension=t * N_PER_MM2, yaw=YAW) for t in tensions))
    row = true_line(plan, base, TrueErrors()).span()[0][RUN_UP]
    w0, w1 = -row[1] / row[2] / SPAN, -row[3] / row[2] / SPAN
    return YAW * SPAN * (w1 - w0) / (2 * (SPAN + ARC)) / MM_PER_M


@pytest.mark.parametrize(("base", "table"), [("beam_th2", TH2), ("strip", STRIP)])
def test_late_rates_of_the_sheet(base, table):
    rates = steady_rates(base, TENSIONS)
    known = [k for k, value in enumerate(table) if value is not None]
    np.testing.assert_allclose(rates[known], [table[k] for k in known], rtol=LATE_TOLERANCE)


def test_bounds_are_rope_and_th1():
    rates = steady_rates("beam_th2", (1e-3, 1e6))
    np.testing.assert_allclose(rates, [TH1, ROPE], rtol=1e-2)  # KL = 400 is not infinity: 2/KL


@pytest.mark.parametrize(("case", "expected"), TRANSIENTS.items())
def test_transients_of_the_sheet(case, expected):
    tension, base = case
    _, y = measured(base=base, tension=tension * N_PER_MM2, length=10.0, spacing=1.0)
    np.testing.assert_allclose(y[0, [1, 2, 5, 10]] / MM, expected, rtol=EARLY_TOLERANCE)


@pytest.mark.parametrize("base", ["beam_th2", "strip"])
def test_a_long_march_settles_at_the_steady_rate(base):
    s, y = measured(base=base, length=600.0, spacing=1.0)
    assert late_rate(s, y, 100.0) == pytest.approx(steady_rates(base, (40,))[0], rel=1e-3)


def test_curvature_factors_of_sievers():
    """f1, f2, f3 at KL = 1.128 (physics sheet, section 4)."""
    one = np.ones(1)
    row = solve_span(one, one, 1.128**2 * one, one, 0 * one)[0][RUN_UP, :, 0]
    np.testing.assert_allclose(row, [6.12610, 1.95920, -6.12610, 4.16690], rtol=1e-5)


def test_a_rigid_turn_bends_nothing():
    one = np.ones(1)
    answers, _ = solve_span(7 * one, 3 * one, 5 * one, 0.2 * one, 0.4 * one)
    for answer in answers:
        turned = answer.T @ [0.0, 1.0, 7.0, 1.0]
        np.testing.assert_allclose(turned, 0.0, atol=1e-8 * np.abs(answer).max())


def test_no_sag_no_tilt_and_the_strip_becomes_th2():
    heavy = plan_of(RunSetting(tension=10 * N_PER_MM2, yaw=YAW))
    belt = heavy.belt.__class__(**{**vars(heavy.belt), "density": Quantity(value=1e-3)})
    light = plan_of(*heavy.runs).__class__(**{**vars(heavy), "belt": belt})
    strip, flat = (true_line(light, base, TrueErrors()).span()[0] for base in ("strip", "beam_th2"))
    np.testing.assert_allclose(strip[RUN_UP], flat[RUN_UP], rtol=1e-6)
    assert np.all(flat[TILT] == 0.0)


def test_the_step_is_small_enough():
    _, usual = measured(base="strip")
    _, fine = measured(base="strip", steps=16)
    assert np.abs(usual - fine).max() < 3e-9  # [m]; sensors see 1e-7 at best
